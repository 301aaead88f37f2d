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
    /// Notes on the loop for the user, in words.
    pub said: Vec<String>,
}

impl ControlLoop {
    /// A loop whose model ran on the measured command, with the consequences.
    pub(crate) fn measured(feedback_p: Option<f64>, mismatch: Option<f64>, said: String) -> Self {
        Self {
            simulated: false,
            feedback_p,
            mismatch,
            said: vec![said],
        }
    }

    /// Standard errors have to include the bias from feedback.
    pub(crate) fn widens(known: Option<&Self>) -> bool {
        known.is_some_and(|known| !known.simulated)
    }
}
