//! The noise floor: the noise model of the residual of the largest accepted model.

use ct_signals::ArModel;
use greybox::{Noise, Setup, prewhitened};

use crate::{
    Error,
    fit::node::{Node, STOPPING},
};

/// Largest order of the noise model.
pub(crate) const NOISE_ORDER: usize = 6;

/// The noise model of a model's residual, corrected for the bias that fitting causes.
pub(crate) fn noise_of(node: &Node) -> Result<Noise, Error> {
    Ok(greybox::noise_of(&node.setup, &node.fit, NOISE_ORDER)?)
}

/// Limit of the correlation time of the noise model that prewhitens the search, as a share of the longest record.
///
/// With a pole near the unit circle the filter would explain every slow effect as noise, and the simulation could drift. Noise with a longer
/// correlation time leaves fewer than about ten independent samples: too few to show that it is noise.
const LONGEST_MEMORY: f64 = 1.0 / 15.0;

/// The longest memory of a noise model \[samples\].
pub(crate) fn longest_memory(setup: &Setup) -> f64 {
    let lengths = setup.records.iter().map(|record| record.len());
    LONGEST_MEMORY * lengths.max().unwrap_or(1) as f64
}

/// The model fitted with the noise model of its own residual, with limited memory.
pub(crate) fn in_own_noise<'a>(node: &Node<'a>) -> Result<Node<'a>, Error> {
    let memory = Some(longest_memory(&node.setup));
    Ok(Node {
        fit: prewhitened(&node.setup, node.fit.clone(), NOISE_ORDER, memory, STOPPING)?,
        ..node.clone()
    })
}

/// The noise model of residuals without correction for the part of the noise that the fit has absorbed.
pub(crate) fn residual_noise(setup: &Setup, residuals: &[Vec<f64>]) -> Result<Noise, Error> {
    let noise = Noise::fit(residuals, setup.outputs(), NOISE_ORDER);
    Ok(noise.map_err(greybox::Error::from)?)
}

/// The criterion of a model with its present parameters, with its residual whitened by an AR model: a fit with this weighting would give a
/// slightly lower value.
pub(crate) fn bic_in_residual_noise(node: &Node) -> Result<f64, Error> {
    let residuals = node.setup.disturbance(&node.fit.x)?;
    let noise = residual_noise(&node.setup, &residuals)?;
    let mut costs = vec![0.0; noise.outputs()];
    let mut log_det = 0.0;
    for (i, (segment, whitened)) in residuals.iter().zip(noise.whiten(&residuals)).enumerate() {
        let present = whitened.iter().filter(|w| !w.is_nan());
        costs[i % noise.outputs()] += present.map(|w| w * w).sum::<f64>();
        let model = noise.of_series(i);
        log_det += model.log_det_of(segment.iter().map(|e| !e.is_nan()));
    }
    let outputs = costs.iter().zip(node.setup.samples_per_output());
    let deviance: f64 = outputs
        .map(|(cost, &n)| n as f64 * (cost / n as f64).max(f64::MIN_POSITIVE).ln())
        .sum();
    Ok(deviance + log_det + node.setup.bic_penalty(noise.order()))
}

/// The noise's spectrum at frequency zero over its mean: factor by which slow parameters are less certain than with white noise of the same
/// variance.
pub(crate) fn slowness_of(noise: &ArModel) -> f64 {
    let sum: f64 = noise.coefficients().iter().sum();
    ((noise.sigma() / (1.0 - sum)).powi(2) / noise.stationary_std().powi(2)).max(1.0)
}

/// Samples per independent sample for several outputs together.
pub(crate) fn slowness(noise: &Noise, samples: &[usize]) -> f64 {
    if let [only] = samples {
        return if *only > 0 {
            slowness_of(noise.output(0))
        } else {
            1.0
        };
    }
    let independent = noise.iter().zip(samples);
    let independent: f64 = independent
        .map(|(noise, &samples)| samples as f64 / slowness_of(noise))
        .sum();
    samples.iter().sum::<usize>() as f64 / independent.max(f64::MIN_POSITIVE)
}

/// Least number of independent samples per parameter for a prewhitened fit.
const SAMPLES_PER_PARAMETER: f64 = 10.0;

/// Whether the noise of the largest model's residual is so slow that the records contain few independent samples of it.
///
/// A prewhitened fit with such a noise model uses changes from sample to sample only, and its simulation drifts; the residual usually contains
/// physics that the catalogue does not describe. Effects are still tested with this noise model, which accepts fewer of them; the reported
/// models are fitted to the simulation error.
pub(crate) fn is_slow(node: &Node, noise: &Noise) -> bool {
    let independent =
        node.setup.samples() as f64 / slowness(noise, node.setup.samples_per_output());
    noise.order() > 0 && independent < SAMPLES_PER_PARAMETER * node.setup.free().len() as f64
}
