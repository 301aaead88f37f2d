//! The two recursions over a scaled record.

mod band;
mod drift;
mod equation_error;
mod output_error;
mod path;
mod scaled;
mod simulation;

use ct_signals::Record;
use missing_effect::Parameter;

use self::scaled::Scaled;
use crate::{
    Error, Identification, Method, Order, Request, Shown,
    checks::{moves, positive},
    parameters::{names, plant, poles},
    residual::{errors, rms},
    warning::{doubtful, too_fast, unsure, worse_than_first_order},
};
pub use drift::{Drift, OverLevel};

/// Identification by a recursion without a loop.
pub(crate) fn identify(record: &Record, request: &Request) -> Result<Identification, Error> {
    // Filters and model begin with the first reading.
    let first = record.outputs[0].values.iter().position(|y| !y.is_nan());
    let record = &record.rows(first.unwrap_or(0)..record.len());
    let order = request.order;
    ct_signals::require_samples(std::slice::from_ref(record), order.parameters() + order.n)?;
    moves(record, &record.inputs[0])?;
    moves(record, &record.outputs[0])?;
    positive("memory", "s", request.memory)?;
    positive("bandwidth", "1/s", request.bandwidth)?;

    let (scaled, mut warnings) = Scaled::new(record, request);
    scaled.check_bandwidth()?;
    let path = match request.method {
        Method::CtRls => equation_error::equation_error(&scaled, order),
        _ => output_error::output_error(&scaled, order),
    }?;
    warnings.extend(path.warnings.iter().cloned());
    let (simulated, initial) =
        simulation::simulate(&scaled, order, &path.last()?.theta).map_err(|error| {
            Error::NoModel {
                record: record.name.clone(),
                order,
                why: error.to_string(),
            }
        })?;
    let bands = band::bands(&path, &scaled);
    let names = names(order, record);
    let parameters: Vec<Parameter> = names
        .into_iter()
        .enumerate()
        .map(|(i, (name, unit))| Parameter {
            prior: None,
            name,
            unit,
            value: bands.values[i].last().copied().unwrap_or(f64::NAN),
            std_error: bands.std_errors[i]
                .last()
                .copied()
                .filter(|e| e.is_finite()),
        })
        .collect();
    warnings.extend(doubtful(&parameters, order));
    let plant = plant(&parameters, order);
    let (time_constants, oscillations) = poles(&plant.a)?;
    if !path.held {
        warnings.extend(unsure(&parameters, &scaled.settings()));
    }
    warnings.extend(too_fast(&time_constants, record, order));
    warnings.extend(initial);
    let rmse = rms(errors(&record.outputs[0], &simulated));
    warnings.extend(worse_than_first_order(
        (request.method, order),
        rmse,
        &scaled.settings(),
        &record.outputs[0].unit,
    ));
    Ok(Identification {
        schema: 2,
        method: request.method,
        order,
        record: record.name.clone(),
        settings: Some(scaled.settings()),
        parameters,
        time_constants,
        oscillations,
        simulation_rmse: rmse,
        fit_percent: 100.0 * (1.0 - rmse / scaled.output_deviation()),
        warnings,
        drift: drift::over_level(&bands, &scaled, order),
        trajectory: Some(bands),
        in_loop: None,
        refined: None,
        gaps: None,
        plant,
        shown: Shown {
            time: record.time.clone(),
            input: record.inputs[0].clone(),
            output: record.outputs[0].clone(),
            simulated,
        },
    })
}

/// The start: as many equal lags as n, which sum up to the time constant of first order, its gain and its offset.
fn start(scaled: &Scaled, order: Order) -> Vec<f64> {
    let mut theta = lags(order.n);
    theta.push(scaled.first_order[0]);
    theta.resize(order.n + order.m + 1, 0.0);
    theta.push(scaled.first_order[1]);
    theta
}

/// `a_1` to `a_n` of `(1 + s/n)^n`.
fn lags(n: usize) -> Vec<f64> {
    let mut a = vec![0.0; n + 1];
    a[0] = 1.0;
    for degree in 1..=n {
        for i in (1..=degree).rev() {
            a[i] += a[i - 1] / n as f64;
        }
    }
    a.remove(0);
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lags_are_those_of_the_binomial() {
        assert_eq!(lags(1), [1.0]);
        assert_eq!(lags(2), [1.0, 0.25]);
        let third = lags(3);
        for (a, b) in third.iter().zip([1.0, 1.0 / 3.0, 1.0 / 27.0]) {
            assert!((a - b).abs() < 1e-15);
        }
    }
}
