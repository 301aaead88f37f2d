//! Prior information on parameters.

use std::collections::BTreeMap;

use estimation::Prior;
use serde::{Deserialize, Serialize};

use super::Setup;
use crate::Error;

/// A separate measurement of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PriorValue {
    /// The measured value \[unit of the parameter\].
    pub value: f64,
    /// Standard error of the value, positive \[unit of the parameter\].
    pub std_error: f64,
}

impl Setup<'_> {
    /// The same setup with prior information on parameters, by name: each prior counts as one additional reading ([`estimation::Prior`]).
    /// Priors of fixed parameters have no effect.
    ///
    /// Priors are used in every fit of these records, also with other structures. A setup of other records ([`Setup::with_records`]) has no
    /// priors, so that prior information is used only once.
    ///
    /// # Errors
    /// If the structure has no parameter of a name, a standard error is not positive, or a value is far outside the bounds.
    pub fn with_priors(mut self, priors: &BTreeMap<String, PriorValue>) -> Result<Self, Error> {
        let parameters = &self.names[..self.parameters];
        self.priors = priors_of(priors, parameters, &self.bounds)?;
        Ok(self)
    }

    /// Moves the free entries of a start vector that are far from their priors close to them.
    pub fn begin_near_priors(&self, x: &mut [f64]) {
        estimation::begin_near_priors(self, x);
    }

    /// Prior information on parameters, by name.
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

/// Priors by the index of their parameter.
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
