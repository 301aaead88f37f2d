//! Results of an identification.

use ct_signals::Channel;
use missing_effect::{MendedGaps, Parameter};
use serde::Serialize;

use crate::{Drift, InLoop, Method, Order, Refined, Warning};

/// Settings that were used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Settings {
    /// Memory of the recursion, `1/eta`, s.
    pub memory: f64,
    /// Bandwidth of the state variable filters, 1/s.
    pub bandwidth: f64,
    /// Time constant of the best model of first order, s: start of the recursion.
    pub first_order: f64,
    /// Simulation error of that model, root mean square, in the output's unit.
    pub first_order_rmse: f64,
}

/// Result of an identification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identification {
    /// Version of this record.
    pub schema: u32,
    /// How.
    pub method: Method,
    /// The order.
    pub order: Order,
    /// Name of the record.
    pub record: String,
    /// Settings of a recursion without a loop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settings: Option<Settings>,
    /// a_1 to a_n, b_0 to b_m, offset, at the end of the record. The standard error is that of the recursion with its memory.
    pub parameters: Vec<Parameter>,
    /// Time constants of the model's real poles, s, the slowest first.
    pub time_constants: Vec<f64>,
    /// Periods and dampings of its complex poles: s, and no unit.
    pub oscillations: Vec<Oscillation>,
    /// Simulation error, root mean square over the record, in the output's unit: the final model runs on the input alone, from an
    /// initial state that is fitted.
    pub simulation_rmse: f64,
    /// `100 (1 - simulation_rmse/s)` with the standard deviation s of the output, %.
    pub fit_percent: f64,
    /// Warnings about the use of the model.
    pub warnings: Vec<Warning>,
    /// The parameters over time; for a recursion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<Trajectory>,
    /// Additional results of a method for a loop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_loop: Option<InLoop>,
    /// Additional results of SRIVC and RIVC.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refined: Option<Refined>,
    /// Gain and time constant over the level; `None` if the level is constant, or if the record is too short.
    pub drift: Option<Drift>,
    /// Handling of missing rows and samples of the input; `None` if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gaps: Option<MendedGaps>,
    /// The plant, without offsets.
    #[serde(skip)]
    pub plant: rivc::Plant,
    /// The record for a plot.
    #[serde(skip)]
    pub shown: Shown,
}

/// A pair of complex poles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Oscillation {
    /// Natural period without damping, s.
    pub period: f64,
    /// Relative damping, 0 to 1.
    pub damping: f64,
}

/// Parameters over time, in the order of [`Identification::parameters`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trajectory {
    /// Time, s.
    pub time: Vec<f64>,
    /// Numbers of these samples, from 0.
    #[serde(skip)]
    pub samples: Vec<usize>,
    /// One series for each parameter.
    pub values: Vec<Vec<f64>>,
    /// Standard errors; NaN (`null`) with too few samples.
    pub std_errors: Vec<Vec<f64>>,
}

impl Trajectory {
    /// Time from which the estimates are taken as settled: half the record.
    #[must_use]
    pub fn settled(&self) -> f64 {
        match (self.time.first(), self.time.last()) {
            (Some(first), Some(last)) => 0.5 * (first + last),
            _ => f64::NAN,
        }
    }
}

/// The record and the final model's simulation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shown {
    /// Time, s.
    pub time: Vec<f64>,
    /// Input.
    pub input: Channel,
    /// Output.
    pub output: Channel,
    /// Simulated output.
    pub simulated: Vec<f64>,
}
