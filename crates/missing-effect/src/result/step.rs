//! One of the models from the base to the last set of effects: its errors, its parameters, its residual tests and where it fails.

use serde::{Deserialize, Serialize};

use super::{Parameter, PerOutput};
use effect_search::OutputStep;

/// One of the reported models: the base, or the base and the effects added so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The effect that this step added; `None` for the base.
    pub added: Option<String>,
    /// The vessel or pump it acts in, where the plant has more than one: `upper` or `lower` of two tanks.
    pub place: Option<String>,
    /// Root mean square of the simulation error on the fitted records, in the output's unit; NaN, and not written, of several outputs.
    #[serde(
        skip_serializing_if = "effect_search::not_finite::none",
        default = "effect_search::not_finite::no_number"
    )]
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub rmse: f64,
    /// Simulation error on the held-out record, whose first five samples determine its initial states and are not scored.
    pub rmse_test: Option<f64>,
    /// `rmse` of each output by its name.
    pub rmse_per_output: PerOutput,
    /// `rmse_test` of each output by its name.
    pub rmse_test_per_output: Option<PerOutput>,
    /// Root mean square of the simulation errors of all outputs, each divided by the noise floor of its output: one is the noise.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub weighted_rmse: f64,
    /// Weighted error on the held-out record.
    pub weighted_rmse_test: Option<f64>,
    /// Bayesian information criterion with the noise model of this model's residual; smaller is better.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub bic: f64,
    /// Parameters in chain order, initial states last.
    pub parameters: Vec<Parameter>,
    /// Number of starts.
    pub starts: usize,
    /// Number of starts that ended in the best minimum.
    pub starts_agree: usize,
    /// Results at each output, in order.
    pub outputs: Vec<OutputStep>,
    /// The model's simulated outputs, one series per fitted record and, within it, output, then those of the held-out records.
    #[serde(skip)]
    pub simulated: Vec<Vec<f64>>,
}
