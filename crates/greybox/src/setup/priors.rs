//! What is known of parameters beside the records.

use std::collections::BTreeMap;

use estimation::Prior;
use serde::{Deserialize, Serialize};

use super::Setup;
use crate::Error;

/// A side measurement of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PriorValue {
    /// What was measured \[unit of the parameter\].
    pub value: f64,
    /// Its standard error, above zero \[unit of the parameter\].
    pub std_error: f64,
}

impl Setup<'_> {
    /// The same setup with what is known of parameters beside the records, by name: each counts as a reading of its own
    /// ([`estimation::Prior`]). Those of parameters that are fixed play no part.
    ///
    /// They are part of every fit of these records, and stay with other structures; other records ([`Setup::with_records`]) go without them,
    /// so that what is known counts once.
    ///
    /// # Errors
    /// Where the structure has no parameter of a name, a standard error is not above zero, or a value is far outside the bounds.
    pub fn with_priors(mut self, priors: &BTreeMap<String, PriorValue>) -> Result<Self, Error> {
        let parameters = &self.names[..self.parameters];
        self.priors = priors_of(priors, parameters, &self.bounds)?;
        Ok(self)
    }

    /// Moves the fitted entries of a start that are far from their priors near these.
    pub fn begin_near_priors(&self, x: &mut [f64]) {
        estimation::begin_near_priors(self, x);
    }

    /// What is known of parameters beside the records, by name.
    #[must_use]
    pub fn prior_values(&self) -> BTreeMap<String, PriorValue> {
        let priors = self.priors.iter();
        priors
            .map(
                |&Prior {
                     entry,
                     value,
                     std_error,
                 }| {
                    (self.names[entry].clone(), PriorValue { value, std_error })
                },
            )
            .collect()
    }
}

/// Priors by the position of their parameter.
///
/// # Errors
/// As [`Setup::with_priors`].
pub(crate) fn priors_of(
    priors: &BTreeMap<String, PriorValue>,
    parameters: &[String],
    bounds: &[(f64, f64)],
) -> Result<Vec<Prior>, Error> {
    let of = |(name, prior): (&String, &PriorValue)| {
        let unknown = || Error::UnknownParameter {
            name: name.clone(),
            known: parameters.join(", "),
        };
        let entry = parameters.iter().position(|own| own == name);
        let PriorValue { value, std_error } = *prior;
        let prior = Prior {
            entry: entry.ok_or_else(unknown)?,
            value,
            std_error,
        };
        let weighs = std_error > 0.0 && (1.0 / std_error).is_finite();
        let (lower, upper) = bounds[prior.entry];
        if !(value.is_finite() && weighs && prior.is_within((lower, upper))) {
            return Err(Error::Prior {
                name: name.clone(),
                value,
                std_error,
                lower,
                upper,
            });
        }
        Ok(prior)
    };
    priors.iter().map(of).collect()
}
