//! Results of SRIVC and RIVC in addition to the model.

use serde::Serialize;

/// Results of SRIVC and RIVC in addition to the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Refined {
    /// SRIVC, RIVC, CLSRIVC or CLRIVC.
    pub name: &'static str,
    /// Whether `A(0) = 0`.
    pub integrator: bool,
    /// Delay of each input, s.
    pub delays: Vec<f64>,
    /// Records that were fitted.
    pub records: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Noise of each record.
    pub noise: Vec<RecordNoise>,
    /// Rows of each record that are not used, because the delayed inputs are from before the record.
    pub left_out: Vec<usize>,
    /// In a loop: share of the input's power that the reference explains.
    pub explained: Option<f64>,
    /// Iterations.
    pub iterations: usize,
    /// Whether the estimates have converged.
    pub converged: bool,
}

/// The noise of a record, an autoregression counted in samples: of the residual for SRIVC.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordNoise {
    /// Coefficients of the noise model; none for white noise.
    pub coefficients: Vec<f64>,
    /// Standard deviation of the innovations, output unit.
    pub deviation: f64,
}
