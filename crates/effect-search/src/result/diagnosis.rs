//! Result of a search: plain values, written to JSON unchanged.

use std::collections::BTreeMap;

use ct_signals::ArModel;
use serde::{Deserialize, Serialize};

use crate::accept::quantisation::Quantisation;
use crate::base::gaps::MendedGaps;
use crate::base::loop_state::ControlLoop;
use crate::diagnostics::unknown::Unknown;
use crate::fit::estimate::Estimate;
use crate::fit::relations::Absorbed;
use crate::residual_tests::NotNoise;
use crate::result::output_step::OutputStep;

/// The finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every added effect is singled out by the data.
    Effect,
    /// An effect is missing, and another candidate fits as well as at least one added effect.
    Undecided,
    /// The added effects explain the larger part of the error, and the residual is not noise.
    Partial,
    /// The residual is not noise, and no candidate explains it.
    Unexplained,
    /// No missing effect is detectable in these data.
    Adequate,
}

/// One of the reported models: the believed one, or a model with one more effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The added effect; `None` for the believed model.
    pub added: Option<String>,
    /// Simulation error of a single output on the fitted records \[its unit\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse: Option<f64>,
    /// Simulation error by output, on the fitted records \[unit of the output\].
    pub rmse_per_output: BTreeMap<String, f64>,
    /// Simulation error of each output on the held-out records.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_test_per_output: Option<BTreeMap<String, f64>>,
    /// First rows of each held-out record, to which its initial states were fitted and which are not scored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state_rows: Option<Vec<usize>>,
    /// Simulation error, each output divided by the standard deviation of its noise: 1 if only noise is left.
    pub weighted_rmse: f64,
    /// Bayesian information criterion, with the weighting of the confirmation.
    pub bic: f64,
    /// All parameters, followed by the initial states.
    pub parameters: Vec<Estimate>,
    /// Fitted entries that the records do not determine, alone or together ([`greybox::not_determined`]).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_determined: Vec<Vec<String>>,
    /// Starts of the fit.
    pub starts: usize,
    /// Number of starts that ended in the best minimum.
    pub starts_agree: usize,
    /// Results at each output, in the order of the model: its error, where it fails, and tests of its residual.
    pub outputs: Vec<OutputStep>,
    /// Simulated output: a series for each fitted record and output, then those of the held-out records.
    #[serde(skip)]
    pub simulated: Vec<Vec<f64>>,
}

/// A single effect added to the believed model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Single {
    /// The effect.
    pub effect: String,
    /// Parameters of the effect from a first fit, the leading size first.
    pub sizes: Vec<Estimate>,
    /// Fall of the criterion; larger is better.
    pub bic_gain: f64,
    /// Simulation error by output \[unit of the output\].
    pub rmse_per_output: BTreeMap<String, f64>,
    /// Share of the effect's signature that the believed parameters and initial states do not compensate for, 0 to 1. The signature is the
    /// derivative of the outputs, whitened by [`Diagnosis::noise`], with respect to the leading size at its absent value. `None` if there is
    /// no such derivative (thresholds, quantisation), or if the size is not fitted.
    #[serde(default)]
    pub visibility: Option<f64>,
    /// Minimum detectable size \[unit of the leading size\], with a false alarm rate of 1 % and a power of 90 % in a test of this size alone,
    /// where other sizes are absent and shape parameters (an instant, a period) are known to have their fitted values:
    /// `(2.576 + 1.282)/|p|`, where `p` is the part of the signature that is not compensated, in standard deviations of the innovations.
    /// `None` also if the believed parameters compensate for all of the signature.
    #[serde(default)]
    pub smallest_visible: Option<f64>,
}

/// The noise of an output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoiseFloor {
    /// The output.
    pub output: String,
    /// Standard deviation \[unit of the output\].
    pub level: f64,
    /// Standard deviation of the innovations.
    pub innovation: f64,
    /// Autoregressive coefficients; empty for white noise.
    pub coefficients: Vec<f64>,
}

impl NoiseFloor {
    /// The share of the noise's variance that follows from the readings before (0 to 1): 0 for white noise.
    #[must_use]
    pub fn predictable(&self) -> f64 {
        let noise = ArModel::from_coefficients(&self.coefficients, self.innovation);
        noise.map_or(0.0, |noise| {
            1.0 - (noise.sigma() / noise.stationary_std()).powi(2)
        })
    }
}

/// A diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Version of this layout.
    pub schema: u32,
    /// The model's name.
    pub model: String,
    /// The finding.
    pub verdict: Verdict,
    /// The effects that were added, in order.
    pub effects: Vec<String>,
    /// For each added effect: the effect and all candidates that these data cannot distinguish from it, best first.
    pub groups: Vec<Vec<String>>,
    /// The single effects, best first; `none` first where the model is adequate.
    pub ranked: Vec<String>,
    /// The believed model, and every later model.
    pub steps: Vec<Step>,
    /// The share of the squared error above the noise (of a partial explanation: above the innovations of its noise model) that the effects
    /// explain; `None` without effects.
    pub share: Option<f64>,
    /// Structure in the residual of the last model that is not noise.
    pub not_noise: Option<NotNoise>,
    /// Outputs whose readings are rounded, if rounding causes a large part of the last residual and no effect describes it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub quantisation: Vec<Quantisation>,
    /// The unexplained error of the last model; `None` if its residual is noise.
    pub unknown: Option<Unknown>,
    /// The noise of each output, of the last model's residual.
    pub noise: Vec<NoiseFloor>,
    /// Single effects that were fitted, best first.
    pub singles: Vec<Single>,
    /// For each named effect, the numbers of the records that its equations contain ([`ct_model::effects::Candidate::record_numbers`]), by
    /// identifiers: with these numbers an effect means the same for another record.
    pub record_numbers: BTreeMap<String, BTreeMap<String, f64>>,
    /// Number of scored candidates.
    pub candidates: usize,
    /// Candidates of the model file that no search can find, because the model's own parameters absorb them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub absorbed: Vec<Absorbed>,
    /// Handling of the gaps of the records; `None` if there were none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gaps: Option<MendedGaps>,
    /// The control loop of the records; `None` if no controller is known and no feedback was detected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub control_loop: Option<ControlLoop>,
    /// Steps that the time limit left out of the search; empty if the search is complete.
    pub left_out: Vec<String>,
    /// Computing time \[s\].
    pub seconds: f64,
}
