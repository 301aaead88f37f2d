//! A fitted parameter with its standard error and its prior.

use greybox::PriorValue;
use serde::{Deserialize, Serialize};

use crate::numbers::value_and_error;

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Name of the parameter, `alpha` or `overflow.rim`; initial states are `level(0)` and the like.
    pub name: String,
    /// The estimate, in `unit`.
    #[serde(deserialize_with = "crate::result::number")]
    pub value: f64,
    /// Standard error, in `unit`; `None` if the data do not determine the value or it is at a bound.
    pub std_error: Option<f64>,
    /// Unit, for example `cm^2.5/s`.
    pub unit: String,
    /// Prior of the parameter, if the model file has one; the estimate includes it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<PriorValue>,
}

/// A record disagrees with a prior if their distance exceeds this number of standard errors of both together.
const DISAGREES: f64 = 3.0;

impl Parameter {
    /// The prior in words, and the distance of the estimate if the two disagree.
    #[must_use]
    pub fn prior_words(&self) -> Option<String> {
        let prior = self.prior?;
        let (value, error) = value_and_error(prior.value, Some(prior.std_error));
        // The estimate includes the prior: the more precise the prior relative to the records, the less uncertain is their difference.
        let own = self.std_error.map_or(0.0, |error| error * error);
        let variance = prior.std_error * prior.std_error - own;
        let scale = if variance > 0.0 {
            variance.sqrt()
        } else {
            prior.std_error
        };
        let away = (self.value - prior.value).abs() / scale;
        let mut words = format!("prior {value} ± {}", error.unwrap_or_default());
        if away > DISAGREES {
            words += &format!("; the records disagree with it by {away:.1} standard errors");
        }
        Some(words)
    }
}
