//! The result of a design: plain structs, written to JSON unchanged; all printed text is derived from them.

use effect_search::design::{Kind, Power, Prospect};
use plants::Domain;
use serde::Serialize;

use super::limits::Bounds;
use crate::{Effort, Parameter, result::domain_of};

/// One of the two effects to be distinguished.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// The effect.
    pub effect: String,
    /// The vessel it acts in, where the plant has more than one: `upper` or `lower`.
    pub place: Option<String>,
    /// Size of the effect on the records.
    pub size: Option<Parameter>,
    /// The size is at a bound of its plausible range.
    pub at_the_edge: bool,
    /// Root mean square of the simulation error with it on the records, in the output's unit.
    pub rmse: f64,
    /// Fall of the criterion from the believed model.
    pub bic_gain: f64,
    /// How to confirm the effect at the plant; empty outside hydraulics.
    pub confirm: String,
}

/// Range of a level in an experiment, for either model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reach {
    /// Name of the level: `level`, or `level_upper` and `level_lower`.
    pub level: String,
    /// Lowest, in the output's unit.
    pub low: f64,
    /// Highest, in the output's unit.
    pub high: f64,
}

/// One experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Kind of the sequence.
    pub kind: Kind,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Duration of each level \[s\].
    pub clock: f64,
    /// Levels of a staircase.
    pub levels: Option<usize>,
    /// Number of the random draw of a multi-level sequence.
    pub draw: Option<u64>,
    /// Largest change per second, if it is smaller than the limits require in order to keep a controller off its limits.
    pub slew: Option<f64>,
    /// Power of the experiment.
    pub power: Power,
    /// The power is that of a refit; otherwise that of the models linearised at their fits.
    pub refitted: bool,
    /// Ranges of the levels.
    pub reaches: Vec<Reach>,
    /// Largest excursion of a level outside its range in the records, as a share of that range: outside the range neither model is
    /// validated.
    pub excursion: f64,
    /// In a loop: whether the controller reaches a limit, where the loop is open.
    pub at_limit: bool,
}

/// Result of a wider range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Wider {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// The best experiment within it.
    pub best: Candidate,
}

/// Benefit of another sensor: the other level measured too, with the same noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SecondSensor {
    /// The level that is not measured.
    pub level: String,
    /// For records like the existing ones, with one measured level.
    pub existing_without: Power,
    /// For records like the existing ones, with both levels measured.
    pub existing_with: Power,
    /// For the best experiment, with both levels measured.
    pub best_with: Power,
}

/// The sequence to apply to the plant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sequence {
    /// Name of the applied signal: the command, or in a loop the reference.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Instants \[s\].
    pub time: Vec<f64>,
    /// Values, each held until the next instant according to the model file.
    pub values: Vec<f64>,
}

/// The next experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Design {
    /// Version of this layout.
    pub schema: u32,
    /// The two effects.
    pub between: [Alternative; 2],
    /// Criterion of the second model minus that of the first on the existing records.
    pub bic_ahead: f64,
    /// Expected result of the best experiment.
    pub prospect: Prospect,
    /// Whether the reference of the loop is applied, not the command.
    pub in_loop: bool,
    /// The limits in force.
    pub limits: Bounds,
    /// The experiments, the best first: among those with ample power, the one closest to the range of the records.
    pub candidates: Vec<Candidate>,
    /// Experiments that were left out because they would overfill a tank.
    pub overfull: usize,
    /// Experiments that were left out because they would drive the controller to a limit.
    pub limited: usize,
    /// What the longest record had, once more.
    pub again: Option<Candidate>,
    /// The best experiment of a wider range, if a wider range is possible.
    pub wider: Option<Wider>,
    /// Number of applications of the best experiment that would decide between the two effects; `None` if one is enough, or no number is.
    pub times_as_long: Option<usize>,
    /// Benefit of a second sensor, if the plant has another level.
    pub second_sensor: Option<SecondSensor>,
    /// The best experiment.
    pub experiment: Sequence,
    /// Standard deviation of the noise, in the output's unit.
    pub noise_floor: f64,
    /// Steps that the time limit left out.
    pub effort: Effort,
    /// The plant, as the model file names it.
    pub plant: String,
    /// Unit of the output.
    pub output_unit: String,
    /// How long it took \[s\].
    pub seconds: f64,
}

impl Design {
    /// Physical domain of the model, which determines the words.
    #[must_use]
    pub fn domain(&self) -> Domain {
        domain_of(&self.plant, &self.output_unit)
    }

    /// Whether no experiment distinguishes the two.
    #[must_use]
    pub fn twins(&self) -> bool {
        self.prospect == Prospect::Twins
    }
}
