//! The learning phase of a user's own model: a fit to the first rows by `greybox`, and the noise model of each output.
//!
//! Lost readings are left out of the likelihood, and need nothing in their place. The slowest time constant is that of the fitted model,
//! linearised at its mean state under the mean inputs: from the eigenvalues of `dx(t + h)/dx(t)`, which the simulation gives exactly.
//! A model that does not settle there is not watched: it would leave the plant for ever, however right it is.

use ct_model::{Dual, Scalar, Simulation};
use ct_signals::Hold;
use greybox::{FitOptions, ModelSetup, spectral_radius};
use nalgebra::DMatrix;

use super::OwnModel;
use crate::{
    intake::Sample,
    learn::{Learned, OutputNoise, READ, covariance, output_noise, record, stands_still},
};

/// Number of states for which one simulation computes derivatives.
const LANES: usize = 4;
/// An eigenvalue closer to one does not decay within the stored rows.
const SETTLES: f64 = 1e-7;

/// The fit, and the states at the first row; or the reason in words why there is none.
pub(super) fn learn(
    own: &OwnModel,
    samples: &[Sample],
    hold: Hold,
) -> Result<(Learned, Vec<f64>), String> {
    let spec = own.model.spec();
    let outputs = spec.outputs.len();
    let mut readings = vec![Vec::with_capacity(samples.len()); outputs];
    for (output, readings) in readings.iter_mut().enumerate() {
        let own_readings = samples
            .iter()
            .map(|s| s.outputs[output].unwrap_or(f64::NAN));
        readings.extend(own_readings);
        let missing = readings.iter().filter(|value| value.is_nan()).count();
        if ((samples.len() - missing) as f64) < READ * samples.len() as f64 {
            return Err(format!(
                "{missing} of {} rows have no reading of {}: check the sensor",
                samples.len(),
                own.output(output).name
            ));
        }
    }
    let records = &[record(samples.iter(), spec.inputs.len(), readings, hold)];
    let record = records.first().ok_or("no row")?;
    if let Some(still) = spec
        .inputs
        .iter()
        .zip(&record.inputs)
        .map(|(input, channel)| {
            let (low, high) = channel.range();
            stands_still(low, high).then(|| format!("{} at {low}", input.about.name))
        })
        .collect::<Option<Vec<String>>>()
        && !still.is_empty()
    {
        return Err(format!(
            "every input has been constant ({}), which does not excite the plant: move one",
            still.join(", ")
        ));
    }
    let said = |error: &dyn std::fmt::Display| error.to_string();
    let setup = ModelSetup::new(&own.model, records, &own.known, own.time_unit)
        .and_then(|setup| setup.with_priors(&own.priors))
        .map_err(|error| said(&error))?;
    ct_signals::require_samples(records, setup.free().len()).map_err(|error| said(&error))?;
    let options = FitOptions::default();
    let fit = setup.fit(&options).map_err(|error| said(&error))?;
    let fit = estimation::coloured(&setup, fit, options.noise_order, options.stopping)
        .map_err(|error| said(&error))?;
    if !fit.is_determined() || fit.correlations().is_none() {
        let free = setup.free();
        let silent = (0..free.len()).filter(|&i| fit.triangle.column_norm(i) <= f64::MIN_POSITIVE);
        let silent: Vec<&str> = silent.map(|i| setup.names()[free[i]].as_str()).collect();
        return Err(if silent.is_empty() {
            "the rows determine the parameters only in combination: fix one of them, give a prior, or move the inputs more".into()
        } else {
            format!(
                "{} has no effect on the readings: fix it, or move the inputs more",
                silent.join(", ")
            )
        });
    }
    let all = setup.parameter_count();
    let (x, states) = fit.x.split_at(all);
    let residuals = estimation::residuals(&setup, &fit.x).ok_or("the fit is not finite")?;
    let noise_of = |(output, residuals): (usize, Vec<f64>)| {
        let parameters = setup.free().len();
        output_noise(
            fit.noise.output(output),
            residuals,
            samples,
            output,
            parameters,
        )
    };
    let noises: Result<Vec<OutputNoise>, String> =
        residuals.into_iter().enumerate().map(noise_of).collect();
    let watched = own.watched();
    let theta: Vec<f64> = watched.iter().map(|&i| x[i]).collect();
    let of_all = covariance(&fit, all, 1.0)?;
    let pairs = watched
        .iter()
        .flat_map(|i| watched.iter().map(move |j| i * all + j));
    let covariance = pairs.map(|at| of_all[at]).collect();
    let interval = record.sample_interval();
    let operating = mean_states(own, &theta, states, samples, hold)?;
    let time_constant = time_constant(own, &theta, &operating, samples, interval)?;
    let learned = Learned {
        theta,
        covariance,
        outputs: noises?,
        time_constant,
        interval,
        operating,
        scales: None,
        substeps: 0,
    };
    Ok((learned, states.to_vec()))
}

