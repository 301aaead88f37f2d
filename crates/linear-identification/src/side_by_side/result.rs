//! Results of all methods.

use missing_effect::{MendedGaps, Parameter};
use serde::Serialize;

use crate::{Method, Order, Shown, Warning};

/// Results of all methods.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SideBySide {
    /// Version of this record.
    pub schema: u32,
    /// Name of the record.
    pub record: String,
    /// The record comes from a loop with a known controller: errors on the measured command do not rank the methods.
    pub in_loop: bool,
    /// Handling of missing rows and samples of the input; `None` if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gaps: Option<MendedGaps>,
    /// Names of the records that were not fitted.
    pub test: Vec<String>,
    /// One row per method, with the order of least BIC; best simulation first, then the methods that failed.
    pub methods: Vec<Row>,
    /// All methods with all orders, if there are several orders.
    pub orders: Vec<Row>,
    /// The record.
    #[serde(skip)]
    pub shown: Shown,
}

/// A method with an order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The method.
    pub method: Method,
    /// The order.
    pub order: Order,
    /// Wall time with all methods in parallel, s.
    pub seconds: f64,
    /// Assumptions of the method.
    pub assumes: &'static str,
    /// Result of the method.
    pub found: Option<Outcome>,
    /// Reason why the method failed.
    pub refused: Option<String>,
}

/// Result of a method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// a_1 to a_n, b_0 to b_m, and an offset where the method estimates one.
    pub parameters: Vec<Parameter>,
    /// Time constants of the real poles, s.
    pub time_constants: Vec<f64>,
    /// Simulation error on the record, root mean square, output unit.
    pub rmse: f64,
    /// 100 (1 - rmse over the standard deviation of the output), %.
    pub fit_percent: f64,
    /// Simulation error on the records that were not fitted, over all of them.
    pub test_rmse: Option<f64>,
    /// %; nothing where the outputs are constant.
    pub test_fit_percent: Option<f64>,
    /// Whether all parameters differ significantly from zero, as far as standard errors are known, and no time constant is shorter than a
    /// step.
    pub determined: bool,
    /// Criterion: see the module.
    pub bic: f64,
    /// See the module.
    pub yic: Option<f64>,
    /// p-value of the Ljung-Box test of the simulation error.
    pub whiteness_p: f64,
    /// p-value of the test that the simulation error does not depend on the input.
    pub input_p: f64,
    /// Assumptions that the record violates.
    pub violated: Vec<Violation>,
    /// Warnings of the method.
    pub warnings: Vec<Warning>,
    /// The simulated output.
    #[serde(skip)]
    pub simulated: Vec<f64>,
}

/// An assumption of a method that the record violates.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Violation {
    /// The controller feeds the noise back to the input.
    NoiseFedBack,
    /// The simulation error depends on the input.
    DependsOnInput {
        /// p-value of the hypothesis that it does not; [`Outcome::input_p`].
        p_value: f64,
    },
    /// The simulation error exceeds the least one of this order.
    WorseThanLeast {
        /// Simulation error, root mean square, in the output's unit.
        rmse: f64,
        /// The least of all methods with this order, in the same unit.
        least: f64,
    },
}

impl Row {
    /// Sort key of orders: less is better.
    pub(super) fn key(&self) -> (bool, f64) {
        let found = self.found.as_ref();
        found.map_or((true, f64::INFINITY), |found| {
            (!found.determined, found.bic)
        })
    }

    pub(super) fn rmse(&self) -> f64 {
        let found = self.found.as_ref();
        found.map_or(f64::INFINITY, |found| found.rmse)
    }
}
