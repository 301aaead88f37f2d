//! Saving and restoring the state of a state variable filter: its next outputs are bit-identical.

use alloc::vec::Vec;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::StateVariableFilter;
use crate::{Hold, Polynomial, Start};

/// What is written; how a step is sampled follows from it.
#[derive(Serialize, Deserialize)]
#[serde(rename = "StateVariableFilter")]
struct Saved {
    denominator: Vec<f64>,
    hold: Hold,
    start: Start,
    /// `None` before the first sample.
    input: Option<f64>,
    derivatives: Vec<f64>,
}

impl Serialize for StateVariableFilter {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Saved {
            denominator: self.denominator.coefficients().to_vec(),
            hold: self.sampler.hold(),
            start: self.start,
            input: self.input,
            derivatives: self.derivatives.clone(),
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for StateVariableFilter {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let saved = Saved::deserialize(deserializer)?;
        let denominator = Polynomial::new(saved.denominator).map_err(D::Error::custom)?;
        let filter = Self::new(&denominator, saved.hold).map_err(D::Error::custom)?;
        if saved.derivatives.len() != filter.derivatives.len() {
            return Err(D::Error::invalid_length(
                saved.derivatives.len(),
                &"the filtered signal and as many derivatives as the denominator has degrees",
            ));
        }
        let mut numbers = saved.derivatives.iter().chain(&saved.input);
        if let Some(value) = numbers.find(|value| !value.is_finite()) {
            return Err(D::Error::custom(format_args!(
                "the filter holds {value}, but needs finite numbers"
            )));
        }
        Ok(Self {
            start: saved.start,
            input: saved.input,
            derivatives: saved.derivatives,
            ..filter
        })
    }
}
