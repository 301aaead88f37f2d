//! The control loop that the records come from: it is simulated from its references if its controllers are known; otherwise a warning is
//! given.
//!
//! The noise is fed back through the inputs that controllers drive. A model that is simulated with these measured inputs is biased,
//! depending on the spectrum of the noise; a model whose loop is simulated from the references is not.

use ct_signals::Record;
use estimation::{Fit, Stopping, fit_from};
use greybox::{LoopController, ModelSetup, Replay, SimulatedLoop};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use crate::Error;
use crate::residual_tests::ResidualTests;
use crate::residual_tests::feedback::{LAGS, feedback_p};
use crate::thresholds::Thresholds;

/// Sampling intervals after which the sign of an input's gain is that of its step response.
const STEP_RESPONSE: usize = 50;

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

/// Significance level of the dependence of the loop's residual on a signal from outside, corrected for the number of outputs and records.
/// Chosen, as [`Thresholds::not_noise`].
const DEPENDS: f64 = 1e-4;

impl Enclosed<'_> {
    /// Whether the residual of the simulated loop depends on a reference or an input that no controller drives: then it is more than noise.
    /// Fed-back noise alone, which a fit on the measured inputs may follow, does not make it so.
    #[must_use]
    pub fn depends_on_external_signals(&self) -> bool {
        let Some(residuals) = estimation::residuals(&self.setup, &self.fit.x) else {
            return true;
        };
        let records = self.setup.records().iter();
        let records = records.flat_map(|r| std::iter::repeat_n(r, self.setup.outputs()));
        let mut tests = records.zip(&residuals).map(|(record, residual)| {
            ResidualTests::of(&self.setup.external_signals(record), residual).input_p
        });
        let level = DEPENDS / residuals.len() as f64;
        tests.any(|p| p < level)
    }

    /// The largest relative change of an output's error on the measured inputs between a fit on these and the fit in the simulated loop, and
    /// the output.
    #[must_use]
    pub fn change_of_error(&self, measured: &Fit) -> Option<(f64, &str)> {
        let outputs = &self.setup.records()[0].outputs;
        let pairs = self.fit.rmse.iter().zip(&measured.rmse);
        // A model without an error has no ratio.
        let change = |(looped, measured): (&f64, &f64)| match looped / measured - 1.0 {
            change if change.is_finite() => change,
            _ => 0.0,
        };
        let changes = pairs.map(change);
        let named = changes.zip(outputs.iter().map(|output| output.name.as_str()));
        named.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
    }
}

/// A fitted model in its loop.
#[derive(Debug)]
pub struct Enclosed<'a> {
    /// The setup, in the simulated loop if that is possible.
    pub setup: ModelSetup<'a>,
    /// The fit in this loop.
    pub fit: Fit,
    /// What is known of the loop; `None` without controllers and without detected feedback.
    pub control_loop: Option<ControlLoop>,
}

/// The loop of a model that does not follow its records on the measured inputs at its start values, where the loop can be simulated: the first
/// fit takes place in it.
#[must_use]
pub fn needed_loop(
    setup: &ModelSetup,
    controllers: &[LoopController],
    thresholds: &Thresholds,
) -> Option<Arc<SimulatedLoop>> {
    let start = setup.start();
    if controllers.is_empty()
        || setup.follows_inputs(start)
        || lacking(setup.records(), controllers, thresholds.lacking_readings).is_some()
    {
        return None;
    }
    let found = SimulatedLoop::needed(setup, start, controllers).ok()?;
    ControlLoop::mismatch_of(found.replays().iter().flatten(), thresholds).ok()?;
    Some(Arc::new(found))
}

