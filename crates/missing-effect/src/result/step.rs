//! One of the models from the base to the last set of effects: its errors, its parameters, its residual tests and where it fails.

use serde::{Deserialize, Serialize};

use super::{Parameter, PerOutput};

/// Residual tests of one fit, of its first record but for `input_p`; the bounds are for 95 %.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResidualTests {
    /// Autocorrelation of the simulation residual at lags 0, 1, ...
    #[serde(deserialize_with = "crate::result::numbers")]
    pub autocorrelation: Vec<f64>,
    /// Cross-correlation of the whitened input with the whitened residual at lags 0, 1, ...
    #[serde(deserialize_with = "crate::result::numbers")]
    pub cross_correlation: Vec<f64>,
    /// Half-width of the 95 % band of the autocorrelation.
    #[serde(deserialize_with = "crate::result::number")]
    pub autocorrelation_bound: f64,
    /// Half-width of the 95 % band of the cross-correlation.
    #[serde(deserialize_with = "crate::result::number")]
    pub cross_correlation_bound: f64,
    /// p-value of the Ljung-Box test: whiteness of the simulation residual.
    #[serde(deserialize_with = "crate::result::number")]
    pub whiteness_p: f64,
    /// p-value of the portmanteau test of the cross-correlation with the input (in a simulated loop the reference), of all records.
    #[serde(deserialize_with = "crate::result::number")]
    pub input_p: f64,
}

/// The residual in one bin: a time window, a range of level, of flow, ...
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Position of the record of a window, fitted ones first; `None` for all fitted records together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub record: Option<usize>,
    /// Lower edge.
    #[serde(deserialize_with = "crate::result::number")]
    pub from: f64,
    /// Upper edge.
    #[serde(deserialize_with = "crate::result::number")]
    pub to: f64,
    /// Samples in it; of frequencies the lines of the spectrum.
    pub count: usize,
    /// Mean residual (measured minus model), in the output's unit; zero of frequencies.
    #[serde(deserialize_with = "crate::result::number")]
    pub mean: f64,
    /// Root mean square of the residual, in the output's unit.
    #[serde(deserialize_with = "crate::result::number")]
    pub rms: f64,
    /// Whether the model fails in the bin: its mean square is clearly above the expected one for noise.
    pub fails: bool,
}

/// Regions where a model fails, in all fitted records.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Failures {
    /// Bins by time \[s\], record by record.
    pub by_time: Vec<Bin>,
    /// Bins by the model's level, in the output's unit.
    pub by_level: Vec<Bin>,
    /// Bins by the command to the actuator (the flow into the process), in the input's unit.
    pub by_flow: Vec<Bin>,
    /// Bins by direction of change of the model's level: falling, steady, rising (the edges are rates per second).
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
    /// Kind of its bin.
    pub by: FailureKind,
    /// The bin.
    pub bin: Bin,
    /// Its share of the squared error (0 to 1).
    #[serde(deserialize_with = "crate::result::number")]
    pub error_share: f64,
    /// Its share of the samples, of frequencies that of the spectral lines (0 to 1).
    #[serde(deserialize_with = "crate::result::number")]
    pub sample_share: f64,
}

/// Variable of the bins of a [`Failures`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FailureKind {
    /// Time \[s\].
    Time,
    /// The model's level.
    Level,
    /// The command.
    Flow,
    /// Rate of the model's level.
    Direction,
    /// Frequency \[Hz\].
    Frequency,
}

/// One of the reported models: the base, or the base and the effects added so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The effect that this step added; `None` for the base.
    pub added: Option<String>,
    /// The vessel or pump it acts in, where the plant has more than one: `upper` or `lower` of two tanks.
    pub place: Option<String>,
    /// Root mean square of the simulation error on the fitted records, in the output's unit; NaN, and not written, of several outputs.
    #[serde(
        skip_serializing_if = "crate::result::none",
        default = "crate::result::no_number"
    )]
    #[serde(deserialize_with = "crate::result::number")]
    pub rmse: f64,
    /// Simulation error on the held-out record, whose first five samples determine its initial states and are not scored.
    pub rmse_test: Option<f64>,
    /// `rmse` of each output by its name.
    pub rmse_per_output: PerOutput,
    /// `rmse_test` of each output by its name.
    pub rmse_test_per_output: Option<PerOutput>,
    /// Root mean square of the simulation errors of all outputs, each divided by the noise floor of its output: one is the noise.
    #[serde(deserialize_with = "crate::result::number")]
    pub weighted_rmse: f64,
    /// Weighted error on the held-out record.
    pub weighted_rmse_test: Option<f64>,
    /// Bayesian information criterion with the noise model of this model's residual; smaller is better.
    #[serde(deserialize_with = "crate::result::number")]
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

/// Results of one model at one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutputStep {
    /// Its name.
    pub name: String,
    /// Root mean square of the simulation error on the fitted records, in the output's unit.
    #[serde(deserialize_with = "crate::result::number")]
    pub rmse: f64,
    /// Simulation error on the held-out records.
    pub rmse_test: Option<f64>,
    /// The parts of `rmse_test`; `None` without held-out records.
    pub held_out_error: Option<HeldOutError>,
    /// Residual tests.
    pub tests: ResidualTests,
    /// Regions where the model fails.
    pub failures: Failures,
}

/// The mean squared error on held-out records, split into the parts of an offset, a gain and the rest, as root mean squares \[output
/// unit\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeldOutError {
    /// Mean of measured minus model, record by record.
    #[serde(deserialize_with = "crate::result::number")]
    pub offset: f64,
    /// Part of the error that a factor on the model's deviations from its mean explains in addition to the offset.
    #[serde(deserialize_with = "crate::result::number")]
    pub gain: f64,
    /// The rest of the error: the shape.
    #[serde(deserialize_with = "crate::result::number")]
    pub shape: f64,
}
