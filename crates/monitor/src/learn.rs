//! Learning phase: the believed model is fitted to the first rows of all outputs, and a noise model to the residual of each output.

mod learned;

use std::collections::BTreeMap;

use ct_signals::{ArModel, Channel, Hold, Record};
use greybox::{Fit, FitOptions, LinearPlant, Setup, coloured, fit_from, random_starts};

pub use self::learned::Model;
pub(crate) use self::learned::{Learned, OutputNoise};
use crate::{intake::Sample, lost::expect, lost::interpolated, scatter::Limit};

/// A command with a smaller relative change is constant.
const STILL: f64 = 1e-9;

/// Least share of rows with a reading of each output.
pub(crate) const READ: f64 = 0.5;

/// Number of iterated fits with expected values for missing readings: each reduces the preceding error by the share of the missing
/// information.
const ROUNDS: usize = 2;

const NO_NOISE: &str =
    "the residual is zero, so no threshold can be set: are the readings measured?";

/// Larger values are never learned: a state with larger values would need endless computing time.
const MOST_SUBSTEPS: usize = 1024;
const MOST_COEFFICIENTS: usize = 64;

/// Whether an input with this range is constant.
pub(crate) fn stands_still(low: f64, high: f64) -> bool {
    high - low <= STILL * high.abs().max(low.abs())
}

/// Rows as a record, with the readings of each output; the time counts from the first.
pub(crate) fn record<'a>(
    rows: impl Iterator<Item = &'a Sample>,
    inputs: usize,
    readings: Vec<Vec<f64>>,
    hold: Hold,
) -> Record {
    let outputs = readings.into_iter();
    let mut record = Record {
        name: "the rows".to_string(),
        time: Vec::new(),
        inputs: vec![Channel::default().with_hold(hold); inputs],
        outputs: outputs
            .map(|readings| Channel::new("", "", readings))
            .collect(),
        ..Record::default()
    };
    let mut first = None;
    for row in rows {
        record.time.push(row.time - *first.get_or_insert(row.time));
        for (channel, value) in record.inputs.iter_mut().zip(&row.inputs) {
            channel.values.push(*value);
        }
    }
    record
}

/// State of a sticking valve within its band at the start of a record.
pub(crate) const BEGIN: &str = "stiction_backlash.begin";

/// The fit, and the levels at the first row; or the reason in words why there is none.
///
/// Where readings are lost, what is expected of them under the fitted model and its noise can replace them, and the fit is repeated (after
/// the EM algorithm, A. P. Dempster, N. M. Laird, D. B. Rubin, J. Royal Statistical Society B 39, 1977, without the covariance of what is
/// missing: the more readings are lost, the more coloured the noise looks).
pub(crate) fn learn(
    model: &Model,
    samples: &[Sample],
    hold: Hold,
) -> Result<(Learned, Vec<f64>), String> {
    let vessels = model.known.outputs(model.plant);
    let outputs = vessels.len();
    let mut filled = Vec::with_capacity(outputs);
    // For each output the rows without a reading.
    let mut lost: Vec<Vec<usize>> = Vec::with_capacity(outputs);
    for output in 0..outputs {
        let readings: Vec<Option<f64>> = samples.iter().map(|s| s.outputs[output]).collect();
        let missing = (0..samples.len()).filter(|&k| readings[k].is_none());
        lost.push(missing.collect());
        let missing = lost[output].len();
        let enough = (samples.len() - missing) as f64 >= READ * samples.len() as f64;
        let Some(values) = interpolated(&readings).filter(|_| enough) else {
            let of = match vessels[..] {
                [_] => String::new(),
                _ => format!(" of {}", model.plant.level_name(vessels[output])),
            };
            return Err(format!(
                "{missing} of {} rows have no reading{of}: check the sensor",
                samples.len()
            ));
        };
        filled.push(values);
    }
    let records = &[record(samples.iter(), 1, filled, hold)];
    let options = FitOptions::default();
    let said = |error: &dyn std::fmt::Display| error.to_string();
    let mut fixed = model.fixed();
    // The simulation continues from the last state, and does not start again within the band.
    fixed.insert(BEGIN.into(), 0.0);
    let bare = Setup::from_records(
        model.plant,
        model.known.clone(),
        &[],
        records,
        BTreeMap::new(),
    )
    .map_err(|error| said(&error))?;
    let structure = model
        .structure(bare.structure.scales)
        .map_err(|error| said(&error))?;
    let mut setup = Setup::new(structure, records, fixed)
        .and_then(|setup| setup.with_priors(&model.priors))
        .map_err(|error| said(&error))?;
    let record = records.first().ok_or("no row")?;
    ct_signals::require_samples(records, setup.free().len()).map_err(|error| said(&error))?;
    let (low, high) = record.input_range();
    if stands_still(low, high) {
        return Err(format!(
            "the command has been constant at {low}, which does not excite the plant: move it"
        ));
    }
    let mut starts = random_starts(&setup, options.starts, options.seed);
    if let (false, Some(first)) = (model.start.is_empty(), starts.first()) {
        let mut guessed = first.clone();
        for (name, value) in setup.names().iter().zip(&mut guessed) {
            *value = model.start.get(name).copied().unwrap_or(*value);
        }
        starts.push(guessed);
    }
    let white = setup.white_noise();
    let fit = fit_from(&setup, &starts, &white, options.stopping).map_err(|error| said(&error))?;
    setup
        .choose_substeps(&fit.x)
        .map_err(|error| said(&error))?;
    setup.structure.scales = setup.scales_at(&fit.x).map_err(|error| said(&error))?;
    let setup = setup
        .with_structure(setup.structure.clone())
        .map_err(|error| said(&error))?;
    let fit = fit_from(&setup, &[fit.x], &white, options.stopping).map_err(|error| said(&error))?;
    let mut fit = coloured(&setup, fit, options.noise_order, options.stopping)
        .map_err(|error| said(&error))?;
    let mut refilled = records.clone();
    if lost.iter().any(|lost| !lost.is_empty()) {
        for _ in 0..ROUNDS {
            fit = again(&setup, &mut refilled, &fit, &lost, &options)
                .map_err(|error| said(&error))?;
        }
    }

    let n = setup.parameter_count();
    // The replacement of a missing reading has no noise and adds no information. The output with the most missing readings determines the
    // number of rows.
    let read = |output: usize| samples.len() - lost[output].len();
    let all_over_read = |output: usize| samples.len() as f64 / read(output) as f64;
    let most = (0..outputs).map(all_over_read).fold(1.0, f64::max);
    let widened = most * most;
    let covariance = covariance(&fit, n, widened)?;
    let residuals = setup.residuals(&fit.x).map_err(|error| said(&error))?;
    let of_output = |(output, residuals): (usize, Vec<f64>)| {
        let noise = fit.noise.output(output);
        let noise = noise.with_sigma(noise.sigma() * all_over_read(output).sqrt());
        output_noise(&noise, residuals, samples, output, setup.free().len())
    };
    let outputs: Result<Vec<OutputNoise>, String> =
        residuals.into_iter().enumerate().map(of_output).collect();
    let noises = outputs?;
    let commands = &record.inputs[0].values;
    let mean = commands.iter().sum::<f64>() / commands.len() as f64;
    let interval = record.sample_interval();
    let linear =
        LinearPlant::at(&setup.structure, &fit.x[..n], mean).map_err(|error| said(&error))?;
    let slowest = linear
        .a
        .iter()
        .enumerate()
        .map(|(i, row)| -interval / row[i].ln())
        .fold(0.0, f64::max);
    if !(slowest.is_finite() && slowest > 0.0) {
        return Err("the fitted plant does not settle".into());
    }
    let learned = Learned {
        theta: fit.x[..n].to_vec(),
        covariance,
        outputs: noises,
        time_constant: slowest,
        interval,
        operating: setup.structure.scales.operating_level.to_vec(),
        scales: Some(setup.structure.scales.clone()),
        substeps: setup.substeps,
    };
    let levels = fit.x[n..].to_vec();
    Ok((learned, levels))
}

