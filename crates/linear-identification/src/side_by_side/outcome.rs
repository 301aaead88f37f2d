//! Result of one method with one order, by measures that are common to all methods.

use ct_signals::{ArModel, Channel, Record, residual_tests};

use super::Outcome;
use crate::{
    Error, Identification, Mended, Method, refined::data, residual::rms, warning::of_gaps,
};

/// Order of the noise model of a simulation error, at most.
const NOISE_ORDER: usize = 6;
/// A parameter whose squared relative standard error is larger does not differ significantly from zero.
const INSIGNIFICANT: f64 = 0.25;

pub(super) fn outcome(
    mended: &Mended,
    test: &[Mended],
    found: &Identification,
) -> Result<Outcome, Error> {
    let record = &mended.whole;
    let on = |record: &Record| -> Result<(Vec<f64>, Vec<f64>), Error> {
        let simulated = found.plant.fitted(&data(record))?;
        let output = record.outputs[0].values.iter();
        let error = output.zip(&simulated).map(|(y, model)| y - model);
        Ok((error.collect(), simulated))
    };
    let (error, simulated) = on(record)?;
    let tested: Vec<Vec<f64>> = test
        .iter()
        .map(|test| Ok(on(&test.whole)?.0))
        .collect::<Result<_, Error>>()?;
    let there = |e: &f64| !e.is_nan();
    let rmse = rms(error.iter().copied().filter(there));
    let spread = spread(std::slice::from_ref(mended));
    let test_rmse = (!test.is_empty()).then(|| rms(tested.iter().flatten().copied().filter(there)));
    let of_plant = found.parameters.iter();
    let of_plant = of_plant.filter(|p| !p.name.starts_with("offset"));
    let estimated = of_plant.clone().count();
    // A delay may be 0.
    let of_plant = of_plant.filter(|p| !p.name.starts_with("delay"));
    let parts: Vec<Option<f64>> = of_plant
        .map(|p| {
            let error = p.std_error.filter(|error| *error > 0.0);
            error.map(|error| (error / p.value).powi(2))
        })
        .collect();
    // Least squares gives no standard errors; for other methods an unknown standard error counts as not significant.
    let significant = found.method == Method::Ls
        || parts
            .iter()
            .all(|part| part.is_some_and(|part| part < INSIGNIFICANT));
    let known: Option<Vec<f64>> = parts.into_iter().collect();
    let step = record.sample_interval();
    let seen = found
        .time_constants
        .iter()
        .all(|constant| *constant >= step);
    let yic = known.map(|parts| {
        let mean = parts.iter().sum::<f64>() / parts.len() as f64;
        2.0 * (rmse / spread).ln() + mean.ln()
    });
    // The error is NaN where readings are missing.
    let readings = record.outputs[0].present().count();
    let lags = (readings / 10).clamp(2, 25);
    let mut input_p = 1.0_f64;
    let inputs: Vec<&Channel> = record.inputs.iter().collect();
    for input in &inputs {
        let (_, p) = residual_tests::prewhitened_input_test(&input.values, &error, lags)?;
        input_p = input_p.min(p * inputs.len() as f64);
    }
    let noise = ArModel::fit(&[&error], NOISE_ORDER.min(readings / 10))?;
    let samples = readings as f64;
    let fitted = (estimated + found.order.n + 1 + noise.order()) as f64;
    Ok(Outcome {
        parameters: found.parameters.clone(),
        time_constants: found.time_constants.clone(),
        rmse,
        fit_percent: 100.0 * (1.0 - rmse / spread),
        test_rmse,
        test_fit_percent: test_rmse
            .map(|rmse| 100.0 * (1.0 - rmse / self::spread(test)))
            .filter(|percent| percent.is_finite()),
        determined: significant && seen,
        bic: 2.0 * samples * noise.sigma().max(f64::MIN_POSITIVE).ln() + fitted * samples.ln(),
        yic,
        whiteness_p: residual_tests::ljung_box(&error, lags, 0)?,
        input_p,
        violated: Vec::new(),
        // Warnings that are common to all methods are reported once.
        warnings: {
            let gaps = of_gaps(mended.gaps);
            let own = found.warnings.iter();
            own.filter(|warning| Some(*warning) != gaps.as_ref())
                .cloned()
                .collect()
        },
        simulated,
    })
}

/// Standard deviation of the outputs' readings, each record about its own mean.
pub(super) fn spread(records: &[Mended]) -> f64 {
    let about_mean = |output: &Channel| {
        let mean = output.present().sum::<f64>() / output.present().count().max(1) as f64;
        output.present().map(|y| y - mean).collect::<Vec<f64>>()
    };
    rms(records
        .iter()
        .flat_map(|record| about_mean(&record.whole.outputs[0])))
}
