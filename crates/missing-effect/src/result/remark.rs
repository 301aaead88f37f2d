//! Remarks on a diagnosis that do not follow from its other fields.

use serde::{Deserialize, Serialize};

use super::PerOutput;

/// A remark on a diagnosis or a comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Remark {
    /// Nearly all readings of an output are multiples of a step, and quantisation causes a large part of the error.
    Quantisation {
        /// The output, by its name.
        output: String,
        /// The quantisation step of the readings \[output unit\].
        #[serde(deserialize_with = "effect_search::not_finite::number")]
        step: f64,
        /// Variance of quantisation alone over the mean squared error of the model without it, 0 to 1.1: above 1 the error is smaller.
        #[serde(deserialize_with = "effect_search::not_finite::number")]
        share: f64,
    },
    /// Effects that would explain more were not accepted: a function of time would explain as much, and the residual is not noise.
    ReplacedByTime {
        /// The effects, by their identifiers.
        effects: Vec<String>,
    },
    /// The best significant effects, apart from functions of time, were not accepted: they leave a residual that is not noise.
    BestPart {
        /// The effects, by their identifiers.
        effects: Vec<String>,
        /// Root mean square of the residual with them \[output unit\].
        rmse_per_output: PerOutput,
    },
    /// The search stopped at the permitted number of effects.
    EffectLimit {
        /// Permitted number of effects.
        most: usize,
        /// Number of significant effects, more than `most`.
        needed: usize,
    },
    /// The standard errors take the shape of a user's own terms as known, so they are too small.
    Terms {
        /// Names of the terms.
        names: Vec<String>,
    },
    /// The noise is coloured, which reduces the detectability of effects clearly.
    ColouredNoise {
        /// Minimum detectable size of an effect over that in white noise of the same variance, 1.2 or more.
        #[serde(deserialize_with = "effect_search::not_finite::number")]
        ratio: f64,
    },
}
