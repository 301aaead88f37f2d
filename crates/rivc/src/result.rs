//! The result of an estimation: the parameters with their standard errors, the plant, and how well it fits.

use ct_signals::ArModel;
use serde::{Deserialize, Serialize};

use crate::plant::Plant;

/// Kind of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// `a_i` of A.
    A {
        /// The power of p.
        power: usize,
    },
    /// `b_i` of an input.
    B {
        /// Index of the input, from 0.
        input: usize,
        /// The power of p.
        power: usize,
    },
    /// Delay of an input \[time\].
    Delay {
        /// Index of the input, from 0.
        input: usize,
    },
    /// Offset of a record: output unit, with an integrator output unit/time.
    Offset {
        /// Index of the record, from 0; the parts of one record count as one.
        record: usize,
    },
}

/// An estimated parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Kind of the parameter.
    pub kind: Kind,
    /// Estimate of the parameter.
    pub value: f64,
    /// Standard error; none for a delay at the end of its range.
    pub std_error: Option<f64>,
}

/// A name in the program: a separate type, because serde would borrow a plain reference from the input.
type Name = &'static str;

/// The estimate. `A = 1 + a_1 p + .. + a_n p^n`, with an integrator `A = p + a_2 p^2 + .. + a_n p^n`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// SRIVC, RIVC, CLSRIVC or CLRIVC.
    #[serde(deserialize_with = "method")]
    pub method: Name,
    /// Parameters in this order: estimated a, all b input by input, estimated delays, offset of each record.
    pub parameters: Vec<Parameter>,
    /// Covariance of [`Estimate::parameters`], row by row; 0 for a delay at the end of its range.
    pub covariance: Vec<f64>,
    /// The plant, with delays that were known or estimated.
    pub plant: Plant,
    /// In a loop, the share of the first input's power about its mean that the reference explains, the least of all records: instruments
    /// are weak where it is small.
    pub explained: Option<f64>,
    /// Autoregression of each record's residual, counted in its samples; one for the parts of a record.
    pub noise: Vec<ArModel>,
    /// Root mean square of measured less simulated output over the available readings, on the measured inputs; output unit.
    pub residual_rms: f64,
    /// Number of samples with a residual; samples without a reading are not counted.
    pub samples: usize,
    /// Iterations from the last start.
    pub iterations: usize,
    /// Whether the estimates have converged; otherwise they are those with the least output error among the iterates, and their standard
    /// errors are not reliable.
    pub converged: bool,
    /// For each record, the first sample that is used: for earlier samples the delayed inputs are not known.
    pub first: Vec<usize>,
    /// For each record from this sample on, the output simulated from the measured inputs; output unit.
    pub simulated: Vec<Vec<f64>>,
}

/// Reads the name of a method.
fn method<'de, D: serde::Deserializer<'de>>(from: D) -> Result<&'static str, D::Error> {
    let name = String::deserialize(from)?;
    let known = ["SRIVC", "RIVC", "CLSRIVC", "CLRIVC"]
        .into_iter()
        .find(|known| *known == name);
    known.ok_or_else(|| serde::de::Error::custom(format_args!("no method is called `{name}`")))
}

impl Estimate {
    /// Value and standard error of a parameter that was estimated.
    pub fn parameter(&self, kind: Kind) -> Option<&Parameter> {
        self.parameters.iter().find(|found| found.kind == kind)
    }
}
