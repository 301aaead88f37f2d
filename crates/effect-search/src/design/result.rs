//! The result of a design: plain values.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Kind, Power, Prospect};
use crate::ControlLoop;

/// One of the two effects to be distinguished.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// The effect, with its port.
    pub effect: String,
    /// Parameters on the existing records, by their names in the effect.
    pub sizes: BTreeMap<String, f64>,
    /// Fall of the criterion from the believed model.
    pub bic_gain: f64,
    /// Simulation error of each output on the existing records \[its unit\].
    pub rmse_per_output: BTreeMap<String, f64>,
}

/// Permitted changes of an input.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputRange {
    /// Name of the input in the model.
    pub input: String,
    /// Its unit.
    pub unit: String,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// The range is that of the records, because none was given.
    pub visited: bool,
    /// Largest change per second, if there is a limit.
    pub slew: Option<f64>,
}

/// Sequence of an input in an experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputSequenceKind {
    /// Name of the input in the model.
    pub input: String,
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
}

/// Range of an output in an experiment, for either model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reach {
    /// Its name.
    pub output: String,
    /// Lowest \[its unit\].
    pub low: f64,
    /// Highest.
    pub high: f64,
    /// Lowest in the records.
    pub visited_low: f64,
    /// Highest in the records.
    pub visited_high: f64,
}

impl Reach {
    /// Sum of the excursions below and above the range of the records, as a share of that range.
    #[must_use]
    pub fn excursion(&self) -> f64 {
        let out = (self.visited_low - self.low).max(0.0) + (self.high - self.visited_high).max(0.0);
        out / (self.visited_high - self.visited_low).max(f64::MIN_POSITIVE)
    }
}

/// An experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Experiment {
    /// Sequence of each input that changes, and of each that is held at another value than its median.
    pub inputs: Vec<InputSequenceKind>,
    /// Power of the experiment.
    pub power: Power,
    /// The power is that of a refit; otherwise that of the models linearised at their fits.
    pub refitted: bool,
    /// Ranges of the outputs.
    pub reaches: Vec<Reach>,
    /// Largest [`Reach::excursion`]: outside the range neither model is validated.
    pub excursion: f64,
}

/// The sequences to apply to the plant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sequences {
    /// Instants \[s\].
    pub time: Vec<f64>,
    /// The inputs of the model, in its order, with a value for each instant.
    pub inputs: Vec<InputSequence>,
}

/// An input of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputSequence {
    /// Name of the input in the model.
    pub input: String,
    /// Its unit.
    pub unit: String,
    /// Values of the input; each is held until the next instant according to the model file.
    pub values: Vec<f64>,
}

/// The next experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Design {
    /// Version of this layout.
    pub schema: u32,
    /// The model.
    pub model: String,
    /// The two effects.
    pub between: [Alternative; 2],
    /// Criterion of the second model minus that of the first on the existing records.
    pub bic_ahead: f64,
    /// Expected result of the best experiment.
    pub prospect: Prospect,
    /// Applied inputs and their limits.
    pub ranges: Vec<InputRange>,
    /// Length \[s\].
    pub duration: f64,
    /// Experiments, the best first: among those with ample power, the one closest to the range of the records.
    pub experiments: Vec<Experiment>,
    /// Repetition of the experiment of the longest record.
    pub again: Option<Experiment>,
    /// Number of applications of the best experiment that would decide between the two effects; `None` if one is enough, or no number is.
    pub times_as_long: Option<usize>,
    /// The best experiment.
    pub experiment: Sequences,
    /// Standard deviation of each output's innovations, the noise that its past does not predict \[its unit\].
    pub noise: BTreeMap<String, f64>,
    /// The control loop of the records; `None` if no controller is known and no feedback was detected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control_loop: Option<ControlLoop>,
    /// Steps that were left out because of the time limit.
    pub left_out: Vec<String>,
    /// Computing time \[s\].
    pub seconds: f64,
}

impl Design {
    /// Whether no experiment distinguishes the two.
    #[must_use]
    pub fn twins(&self) -> bool {
        self.prospect == Prospect::Twins
    }
}
