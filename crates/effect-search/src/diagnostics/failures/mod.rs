//! Where a model fails: its residual by time, output, inputs, states, direction of change and frequency.

mod expected;
mod locate;
mod worst;

use serde::{Deserialize, Serialize};

pub use self::locate::{Series, Signal, locate};

/// The residual in one bin: a time window, a range of an output, of an input, ...
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Position of the record of a window, fitted ones first; `None` for all fitted records together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub record: Option<usize>,
    /// Lower edge.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub from: f64,
    /// Upper edge.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub to: f64,
    /// Samples in it; of frequencies the lines of the spectrum.
    pub count: usize,
    /// Mean residual (measured minus model), in the output's unit; zero of frequencies.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub mean: f64,
    /// Root mean square of the residual, in the output's unit.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub rms: f64,
    /// Whether the model fails in the bin: its mean square is clearly above the expected one for noise.
    pub fails: bool,
}

/// The residual by the values of an input or a state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SignalBins {
    /// Name of the signal.
    pub name: String,
    /// Its unit, in which the edges are.
    pub unit: String,
    /// Its bins.
    pub bins: Vec<Bin>,
}

/// Regions where a model fails at one output, in all fitted records.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Failures {
    /// Bins by time \[s\], record by record.
    pub by_time: Vec<Bin>,
    /// Bins by the model's output, in its unit.
    pub by_output: Vec<Bin>,
    /// Bins by each input.
    pub by_input: Vec<SignalBins>,
    /// Bins by each state of the model that is not an output itself.
    #[serde(default)]
    pub by_state: Vec<SignalBins>,
    /// Bins by direction of change of the model's output: falling, steady, rising (the edges are rates per second).
    pub by_direction: Vec<Bin>,
    /// Bins by frequency \[Hz\]: the root mean square of the residual in octave bands.
    pub by_frequency: Vec<Bin>,
    /// The worst bin of each kind in which the model fails, if its share of the squared error exceeds its share of the samples by more than
    /// 0.05; the largest excess first, the frequencies last.
    pub worst: Vec<Failure>,
}

/// A region where a model fails.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// Variable of its bin.
    pub by: FailureKind,
    /// Name of the input or state; empty of other kinds.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub signal: String,
    /// Unit of the input or state; empty of other kinds.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// The bin.
    pub bin: Bin,
    /// Its share of the squared error (0 to 1).
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub error_share: f64,
    /// Its share of the samples, of frequencies that of the spectral lines (0 to 1).
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub sample_share: f64,
}

/// Variable of the bins of a [`Failures`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FailureKind {
    /// Time \[s\].
    Time,
    /// The model's output.
    Output,
    /// An input.
    Input,
    /// A state.
    State,
    /// Rate of the model's output.
    Direction,
    /// Frequency \[Hz\].
    Frequency,
}
