//! The tests that are reported for a fit.

use ct_signals::{Channel, residual_tests};
use serde::{Deserialize, Serialize};

/// Residual tests of one fit, of its first record, or of the part with the most readings if that was cut; the bounds are for 95 %.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResidualTests {
    /// Autocorrelation of the simulation residual at lags 0, 1, ...
    #[serde(deserialize_with = "crate::not_finite::numbers")]
    pub autocorrelation: Vec<f64>,
    /// Cross-correlation of the whitened input with the whitened residual at lags 0, 1, ...
    #[serde(deserialize_with = "crate::not_finite::numbers")]
    pub cross_correlation: Vec<f64>,
    /// Half-width of the 95 % band of the autocorrelation.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub autocorrelation_bound: f64,
    /// Half-width of the 95 % band of the cross-correlation.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub cross_correlation_bound: f64,
    /// p-value of the Ljung-Box test: whiteness of the simulation residual.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub whiteness_p: f64,
    /// p-value of the portmanteau test of the cross-correlation with the input (in a simulated loop the reference), of all records.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub input_p: f64,
}

impl ResidualTests {
    /// Tests of a residual of one record: whiteness, and the signal from outside with the smallest p-value, corrected for the number of
    /// signals.
    #[must_use]
    pub fn of(external: &[&Channel], residual: &[f64]) -> Self {
        let samples = residual.iter().filter(|e| !e.is_nan()).count();
        let lags = (samples / 10).clamp(2, 60);
        let portmanteau = (samples / 10).clamp(2, 25);
        let moves = |input: &&&Channel| {
            let (low, high) = input.range();
            high > low
        };
        let inputs: Vec<&&Channel> = external.iter().filter(moves).collect();
        let count = inputs.len() as f64;
        let tested = inputs.iter().filter_map(|input| {
            residual_tests::prewhitened_input_test(&input.values, residual, lags).ok()
        });
        let clearest = tested.min_by(|a, b| a.1.total_cmp(&b.1));
        let (cross, p) = clearest.unwrap_or((vec![f64::NAN; lags + 1], f64::NAN));
        let bound = 1.96 * (residual.len() as f64).sqrt() / samples.max(1) as f64;
        Self {
            autocorrelation: residual_tests::autocorrelation(residual, lags),
            cross_correlation: cross,
            autocorrelation_bound: bound,
            cross_correlation_bound: bound,
            whiteness_p: residual_tests::ljung_box(residual, portmanteau, 0).unwrap_or(f64::NAN),
            input_p: if p.is_nan() { p } else { (count * p).min(1.0) },
        }
    }
}
