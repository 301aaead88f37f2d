//! Records from a closed loop: the loop is simulated from its reference if its controller is known; otherwise a warning is given.
//!
//! The noise is fed back through the command. A model that is simulated with the measured command is then biased, depending on the spectrum
//! of the noise (`greybox`, `feedback.rs`); a model whose loop is simulated from the reference is not.

use effect_search::{Thresholds, residual_tests::feedback};
use greybox::{Fit, Setup, fit_from};
use plants::Variable;

use crate::{
    ControlLoop, Error, NotSimulated, Options, Problem,
    base::control_loop::check_stable,
    fit::{
        node::{Node, STOPPING},
        noise_model::NOISE_ORDER,
    },
};

/// Closes the loop around a fitted model if possible, and describes the loop.
pub(crate) fn enclose<'a>(
    problem: &Problem,
    options: &Options,
    node: Node<'a>,
) -> Result<(Node<'a>, Option<ControlLoop>), Error> {
    let Some(controller) = &problem.controller else {
        // A function of time that was fitted to this record has also fitted its noise, with future values: its residual cannot be used to
        // test for feedback.
        let timed = problem
            .terms
            .iter()
            .any(|term| term.variable == Variable::Time);
        if timed {
            return Ok((node, None));
        }
        let p = feedback_p(&node)?;
        return Ok((node, ControlLoop::detected(p, None, &Thresholds::DEFAULT)));
    };
    check_stable(&node, controller)?;
    if !options.simulate_loop {
        return Ok((node, Some(ControlLoop::measured(NotSimulated::AsRequested))));
    }
    let lacking = problem.records.iter().find(|r| {
        let read = r.outputs.get(controller.output());
        read.is_some_and(|output| output.missing() > 0)
    });
    if let Some(record) = lacking {
        let record = record.name.clone();
        let why = NotSimulated::MissingReadings { record };
        return Ok((node, Some(ControlLoop::measured(why))));
    }
    let (setup, x) = match node.setup.in_loop(controller, &node.fit.x) {
        Ok(closed) => closed,
        Err(error) => {
            let why = NotSimulated::because(error)?;
            return Ok((node, Some(ControlLoop::measured(why))));
        }
    };
    let mismatch = match ControlLoop::mismatch_of(setup.replays(), &Thresholds::DEFAULT) {
        Ok(mismatch) => mismatch,
        Err(other) => return Ok((node, Some(other))),
    };
    let fit = fit_from(&setup, &[x], &node.fit.noise, STOPPING)?.continuing(&node.fit);
    let enclosed = Node { setup, fit, ..node };
    Ok((enclosed, Some(ControlLoop::simulated(mismatch))))
}

/// p-value of the test that the command does not depend on past residuals; of several records the smallest, corrected for the selection.
fn feedback_p(node: &Node) -> Result<f64, Error> {
    let residuals = node.setup.residuals(&node.fit.x)?;
    let outputs = node.setup.outputs();
    let least = residuals
        .iter()
        .enumerate()
        .map(|(i, residual)| {
            let record = &node.setup.records[i / outputs];
            // The first parameter of every plant is its gain.
            let gain = record.references.is_empty().then_some(node.fit.x[0]);
            // A missing reading has not affected the controller.
            let read: Vec<f64> = residual
                .iter()
                .map(|e| if e.is_nan() { 0.0 } else { *e })
                .collect();
            feedback::feedback_p(&record.inputs[0].values, &read, gain)
        })
        .fold(1.0, f64::min);
    Ok((least * residuals.len() as f64).min(1.0))
}

/// Standard errors that allow for a bias from feedback.
pub(crate) fn widened(
    node: &Node,
    std_errors: Vec<Option<f64>>,
) -> Result<Vec<Option<f64>>, Error> {
    let moved = moved_by_weighting(&node.setup, &node.fit)?;
    Ok(effect_search::widened(std_errors, &moved))
}

/// How far a fit moves with the other weighting ([`estimation::moved_by_weighting`]).
pub(crate) fn moved_by_weighting(setup: &Setup, fit: &Fit) -> Result<Vec<f64>, Error> {
    let moved = greybox::moved_by_weighting(setup, fit, NOISE_ORDER, STOPPING);
    Ok(moved.map_err(greybox::Error::from)?)
}
