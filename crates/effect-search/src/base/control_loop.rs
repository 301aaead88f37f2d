//! The control loop that the records come from: it is simulated from its references if its controllers are known; otherwise a warning is
//! given.
//!
//! The noise is fed back through the inputs that controllers drive. A model that is simulated with these measured inputs is biased,
//! depending on the spectrum of the noise; a model whose loop is simulated from the references is not.

use ct_signals::Record;
use estimation::{Fit, Stopping, fit_from};
use greybox::{FitOptions, LoopController, ModelSetup, SimulatedLoop};
use statrs::statistics::Statistics;
use std::sync::Arc;

use crate::Error;
use crate::base::loop_state::{ControlLoop, NotSimulated};
use crate::residual_tests::ResidualTests;
use crate::residual_tests::feedback::feedback_p;
use crate::thresholds::Thresholds;

/// Sampling intervals after which the sign of an input's gain is that of its step response.
const STEP_RESPONSE: usize = 50;

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

/// The first fit of a model, from many starts: in its loop if that can be simulated and the model does not follow the records on the measured
/// inputs, neither at its start values nor where the fit in the loop describes the readings.
///
/// # Errors
/// Where no start gives a finite simulation.
pub fn first_fit<'a>(
    setup: ModelSetup<'a>,
    controllers: &[LoopController],
    options: &FitOptions,
    thresholds: &Thresholds,
) -> Result<(ModelSetup<'a>, Fit), Error> {
    if let Some(needed) = needed_loop(&setup, controllers, thresholds) {
        let closed = setup.clone().in_loop(needed);
        if let Ok(fit) = closed.fit(options)
            && needs_loop(&closed, &fit.x)
        {
            let fit = closed.with_simulation_errors(fit);
            return Ok((closed, fit));
        }
    }
    let fit = setup.fit(options)?;
    Ok((setup, fit))
}

/// The setup of a known fit: in the loop, if [`first_fit`] would have kept it.
#[must_use]
pub fn in_needed_loop<'a>(
    setup: ModelSetup<'a>,
    x: &[f64],
    controllers: &[LoopController],
    thresholds: &Thresholds,
) -> ModelSetup<'a> {
    let needed = needed_loop(&setup, controllers, thresholds);
    let closed = needed.map(|needed| setup.clone().in_loop(needed));
    closed
        .filter(|closed| needs_loop(closed, x))
        .unwrap_or(setup)
}

/// Whether the model of a fit in its loop does not follow its inputs. A fit that misses the readings says nothing of this.
fn needs_loop(closed: &ModelSetup, x: &[f64]) -> bool {
    !closed.follows_inputs(x) || misses(closed, x)
}

/// The loop of a model that leaves its records on the measured inputs at its start values, where the loop can be simulated.
fn needed_loop(
    setup: &ModelSetup,
    controllers: &[LoopController],
    thresholds: &Thresholds,
) -> Option<Arc<SimulatedLoop>> {
    let start = setup.start();
    if controllers.is_empty()
        || setup.follows_inputs(start)
        || !misses(setup, start)
        || lacking(setup.records(), controllers, thresholds.lacking_readings).is_some()
    {
        return None;
    }
    let found = SimulatedLoop::needed(setup, start, controllers).ok()?;
    ControlLoop::mismatch_of(found.replays().iter().flatten(), thresholds).ok()?;
    Some(Arc::new(found))
}

/// Whether a simulation cannot go on, or misses the readings ([`is_missed`]).
fn misses(setup: &ModelSetup, x: &[f64]) -> bool {
    let missed =
        |errors: Vec<f64>| (errors.iter().enumerate()).any(|(o, e)| is_missed(setup, o, *e));
    setup.rmse(x).is_none_or(missed)
}

/// Standard deviation of the readings of an output \[its unit\].
pub(crate) fn varies(setup: &ModelSetup, output: usize) -> f64 {
    let readings = setup
        .records()
        .iter()
        .flat_map(|r| &r.outputs[output].values);
    readings.filter(|y| !y.is_nan()).population_std_dev()
}

/// Whether an error, root mean square, is above the standard deviation of the readings of an output.
pub(crate) fn is_missed(setup: &ModelSetup, output: usize, error: f64) -> bool {
    error.is_nan() || error > varies(setup, output)
}

/// Closes the loop around a fitted model if possible, and tests for feedback if no controller is known. A model that was fitted in its loop
/// ([`first_fit`]) is fitted again with the loop's linear response at the fitted values.
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