/// The states' means over the rows, under the fitted model.
fn mean_states(
    own: &OwnModel,
    theta: &[f64],
    states: &[f64],
    samples: &[Sample],
    hold: Hold,
) -> Result<Vec<f64>, String> {
    let mut simulation =
        Simulation::<f64>::new(&own.model, &own.parameters_with(theta), states, 0.0);
    let mut sums = states.to_vec();
    let mut time = 0.0;
    for pair in samples.windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        time += (to.time - from.time) / own.time_unit;
        let ends = match hold {
            Hold::Zero => &from.inputs,
            Hold::First => &to.inputs,
        };
        simulation
            .advance(&from.inputs, ends, time)
            .map_err(|error| error.to_string())?;
        for (sum, x) in sums.iter_mut().zip(simulation.state()) {
            *sum += x;
        }
    }
    Ok(sums
        .into_iter()
        .map(|sum| sum / samples.len() as f64)
        .collect())
}

/// The slowest time constant \[s\] at these states, under the mean inputs.
fn time_constant(
    own: &OwnModel,
    theta: &[f64],
    states: &[f64],
    samples: &[Sample],
    interval: f64,
) -> Result<f64, String> {
    let n = states.len();
    if n == 0 {
        // A model without states responds at once.
        return Ok(interval);
    }
    let mean = |i: usize| samples.iter().map(|s| s.inputs[i]).sum::<f64>() / samples.len() as f64;
    let inputs: Vec<f64> = (0..own.model.spec().inputs.len()).map(mean).collect();
    let constant = |value: &f64| Dual::<LANES>::variable(*value, LANES);
    let parameters: Vec<_> = own.parameters_with(theta).iter().map(constant).collect();
    let mut transition = DMatrix::zeros(n, n);
    for first in (0..n).step_by(LANES) {
        let lane = |i: usize| i.checked_sub(first).unwrap_or(LANES);
        let initial: Vec<_> = (0..n).map(|i| Dual::variable(states[i], lane(i))).collect();
        let mut simulation = Simulation::new(&own.model, &parameters, &initial, 0.0);
        simulation
            .advance(&inputs, &inputs, interval / own.time_unit)
            .map_err(|error| error.to_string())?;
        for (row, x) in simulation.state().iter().enumerate() {
            for (lane, slope) in x.eps.iter().enumerate().take(n - first) {
                transition[(row, first + lane)] = *slope;
            }
        }
    }
    let largest = spectral_radius(&transition);
    if largest > 1.0 - SETTLES || largest.is_nan() {
        return Err(
            "the fitted model does not settle under steady inputs, so that it cannot run in parallel with the plant".into(),
        );
    }
    // A response that decays within one interval has a time constant far below the interval.
    Ok((-interval / largest.max(f64::MIN_POSITIVE).ln()).max(1e-3 * interval))
}
