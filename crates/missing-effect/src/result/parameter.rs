//! A fitted parameter with its standard error and its prior.

use greybox::PriorValue;
use serde::{Deserialize, Serialize};

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Name of the parameter, `alpha` or `overflow.rim`; initial states are `level(0)` and the like.
    pub name: String,
    /// The estimate, in `unit`.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub value: f64,
    /// Standard error, in `unit`; `None` if the data do not determine the value or it is at a bound.
    pub std_error: Option<f64>,
    /// Unit, for example `cm^2.5/s`.
    pub unit: String,
    /// Prior of the parameter, if the model file has one; the estimate includes it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<PriorValue>,
}

impl Parameter {
    /// Distance of the estimate from its prior \[standard errors of their difference\]; `None` without a prior. The estimate includes the prior:
    /// the more precise the prior relative to the records, the less uncertain is their difference.
    #[must_use]
    pub fn prior_distance(&self) -> Option<f64> {
        let prior = self.prior?;
        let own = self.std_error.map_or(0.0, |error| error * error);
        let variance = prior.std_error * prior.std_error - own;
        let scale = if variance > 0.0 {
            variance.sqrt()
        } else {
            prior.std_error
        };
        Some((self.value - prior.value).abs() / scale)
    }
}
