//! Autoregressive models by their partial correlations, and the transposes of whitening and colouring.

use ct_signals::ArModel;

use crate::Error;

/// `a_1..a_q` of every order up to `q` from the partial correlations, by Levinson's recursion.
pub(crate) fn predictors(reflections: &[f64]) -> Vec<Vec<f64>> {
    let mut ladder = vec![Vec::new()];
    let mut a: Vec<f64> = Vec::new();
    for &k in reflections {
        let reversed: Vec<f64> = a.iter().rev().copied().collect();
        for (a, back) in a.iter_mut().zip(reversed) {
            *a -= k * back;
        }
        a.push(k);
        ladder.push(a.clone());
    }
    ladder
}

/// The partial correlations of `a_1..a_q`: the same recursion backwards.
pub(crate) fn reflections(coefficients: &[f64]) -> Vec<f64> {
    let mut a = coefficients.to_vec();
    let mut reflections = vec![0.0; a.len()];
    while let Some(k) = a.pop() {
        reflections[a.len()] = k;
        let reversed: Vec<f64> = a.iter().rev().copied().collect();
        for (a, back) in a.iter_mut().zip(reversed) {
            *a = (*a + k * back) / (1.0 - k * k);
        }
    }
    reflections
}

/// A model from its partial correlations and the innovations' standard deviation.
pub(crate) fn from_reflections(reflections: &[f64], sigma: f64) -> Result<ArModel, Error> {
    let coefficients = predictors(reflections).pop().unwrap_or_default();
    Ok(ArModel::from_coefficients(&coefficients, sigma)?)
}
