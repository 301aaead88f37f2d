//! Fits under an autoregressive noise model.

use ct_signals::ArModel;

use super::{Fit, fit_from};
use crate::{Error, Noise, Residuals, Stopping, marginal, residuals, rows};

/// Estimates the noise model from a fit's residual and refits with this weighting, until the two agree.
///
/// # Errors
/// As [`fit_from`].
pub fn coloured(
    model: &impl Residuals,
    fit: Fit,
    order: usize,
    stopping: Stopping,
) -> Result<Fit, Error> {
    let (starts, agree) = (fit.starts, fit.agree);
    let mut fit = prewhitened(model, fit, order, None, stopping)?;
    // The fit maximises the likelihood, by which models are compared; the standard errors use the noise model of an unbiased residual.
    if fit.noise.order() > 0 {
        let (deviance, parameters, penalty) = (fit.deviance, fit.parameters, fit.penalty);
        let noise = noise_of(model, &fit, order)?;
        fit = fit_from(model, vec![fit.x.into()], &noise, stopping)?;
        // The likelihood is compared with the penalty for its number of coefficients.
        (fit.deviance, fit.parameters, fit.penalty) = (deviance, parameters, penalty);
        if let Some(rows) = rows(model, &fit.x) {
            let own: Vec<usize> = (0..fit.interior.len()).collect();
            let mut order = fit.interior.clone();
            order.push(rows.columns - 1);
            let variances = |noise: &Noise, variance: f64| {
                let mut folded = rows.fold(&order, noise, &noise.inverse_scales());
                rows.each_prior(&order, variance.sqrt(), |row| folded.push(row));
                folded.finish();
                let covariance = folded.covariance(&own)?;
                Some(own.iter().map(|&i| covariance[i][i] * variance).collect())
            };
            if let Some(freedom) = marginal::freedom(&rows, &fit.interior, &fit.noise, variances) {
                fit.freedom = freedom;
            }
        }
    }
    fit.starts = starts;
    fit.agree = agree;
    Ok(fit)
}

/// How far each entry moves in the fit with the other weighting: white noise for a fit with a noise model, the noise model of the residual
/// (order zero to `order`) for one with white noise. Without feedback both are consistent; with feedback that is not simulated the
/// difference is about their bias.
///
/// # Errors
/// As [`fit_from`].
pub fn moved_by_weighting(
    model: &impl Residuals,
    fit: &Fit,
    order: usize,
    stopping: Stopping,
) -> Result<Vec<f64>, Error> {
    let other = if fit.noise.order() == 0 {
        coloured(model, fit.clone(), order, stopping)?
    } else {
        let white = Noise::white(fit.noise.outputs());
        fit_from(model, vec![fit.x.clone().into()], &white, stopping)?
    };
    Ok(fit
        .x
        .iter()
        .zip(&other.x)
        .map(|(own, other)| own - other)
        .collect())
}

/// The prewhitened fit (iterated GLS): an autoregressive noise model of order zero to `order` for each output from its residual, a fit in
/// their weighting, until the two agree. `memory`: the noise model's memory is at most this number of samples, so that no root near one
/// describes slow physics as noise ([`ct_signals::ArModel::with_memory_at_most`]).
///
/// # Errors
/// As [`fit_from`].
pub fn prewhitened(
    model: &impl Residuals,
    fit: Fit,
    order: usize,
    memory: Option<f64>,
    stopping: Stopping,
) -> Result<Fit, Error> {
    let mut fit = fit;
    for _ in 0..8 {
        let residuals = residuals(model, &fit.x).ok_or(Error::NoFiniteStart { starts: 1 })?;
        let mut noise = Noise::fit(&residuals, model.samples().len(), order)?;
        if let Some(memory) = memory {
            noise = noise.with_memory_at_most(memory);
        }
        if noise.difference(&fit.noise) < 1e-4 {
            break;
        }
        let next = fit_from(model, vec![fit.x.clone().into()], &noise, stopping)?;
        let settled = fit.noise.order() > 0 && (next.deviance - fit.deviance).abs() < 1e-3;
        fit = next;
        if settled {
            break;
        }
    }
    if fit.noise.order() == 0 {
        // The scale of a white-noise weighting has no influence on a fit: here it is set to the noise's scale.
        let sigma = fit.variance().sqrt();
        let white = |weight: &f64| ArModel::white(sigma / weight);
        fit.noise = Noise::of(fit.weights.iter().map(white).collect());
    }
    Ok(fit)
}

/// The noise model of a fit's residual, of order zero to `order` at each output, corrected for the bias that fitting causes.
///
/// # Errors
/// Where the model is not finite.
pub fn noise_of(model: &impl Residuals, fit: &Fit, order: usize) -> Result<Noise, Error> {
    let rows = rows(model, &fit.x).ok_or(Error::NoFiniteStart { starts: 1 })?;
    marginal::noise(&rows, &fit.interior, order)
}
