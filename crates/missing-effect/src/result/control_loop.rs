//! The control loop that the records come from.

use serde::{Deserialize, Serialize};

/// The loop that the records come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControlLoop {
    /// The loop was simulated from its reference; otherwise the model ran on the measured command.
    pub simulated: bool,
    /// p-value of the hypothesis that the command does not depend on the noise; `None` if a controller is known.
    pub feedback_p: Option<f64>,
    /// Measured command minus the controller's output for the measured reading, root mean square, in the input's unit; `None` if not
    /// computed.
    pub mismatch: Option<f64>,
    /// Why the loop was not simulated; `None` if it was.
    pub not_simulated: Option<NotSimulated>,
}

/// Reason why a loop is not simulated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum NotSimulated {
    /// No controller is known, and the command depends on past residuals.
    UnknownController {
        /// Number of past residuals in the feedback test.
        lags: usize,
    },
    /// The options ask for the measured command.
    AsRequested,
    /// Readings are missing, so the controller cannot be checked against its commands.
    MissingReadings {
        /// The record, by its name.
        record: String,
    },
    /// The record contains no reference.
    NoReference {
        /// The record, by its name.
        record: String,
    },
    /// The reference is constant, so only noise excites the loop.
    ConstantReference {
        /// The record, by its name.
        record: String,
        /// Value of the reference \[output unit\].
        #[serde(deserialize_with = "effect_search::not_finite::number")]
        value: f64,
    },
    /// The record says that the command is interpolated, but a controller holds it.
    CommandNotHeld {
        /// The record, by its name.
        record: String,
    },
    /// The measured command disagrees with the controller's output by `mismatch`.
    OtherController {
        /// `mismatch` over the standard deviation of the command, above 0.05; not finite for a command that hardly changes.
        #[serde(deserialize_with = "effect_search::not_finite::number")]
        share: f64,
    },
}

impl ControlLoop {
    /// A loop whose model ran on the measured command.
    pub(crate) fn measured(why: NotSimulated) -> Self {
        Self {
            simulated: false,
            feedback_p: None,
            mismatch: None,
            not_simulated: Some(why),
        }
    }

    /// Standard errors have to include the bias from feedback.
    pub(crate) fn widens(known: Option<&Self>) -> bool {
        known.is_some_and(|known| !known.simulated)
    }
}