/// Closes the loop around a fitted model if possible, and tests for feedback if no controller is known. A model that was fitted in its loop
/// ([`needed_loop`]) is fitted again with the loop's linear response at the fitted values.
///
/// - `controllers`: those that drove the inputs; `simulate`: whether their loop is simulated.
/// - `may_test`: the feedback test can be used. A function of time that was fitted to the records has also fitted their noise, with future
///   values: its residual cannot be tested.
///
/// # Errors
/// Where a fit fails.
pub fn enclose<'a>(
    setup: ModelSetup<'a>,
    fit: Fit,
    (controllers, simulate): (&[LoopController], bool),
    may_test: bool,
    (stopping, thresholds): (Stopping, &Thresholds),
) -> Result<Enclosed<'a>, Error> {
    let measured = |setup, fit, control_loop| {
        Ok(Enclosed {
            setup,
            fit,
            control_loop,
        })
    };
    if controllers.is_empty() {
        let detected = may_test
            .then(|| detected_feedback(&setup, &fit, thresholds))
            .flatten();
        return measured(setup, fit, detected);
    }
    let why = |why| Some(ControlLoop::measured(why));
    if !simulate {
        return measured(setup, fit, why(NotSimulated::AsRequested));
    }
    let is_needed = setup.is_run_in_loop();
    if !is_needed && let Some(hard) = hard_nonlinearity(&setup, &fit.x, controllers) {
        return measured(setup, fit, why(hard));
    }
    if let Some(record) = lacking(setup.records(), controllers, thresholds.lacking_readings) {
        return measured(setup, fit, why(NotSimulated::MissingReadings { record }));
    }
    let simulated = match SimulatedLoop::new(&setup, &fit.x, controllers) {
        Ok(simulated) => simulated,
        Err(error) => {
            let because = NotSimulated::because(error)?;
            return measured(setup, fit, why(because));
        }
    };
    let replays = simulated.replays().iter().flatten();
    let mismatch = match ControlLoop::mismatch_of(replays, thresholds) {
        Ok(mismatch) => mismatch,
        Err(other) => return measured(setup, fit, Some(other)),
    };
    let rows = setup.records().iter().map(Record::len).max().unwrap_or(0);
    if !is_needed
        && let Some((radius, alone)) = simulated.radius()
        && (radius.ln() - alone.ln().max(0.0)) * rows as f64 > thresholds.loop_growth
    {
        let radius = Some(radius);
        return measured(setup, fit, why(NotSimulated::Unstable { radius }));
    }
    let closed = setup.clone().in_loop(Arc::new(simulated));
    match fit_from(&closed, vec![fit.x.clone().into()], &fit.noise, stopping) {
        Ok(again) => {
            let again = closed.with_simulation_errors(again.continuing(&fit));
            let known = ControlLoop {
                needed: is_needed,
                ..ControlLoop::simulated(mismatch)
            };
            measured(closed, again, Some(known))
        }
        Err(estimation::Error::NoFiniteStart { .. }) if !is_needed => {
            measured(setup, fit, why(NotSimulated::Unstable { radius: None }))
        }
        Err(error) => Err(error.into()),
    }
}

/// The variable whose hard nonlinearity acts in the records ([`NotSimulated::HardNonlinearity`]).
pub(crate) fn hard_nonlinearity(
    setup: &ModelSetup,
    x: &[f64],
    controllers: &[LoopController],
) -> Option<NotSimulated> {
    let driven: Vec<usize> = controllers.iter().map(|of| of.input).collect();
    let of = setup.hard_nonlinearity(x, &driven)?;
    Some(NotSimulated::HardNonlinearity {
        of: setup.model().spec().about(of).name.clone(),
    })
}

/// Standard errors that allow for a bias from feedback, by the change of each entry with the other weighting
/// ([`estimation::moved_by_weighting`]).
#[must_use]
pub fn widened(std_errors: Vec<Option<f64>>, moved: &[f64]) -> Vec<Option<f64>> {
    let pairs = std_errors.into_iter().zip(moved);
    pairs
        .map(|(error, moved)| error.map(|error| error.hypot(*moved)))
        .collect()
}

/// The first record that lacks more than this share of the readings of a controlled output, or a value of a reference. The controller has
/// used readings that the record does not contain: they follow from its commands.
fn lacking(records: &[Record], controllers: &[LoopController], most: f64) -> Option<String> {
    let lacks = |record: &&Record| {
        controllers.iter().any(|of| {
            let read = record.outputs.get(of.controller.output());
            let reference = of.reference.and_then(|at| record.references.get(at));
            let rows = record.len() as f64;
            read.is_some_and(|read| read.missing() as f64 > most * rows)
                || reference.is_some_and(|reference| reference.missing() > 0)
        })
    };
    records.iter().find(lacks).map(|record| record.name.clone())
}

/// Feedback through an input, by the test with the smallest p-value, corrected for the number of tests; `None` if there is none, or the
/// simulation is not finite.
pub(crate) fn detected_feedback(
    setup: &ModelSetup,
    fit: &Fit,
    thresholds: &Thresholds,
) -> Option<ControlLoop> {
    let residuals = estimation::residuals(setup, &fit.x)?;
    let gains = setup.step_gains(&fit.x, STEP_RESPONSE);
    let outputs = setup.outputs();
    let (mut least, mut tests) = (None, 0.0);
    for (i, residual) in residuals.iter().enumerate() {
        let record = &setup.records()[i / outputs];
        // A missing reading has not affected the controller.
        let read = residual.iter().map(|e| if e.is_nan() { 0.0 } else { *e });
        let read: Vec<f64> = read.collect();
        for (input, gains) in record.inputs.iter().zip(&gains) {
            let gain = gains[i % outputs];
            if gain == 0.0 {
                continue;
            }
            tests += 1.0;
            let p = feedback_p(&input.values, &read, Some(gain));
            if least.as_ref().is_none_or(|(smallest, _)| p < *smallest) {
                least = Some((p, input.name.clone()));
            }
        }
    }
    let (p, through) = least?;
    ControlLoop::detected((p * tests).min(1.0), Some(through), thresholds)
}
