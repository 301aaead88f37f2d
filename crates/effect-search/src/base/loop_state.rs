//! What is known of the control loop of the records: whether it is simulated, and why not.

use greybox::Replay;
use serde::{Deserialize, Serialize};

use crate::residual_tests::feedback::LAGS;
use crate::thresholds::Thresholds;

/// The loop that the records come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControlLoop {
    /// The loop was simulated from its reference; otherwise the model ran on the measured command.
    pub simulated: bool,
    /// The model does not follow the records on its measured inputs: all its simulations run in the loop.
    #[serde(default)]
    pub needed: bool,
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
        /// The input; `None` for the command of a plant.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        input: Option<String>,
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
        #[serde(deserialize_with = "crate::not_finite::number")]
        value: f64,
    },
    /// The record says that the command is interpolated, but a controller holds it.
    CommandNotHeld {
        /// The record, by its name.
        record: String,
    },
    /// A controller reads an output that its command changes at once.
    DirectTerm {
        /// The output.
        output: String,
        /// The input that the controller drives.
        input: String,
    },
    /// A hard nonlinearity of the model acts in the records: a limit, a dead zone, friction, backlash. A linear plant does then not take the
    /// noise that controllers feed back out of the residual.
    HardNonlinearity {
        /// The state, or the input that a controller drives.
        of: String,
    },
    /// The linear loop of the fitted model and its controllers grows, so it cannot have produced the records.
    Unstable {
        /// Largest magnitude of its eigenvalues over one sampling interval; `None` if the simulation of the loop fails.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radius: Option<f64>,
    },
    /// In the simulated loop the residual depends on signals from outside, and the error at an output is another: the model lacks an effect,
    /// whose influence the loop weights otherwise.
    ModelError {
        /// The output.
        output: String,
        /// Relative change of its error.
        #[serde(deserialize_with = "crate::not_finite::number")]
        change: f64,
    },
    /// The measured command disagrees with the controller's output by `mismatch`.
    OtherController {
        /// `mismatch`, here at rows with a reading and without the largest hundredth of the rows, over the standard deviation of the command:
        /// above [`Thresholds::other_controller`]; not finite for a command that hardly changes.
        #[serde(deserialize_with = "crate::not_finite::number")]
        share: f64,
    },
}

impl NotSimulated {
    /// The reason behind an error of a loop.
    ///
    /// # Errors
    /// All other errors.
    pub fn because(error: greybox::Error) -> Result<Self, greybox::Error> {
        Ok(match error {
            greybox::Error::NoReference { record } => Self::NoReference { record },
            greybox::Error::ConstantReference { record, value } => {
                Self::ConstantReference { record, value }
            }
            greybox::Error::CommandNotHeld { record } => Self::CommandNotHeld { record },
            greybox::Error::DirectTerm { output, input } => Self::DirectTerm { output, input },
            error => return Err(error),
        })
    }
}

impl ControlLoop {
    /// A loop whose model ran on the measured command.
    #[must_use]
    pub fn measured(why: NotSimulated) -> Self {
        Self {
            simulated: false,
            needed: false,
            feedback_p: None,
            mismatch: None,
            not_simulated: Some(why),
        }
    }

    /// A simulated loop whose commands differ by `mismatch` from the measured ones.
    #[must_use]
    pub fn simulated(mismatch: f64) -> Self {
        Self {
            simulated: true,
            needed: false,
            feedback_p: None,
            mismatch: Some(mismatch),
            not_simulated: None,
        }
    }

    /// Feedback through an input, if the p-value of its test is below [`Thresholds::feedback`].
    #[must_use]
    pub fn detected(p: f64, input: Option<String>, thresholds: &Thresholds) -> Option<Self> {
        (p < thresholds.feedback).then(|| Self {
            feedback_p: Some(p),
            ..Self::measured(NotSimulated::UnknownController { lags: LAGS, input })
        })
    }

    /// Difference between the measured commands and those of the controllers, for the worst one.
    ///
    /// # Errors
    /// The loop is not simulated where the difference is above [`Thresholds::other_controller`].
    pub fn mismatch_of<'a>(
        replays: impl IntoIterator<Item = &'a Replay>,
        thresholds: &Thresholds,
    ) -> Result<f64, Self> {
        let replays = replays.into_iter();
        let share = |replay: &Replay| replay.usual / replay.moves.max(f64::MIN_POSITIVE);
        let worst = replays.max_by(|a, b| share(a).total_cmp(&share(b)));
        match worst.map(|replay| (share(replay), replay)) {
            Some((share, replay)) if share > thresholds.other_controller => Err(Self {
                mismatch: Some(replay.usual),
                ..Self::measured(NotSimulated::OtherController { share })
            }),
            worst => Ok(worst.map_or(0.0, |(_, replay)| replay.rms)),
        }
    }

    /// Standard errors have to include the bias from feedback.
    #[must_use]
    pub fn widens(known: Option<&Self>) -> bool {
        known.is_some_and(|known| !known.simulated)
    }
}