/// The covariance of a fit's first `n` entries, row by row, this many times as large; zero for what was not fitted, or held at a bound.
pub(crate) fn covariance(fit: &Fit, n: usize, widened: f64) -> Result<Vec<f64>, String> {
    let errors = fit.std_errors();
    let mut covariance = vec![0.0; n * n];
    let determined = fit.correlations().filter(|_| fit.is_determined());
    let Some((positions, correlations)) = determined else {
        return Err(
            "the rows do not determine the parameters: the command has not moved enough".into(),
        );
    };
    let named = || positions.iter().enumerate().filter(|(_, i)| **i < n);
    for (a, &i) in named() {
        for (b, &j) in named() {
            let (Some(ei), Some(ej)) = (errors[i], errors[j]) else {
                continue;
            };
            covariance[i * n + j] = widened * correlations[a][b] * ei * ej;
        }
    }
    if !covariance.iter().all(|c| c.is_finite()) {
        return Err(NO_NOISE.into());
    }
    Ok(covariance)
}

/// The noise of an output from the residuals of a fit with this number of `parameters`.
pub(crate) fn output_noise(
    noise: &ArModel,
    residuals: Vec<f64>,
    samples: &[Sample],
    output: usize,
    parameters: usize,
) -> Result<OutputNoise, String> {
    let sigma = noise.sigma();
    if !(sigma.is_finite() && sigma > 0.0) {
        return Err(NO_NOISE.into());
    }
    let mut whitener = noise.whitener(1);
    let mut innovations = Vec::with_capacity(residuals.len());
    for (mut residual, sample) in residuals.into_iter().zip(samples) {
        if sample.outputs[output].is_some() {
            whitener.push(std::slice::from_mut(&mut residual));
            innovations.push(residual / sigma);
        } else {
            whitener.skip();
        }
    }
    // With several outputs, each has fewer parameters than assumed: the limit is slightly wide.
    let scatter = Limit::learned(&innovations, parameters)
        .ok_or("the residual is zero, so no threshold can be set: do the readings move?")?;
    Ok(OutputNoise {
        coefficients: noise.coefficients().to_vec(),
        sigma,
        readings: innovations.len(),
        scatter,
    })
}

/// The fit repeated with the expected values of missing readings in the record.
fn again(
    setup: &Setup,
    records: &mut [Record; 1],
    fit: &Fit,
    lost: &[Vec<usize>],
    options: &FitOptions,
) -> Result<Fit, greybox::Error> {
    let before = setup.with_records(&*records)?;
    let residuals = before.residuals(&fit.x)?;
    let outputs = records[0].outputs.iter_mut().zip(lost);
    for (o, ((output, lost), residual)) in outputs.zip(&residuals).enumerate() {
        let mut expected = residual.clone();
        expect(fit.noise.output(o), &mut expected, lost);
        for &k in lost {
            output.values[k] += expected[k] - residual[k];
        }
    }
    let setup = setup
        .with_records(&*records)?
        .with_priors(&setup.prior_values())?;
    let next = fit_from(
        &setup,
        std::slice::from_ref(&fit.x),
        &fit.noise,
        options.stopping,
    )?;
    coloured(&setup, next, options.noise_order, options.stopping)
}
