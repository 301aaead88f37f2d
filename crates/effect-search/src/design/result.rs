//! The result of a design: plain values.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Kind, Power, Prospect};

/// One of the two effects that are to be told apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// The effect, with its port.
    pub effect: String,
    /// Its parameters on the existing records, by the names that they have in the effect.
    pub sizes: BTreeMap<String, f64>,
    /// By how much it lowers the criterion of the believed model.
    pub bic_gain: f64,
    /// Simulation error of each output on the existing records \[its unit\].
    pub rmse_per_output: BTreeMap<String, f64>,
}

/// What an input may do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputRange {
    /// Its name in the model.
    pub input: String,
    /// Its unit.
    pub unit: String,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// The range is what the records visited, as none was given.
    pub visited: bool,
    /// Largest change in a second, where there is a limit.
    pub slew: Option<f64>,
}

/// What an input does in an experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputSequenceKind {
    /// Its name in the model.
    pub input: String,
    /// Kind of the sequence.
    pub kind: Kind,
    /// Its smallest value.
    pub low: f64,
    /// Its largest value.
    pub high: f64,
    /// How long a level is held \[s\].
    pub clock: f64,
    /// Levels of a staircase.
    pub levels: Option<usize>,
}

/// From where to where an output moves in an experiment, by either model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reach {
    /// Its name.
    pub output: String,
    /// Lowest \[its unit\].
    pub low: f64,
    /// Highest.
    pub high: f64,
}

/// An experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Experiment {
    /// What each input does that moves; the others are held at their median.
    pub inputs: Vec<InputSequenceKind>,
    /// What it gives.
    pub power: Power,
    /// The power is that of a refit; otherwise that of the models linearised at their fits.
    pub refitted: bool,
    /// Where the outputs go.
    pub reaches: Vec<Reach>,
    /// How far an output leaves what it visited in the records, as a part of that: beyond it neither model is known.
    pub excursion: f64,
}

/// What a person applies to the plant.
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
    /// Its name in the model.
    pub input: String,
    /// Its unit.
    pub unit: String,
    /// Its values, each until the next instant as the model file has it.
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
    /// By how much the criterion of the second is above that of the first on the existing records.
    pub bic_ahead: f64,
    /// What the best experiment can be expected to do.
    pub prospect: Prospect,
    /// What is applied, and within which limits.
    pub ranges: Vec<InputRange>,
    /// Length \[s\].
    pub duration: f64,
    /// Experiments, the best first: of those that have power in plenty the one that stays nearest to what the records visited.
    pub experiments: Vec<Experiment>,
    /// What the longest record had, once more.
    pub again: Option<Experiment>,
    /// Applied so many times over, the best experiment would decide; `None` where it does already, or would not.
    pub times_as_long: Option<usize>,
    /// The best experiment.
    pub experiment: Sequences,
    /// Standard deviation of each output's innovations, the noise that its past does not predict \[its unit\].
    pub noise: BTreeMap<String, f64>,
    /// What was left out for want of time.
    pub left_out: Vec<String>,
    /// How long it took \[s\].
    pub seconds: f64,
}

impl Design {
    /// No experiment tells the two apart: none is worth making.
    #[must_use]
    pub fn twins(&self) -> bool {
        self.prospect == Prospect::Twins
    }
}
