//! The result of a diagnosis: plain structs, written to JSON unchanged; all printed and plotted results are derived from them.

mod noise_floor;
mod not_noise;
mod parameter;
mod per_output;
mod record;
mod remark;
mod scores;
mod step;
mod unknown;

use ct_signals::Clock;
pub use effect_search::{ControlLoop, LONGEST_HOLD, MendedGaps, NotSimulated, Verdict};
use plants::{Domain, Plant};
use serde::{Deserialize, Serialize};

pub(crate) use self::{noise_floor::Floors, unknown::SHAPES};
pub use self::{
    noise_floor::{NoiseFloor, NoiseSource},
    not_noise::NotNoise,
    parameter::Parameter,
    per_output::PerOutput,
    record::{Shown, ShownInput},
    remark::Remark,
    scores::{Acceptance, PlaceScore, Rankings, Rejection, Score},
    step::Step,
    unknown::{PlaceLikelihood, Primitive, Share, Unknown, Window},
};

/// Format of times without a calendar.
fn plain_clock() -> Clock {
    Clock::of([])
}

/// Time spent, and steps that the time limit left out.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Effort {
    /// Limit on the search \[s\]; `None`: no limit.
    pub limit: Option<f64>,
    /// Steps of the search that were cut short or left out; empty where all were done.
    pub left_out: Vec<String>,
    /// The user ended the search, and this is the best result so far.
    pub interrupted: bool,
}

/// Result of a diagnosis. A result that is read from JSON has everything except records, simulated series and the clock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Version of this layout.
    pub schema: u32,
    /// The verdict; after a comparison, which searches nothing, `Unexplained` if the model is incomplete.
    pub verdict: Verdict,
    /// Format of the times of the records.
    #[serde(skip, default = "plain_clock")]
    pub clock: Clock,
    /// Handling of missing rows and samples of inputs; `None` if there are none.
    pub gaps: Option<MendedGaps>,
    /// The effects that were added, in order.
    pub effects: Vec<String>,
    /// For each added effect: the effect and all effects that these data cannot distinguish from it, best first.
    pub groups: Vec<Vec<String>>,
    /// For each added effect whether it is uncertain: its size is at a bound of its plausible range, so that it may describe the data
    /// without being the cause.
    pub in_doubt: Vec<bool>,
    /// For each added effect the places where it may act, most likely first; one place if there is no choice.
    pub places: Vec<Vec<PlaceScore>>,
    /// The acceptance test; `None` after a comparison, which searches nothing, and where the model is adequate.
    pub acceptance: Option<Acceptance>,
    /// The residual of the last model is more than noise: an effect is missing, or a disturbance acts.
    pub residual_unexplained: bool,
    /// The property of the last model's residual that noise does not have; `None` if no test of the residual found one.
    pub not_noise: Option<NotNoise>,
    /// The single effects, best first, at the first step; `none` first when the model is adequate.
    pub ranked: Vec<String>,
    /// The base model and every model after it.
    pub steps: Vec<Step>,
    /// Standard deviation of the noise, in the output's unit; NaN, and not written, of several outputs.
    #[serde(
        skip_serializing_if = "effect_search::not_finite::none",
        default = "effect_search::not_finite::no_number"
    )]
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub noise_floor: f64,
    /// The noise floor of each output, and how it was found.
    pub noise: Vec<NoiseFloor>,
    /// The single effects under both weightings.
    pub rankings: Rankings,
    /// The time limit, and the steps that were left out.
    pub effort: Effort,
    /// The scores of the single effects at the first step, best first.
    pub scores: Vec<Score>,
    /// The unexplained error, if the catalogue does not explain it.
    pub unknown: Option<Unknown>,
    /// The control loop of the records, if there is one.
    pub control_loop: Option<ControlLoop>,
    /// What else has to be known: each remark that does not follow from the other fields.
    #[serde(default)]
    pub remarks: Vec<Remark>,
    /// The plant, as the model file names it.
    pub plant: String,
    /// The effects and the terms that the model file already had.
    pub known_effects: Vec<String>,
    /// Unit of the input.
    pub input_unit: String,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Unit of the outputs.
    pub output_unit: String,
    /// Unit of each output where they differ; else empty.
    #[serde(skip)]
    pub output_units: Vec<String>,
    /// The records, fitted ones first.
    #[serde(skip)]
    pub records: Vec<Shown>,
    /// How long it took \[s\].
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub seconds: f64,
}

impl Diagnosis {
    /// Physical domain of the model, which determines the words.
    #[must_use]
    pub fn domain(&self) -> Domain {
        domain_of(&self.plant, &self.output_unit)
    }

    /// The unit of an output, by its position.
    #[must_use]
    pub fn unit_of(&self, output: usize) -> &str {
        self.output_units.get(output).unwrap_or(&self.output_unit)
    }

    /// Whether the catalogue was searched: true of a diagnosis, false of a comparison.
    #[must_use]
    pub fn searched(&self) -> bool {
        // An adequate diagnosis ranks at least `none`; any other has an acceptance test.
        self.acceptance.is_some() || !self.ranked.is_empty()
    }
}

/// The domain of a plant by its name and of its output's unit; that of any other model is general.
pub(crate) fn domain_of(plant: &str, output_unit: &str) -> Domain {
    let plant: Result<Plant, _> = plant.parse();
    plant.map_or(Domain::General, |plant| Domain::of(plant, output_unit))
}
