//! Scores of the single effects, and the acceptance test of those that are reported.

use serde::{Deserialize, Serialize};

use super::{Parameter, PerOutput};

/// One candidate of the catalogue in the first step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// The effect.
    pub effect: String,
    /// The vessel or pump it acts in, where the plant has more than one.
    pub place: Option<String>,
    /// Fall of the Bayesian information criterion when it is added and everything is refitted; larger is better.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub bic_gain: f64,
    /// Simulation error after the refit, in the output's unit; NaN, and not written, of several outputs.
    #[serde(
        skip_serializing_if = "effect_search::not_finite::none",
        default = "effect_search::not_finite::no_number"
    )]
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub rmse: f64,
    /// Error of all outputs together, each divided by the noise floor of its output.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub weighted_rmse: f64,
    /// `|p|/|j|`: the share of the effect's signature that the fitted parameters cannot compensate for.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub visibility: f64,
    /// The size that was found: the effect's leading parameter.
    pub size: Option<Parameter>,
    /// Minimum detectable size in the unit of `size`; `None` if the effect has no signature at its absent value, or if the fitted
    /// parameters compensate for all of it.
    pub smallest_visible: Option<f64>,
}

/// Acceptance test of the reported effects or, if there is none, of the best rejected ones: the same test for all verdicts.
///
/// An effect is the answer (`effect`, `undecided`) where it leaves noise, or explains `required` of the excess error; it is a
/// part of the answer (`partial`) where it explains `required_partial`; else nothing explains the record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Acceptance {
    /// The effects that were tested; empty where no candidate lowers the error.
    pub effects: Vec<String>,
    /// Part of the excess error that they explain on the fitted records: the fall of the mean squared simulation error over
    /// its excess above `floor` squared, at most 1; of several outputs errors are divided by `floor` first.
    pub share: Option<f64>,
    /// Share on the held-out records; it does not affect the verdict.
    pub share_test: Option<f64>,
    /// Least `share` of a set whose residual is more than noise.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub required: f64,
    /// Least `share` of a partial explanation.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub required_partial: f64,
    /// Standard deviation of the noise that is not excess error, by output \[output unit\].
    pub floor: PerOutput,
    /// Fall of the criterion (BIC), each model with the noise model of its own residual.
    pub bic_fall: Option<f64>,
    /// Least fall for acceptance.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub required_bic_fall: f64,
    /// Conditions that the effects do not meet; empty if they are accepted.
    pub rejections: Vec<Rejection>,
}

/// A condition for a partial explanation that a set of effects does not meet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Rejection {
    /// It explains too small a share of the excess error.
    Share {
        /// Its share.
        share: f64,
        /// The least share.
        required: f64,
        /// Whether the least share is that of a set with an effect that depends on time only.
        of_time: bool,
    },
    /// Each with the noise model of its own residual, the model without its several effects is as probable.
    NotSignificant,
    /// Its innovations are larger than those of the model without it.
    Innovations,
    /// Fitted to one half of the record, it does not predict the other.
    NotPredictive,
    /// One of its several effects is a function of time: the set fits any disturbance.
    FunctionOfTime,
    /// A random walk explains as much.
    RandomWalk,
    /// A size is at a bound, or a state is not physical.
    NotPhysical,
    /// A single level shift of the reading explains more.
    LevelShift,
    /// A narrow band of stiction in a loop that is not simulated.
    NarrowBand,
}

/// A place where an effect may act, and its likelihood.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceScore {
    /// The vessel or pump.
    pub place: String,
    /// Likelihood relative to the best place, 0 to 1, everything else refitted.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub relative_likelihood: f64,
}

/// The single effects ranked under two weightings of the residual.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Rankings {
    /// Ranking by the simulation error (white noise), best first.
    pub white: Vec<String>,
    /// Prewhitened by the noise model (GLS), best first; empty where the noise is white.
    pub prewhitened: Vec<String>,
    /// The best effects of the two rankings differ by more than the margin of a group.
    pub disagree: bool,
}
