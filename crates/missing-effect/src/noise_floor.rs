//! The noise floor: the colour of the residual of the richest model in play.

use ct_signals::ArModel;

use crate::{Error, search::Node};

/// Largest order of the noise model.
pub(crate) const NOISE_ORDER: usize = 6;
/// Below this p-value a residual is not noise: the input still shows in it.
const INPUT_SHOWS: f64 = 1e-4;

/// The autoregressive model of a node's residual.
pub(crate) fn colour(node: &Node) -> Result<ArModel, Error> {
    let residuals = node.setup.residuals(&node.fit.x)?;
    let segments: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
    Ok(ArModel::fit(&segments, NOISE_ORDER)?)
}

/// p-value of the test that the input does not show in a node's residual; of several records the smallest, corrected
/// for having taken it.
pub(crate) fn input_p(node: &Node) -> Result<f64, Error> {
    let residuals = node.setup.residuals(&node.fit.x)?;
    let records = node.setup.records;
    let mut least: f64 = 1.0;
    for (record, residual) in records.iter().zip(&residuals) {
        let lags = (record.len() / 10).clamp(2, 25);
        let (_, p) = ct_signals::residual_tests::prewhitened_input_test(
            &record.input.values,
            residual,
            lags,
        )?;
        least = least.min(p);
    }
    Ok((least * records.len() as f64).min(1.0))
}

/// The noise's spectrum at frequency zero over its mean: by how much slow parameters are less certain than under
/// white noise of the same size.
pub(crate) fn slowness(noise: &ArModel) -> f64 {
    let sum: f64 = noise.coefficients().iter().sum();
    ((noise.sigma() / (1.0 - sum)).powi(2) / noise.stationary_std().powi(2)).max(1.0)
}

/// Whether the colour of the richest model's residual is structure rather than noise.
///
/// Were it noise, a fit by simulation error and one in the noise's metric would differ by chance alone: the first
/// overfits the sum of squares by about `p slowness/N`. Where the second simulates worse by three times that and
/// more, the colour is not the noise's.
pub(crate) fn structure_remains(by_simulation: &Node, by_noise: &Node, noise: &ArModel) -> bool {
    let chance = 3.0 * by_simulation.setup.free().len() as f64 * slowness(noise)
        / by_noise.setup.samples() as f64;
    (by_noise.fit.rmse / by_simulation.fit.rmse).powi(2) > 1.0 + chance
}

/// Whether the input still shows in a node's residual.
pub(crate) fn input_shows(node: &Node) -> Result<bool, Error> {
    Ok(input_p(node)? < INPUT_SHOWS)
}
