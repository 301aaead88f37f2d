//! Errors of identification: every message names the record or, first of all, the argument, and the correction.

use ct_signals::quoted;
use missing_effect::numbers::significant;

use crate::{MAX_ORDER, Method, Order};

/// Reason why no model was identified.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No record is given.
    #[error("no record is given")]
    NoRecord,
    /// A record without an input or an output.
    #[error("{record}: there is no {kind}; a record needs one input and one output at least")]
    NoSignal {
        /// Name of the record.
        record: String,
        /// Missing signal: `input` or `output`.
        kind: &'static str,
    },
    /// An order that no model has.
    #[error(
        "an order is n,m with n from 1 to {MAX_ORDER} and m from 0 to n, as in 2,1; found {order}"
    )]
    WrongOrder {
        /// Requested order.
        order: Order,
    },
    /// A signal is constant.
    #[error(
        "{record}: \"{signal}\" is constant at {value}, so that nothing can be identified; record at least a step up and a step down"
    )]
    Constant {
        /// Name of the record.
        record: String,
        /// Name of the signal.
        signal: String,
        /// Constant value, in the signal's unit.
        value: f64,
    },
    /// A setting that has to be above 0.
    #[error("{setting} is {value}, but must be a number of {unit} above 0")]
    NotPositive {
        /// The setting.
        setting: &'static str,
        /// Its unit.
        unit: &'static str,
        /// What was given.
        value: f64,
    },
    /// A bandwidth for which the filters pass nothing, or only rounding errors.
    #[error(
        "bandwidth is {found:e} 1/s, but must be from {low:.1e} to {high:.1e} 1/s for this record; without it, it is chosen"
    )]
    Bandwidth {
        /// Given value, 1/s.
        found: f64,
        /// The least, 1/s.
        low: f64,
        /// The largest, 1/s.
        high: f64,
    },
    /// The method has not found a model that can be simulated.
    #[error("{record}: no model of order {order} was found: {why}; try {}another method", or_lower(*.order))]
    NoModel {
        /// Name of the record.
        record: String,
        /// The order.
        order: Order,
        /// Reason in words.
        why: String,
    },
    /// The information of the record is singular.
    #[error(
        "the record does not determine the parameters of order {order}; try {}a record with more movement in its input",
        or_lower(*.order)
    )]
    Untold {
        /// The order.
        order: Order,
    },
    /// No row could be used.
    #[error("no sample could be used; check the record for gaps")]
    NoSample,
    /// Too few rows are left for the filters of `ct-rls`.
    #[error(
        "{:.0} % of the readings are missing, and only {left} of {rows} rows are far enough after long gaps for the filters of ct-rls; srivc and fcloe leave single readings out",
        100.0 * .missing
    )]
    RowsLeft {
        /// Share of the readings that is missing, 0 to 1.
        missing: f64,
        /// Rows that are left.
        left: usize,
        /// Rows of the record.
        rows: usize,
    },
    /// The recursion ended at a model that is unstable.
    #[error(
        "the final estimates give an unstable model; try {}stabilized-oe, whose model is kept stable",
        or_lower(*.order)
    )]
    Unstable {
        /// The order.
        order: Order,
    },
    /// Only `fcloe` estimates levels.
    #[error(
        "levels estimated is for fcloe only; {} takes them from the record: rest, mean or zero",
        .method.id()
    )]
    LevelsEstimated {
        /// The method that was asked for.
        method: Method,
    },
    /// Every one of several methods has failed.
    #[error("{reason}")]
    AllRefused {
        /// Message of the first error, in the names of the caller.
        reason: String,
    },
    /// The fit ended where the loop would become unstable.
    #[error(
        "{record}: the fit ended where the loop would become unstable: the best fit is a plant that this controller does not stabilise; check the controller's sign and units, or the orders"
    )]
    StabilityBorder {
        /// Name of the record.
        record: String,
    },
    /// The controller's output is not the measured command.
    #[error("{}", self.worded("the controller"))]
    ControllerMismatch {
        /// Name of the record.
        record: String,
        /// Measured command less the controller's, root mean square, in `unit`.
        mismatch: f64,
        /// Standard deviation of the command, in `unit`.
        size: f64,
        /// Unit of the command.
        unit: String,
    },
    /// Too few rows are left for the filters of a regression.
    #[error(
        "{record}: {:.0} % of the readings of \"{}\" are missing, and only {left} of {rows} rows are far enough after long gaps for the filters of {}; srivc and fcloe leave single readings out",
        100.0 * .missing,
        quoted(.output),
        .method.id()
    )]
    MissingReadings {
        /// Name of the record.
        record: String,
        /// Name of the output.
        output: String,
        /// Share of the readings that is missing, 0 to 1.
        missing: f64,
        /// Rows that are left.
        left: usize,
        /// Rows of the record.
        rows: usize,
        /// The method.
        method: Method,
    },
    /// Error of an estimator, with its record.
    #[error("{record}: {what}")]
    InRecord {
        /// Name of the record.
        record: String,
        /// What is wrong and the correction.
        what: String,
    },
    /// Rows are missing, and the first fit for the longest hold failed.
    #[error(
        "{record}: rows or samples of the input are missing, and the preliminary fit that determines how long the input may be held failed: {why}; choose a part of the record, or put it on a coarser grid"
    )]
    FirstFit {
        /// Name of the record.
        record: String,
        /// Why.
        why: String,
    },
    /// A record.
    #[error(transparent)]
    Signals(#[from] ct_signals::Error),
    /// A recursive estimator.
    #[error(transparent)]
    Estimator(#[from] stabilized_oe::Error),
    /// A linear model.
    #[error(transparent)]
    Linear(#[from] ct_lti::Error),
    /// A linear model in a loop.
    #[error(transparent)]
    Loop(#[from] fcloe::Error),
    /// Refined instruments.
    #[error(transparent)]
    Instruments(#[from] rivc::Error),
}

impl From<ct_rls::Error> for Error {
    fn from(error: ct_rls::Error) -> Self {
        Self::Estimator(error.into())
    }
}

impl Error {
    /// The message, where `controller` says which one is meant.
    #[must_use]
    pub fn worded(&self, controller: &str) -> String {
        match self {
            Self::ControllerMismatch {
                record,
                mismatch,
                size,
                unit,
            } => format!(
                "{record}: the measured command disagrees with {controller}, R/S (r - y), by {} {unit} rms, {:.0} % of its variation: \
                 check gain, integral_time (s), u_min and u_max, the sign, and that u is the command as it was recorded",
                significant(*mismatch, 3),
                100.0 * mismatch / size
            ),
            _ => self.to_string(),
        }
    }
}

/// First suggestion: `order 2,0, or `; empty without a lower order.
fn or_lower(order: Order) -> String {
    order
        .lower()
        .map_or_else(String::new, |lower| format!("order {lower}, or "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lower_order_is_advised_where_there_is_one() {
        assert_eq!(or_lower(Order { n: 3, m: 3 }), "order 2,2, or ");
        assert_eq!(or_lower(Order { n: 1, m: 0 }), "");
    }

    #[test]
    fn whose_controller_disagrees_is_for_the_caller_to_say() {
        let error = Error::ControllerMismatch {
            record: "a.csv".into(),
            mismatch: 0.5,
            size: 2.0,
            unit: "V".into(),
        };
        let said = error.to_string();
        assert!(
            said.contains("disagrees with the controller, R/S"),
            "{said}"
        );
        let said = error.worded("the controller of a.toml");
        assert!(
            said.contains("of a.toml, R/S (r - y), by 0.500 V"),
            "{said}"
        );
    }
}
