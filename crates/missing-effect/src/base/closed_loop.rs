//! Records from a closed loop: the loop is simulated from its reference if its controller is known; otherwise a warning is given.
//!
//! The noise is fed back through the command. A model that is simulated with the measured command is then biased, depending on the spectrum
//! of the noise (`greybox`, `feedback.rs`); a model whose loop is simulated from the reference is not.

use greybox::{Replay, Setup, coloured, fit_from};
use plants::Variable;

use crate::{
    ControlLoop, Error, NotSimulated, Options, Problem,
    base::{control_loop::check_stable, feedback_test},
    fit::{
        node::{Node, STOPPING},
        noise_model::NOISE_ORDER,
    },
};

/// Significance level of the feedback test.
const FEEDBACK: f64 = 1e-4;
/// Largest relative difference between the controller's command and the measured one. A controller with a larger difference is not used; a
/// smaller difference is simulated as a known input of the loop.
const OTHER_CONTROLLER: f64 = 0.05;

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
        let lags = feedback_test::LAGS;
        let detected = (p < FEEDBACK).then(|| ControlLoop {
            feedback_p: Some(p),
            ..ControlLoop::measured(NotSimulated::UnknownController { lags })
        });
        return Ok((node, detected));
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
            let why = match error {
                greybox::Error::NoReference { record } => NotSimulated::NoReference { record },
                greybox::Error::ConstantReference { record, value } => {
                    NotSimulated::ConstantReference { record, value }
                }
                greybox::Error::CommandNotHeld { record } => {
                    NotSimulated::CommandNotHeld { record }
                }
                error => return Err(error.into()),
            };
            return Ok((node, Some(ControlLoop::measured(why))));
        }
    };
    let (mismatch, share) = disagreement(setup.replays());
    if share > OTHER_CONTROLLER {
        let other = ControlLoop {
            mismatch: Some(mismatch),
            ..ControlLoop::measured(NotSimulated::OtherController { share })
        };
        return Ok((node, Some(other)));
    }
    let fit = fit_from(&setup, &[x], &node.fit.noise, STOPPING)?.continuing(&node.fit);
    let enclosed = Node { setup, fit, ..node };
    Ok((
        enclosed,
        Some(ControlLoop {
            simulated: true,
            feedback_p: None,
            mismatch: Some(mismatch),
            not_simulated: None,
        }),
    ))
}

/// Difference between the measured commands and the controller's output, and its ratio to the standard deviation of the command; for the
/// worst record.
fn disagreement(replays: &[Replay]) -> (f64, f64) {
    replays
        .iter()
        .map(|replay| (replay.rms, replay.rms / replay.moves.max(f64::MIN_POSITIVE)))
        .fold(
            (0.0, 0.0),
            |worst, own| if own.1 >= worst.1 { own } else { worst },
        )
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
            feedback_test::feedback_p(&record.inputs[0].values, &read, gain)
        })
        .fold(1.0, f64::min);
    Ok((least * residuals.len() as f64).min(1.0))
}

/// Standard errors that allow for a bias from feedback: the fits with white-noise weighting and with the noise model are both consistent
/// without feedback, and differ by about the bias with feedback.
pub(crate) fn widened(
    node: &Node,
    std_errors: Vec<Option<f64>>,
) -> Result<Vec<Option<f64>>, Error> {
    let other = other_metric(&node.setup, node)?;
    Ok(std_errors
        .into_iter()
        .zip(node.fit.x.iter().zip(&other))
        .map(|(error, (own, other))| error.map(|error| error.hypot(own - other)))
        .collect())
}

/// Fit with the other weighting: white noise for a fit with a noise model, and the reverse.
pub(crate) fn other_metric(setup: &Setup, node: &Node) -> Result<Vec<f64>, Error> {
    Ok(if node.fit.noise.order() == 0 {
        coloured(setup, node.fit.clone(), NOISE_ORDER, STOPPING)?.x
    } else {
        let white = setup.white_noise();
        fit_from(setup, std::slice::from_ref(&node.fit.x), &white, STOPPING)?.x
    })
}
