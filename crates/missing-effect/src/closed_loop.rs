//! Records from a closed loop: the loop simulated from its reference where its controller is known, and what is said where
//! it cannot be.
//!
//! The noise comes back through the command. A model that runs on the measured command is then wrong in a way that
//! depends on the colour of the noise (`greybox`, `feedback.rs`); one whose loop runs on the reference is not.

use ct_signals::{ArModel, residual_tests};
use greybox::{Replay, Setup, coloured, fit_from};
use plants::Variable;
use statrs::{
    distribution::{ChiSquared, ContinuousCDF},
    function::erf::erfc,
};

use crate::{
    ControlLoop, Error, Options, Problem, control_loop::check_stable, node::Node,
    noise_floor::NOISE_ORDER, problem::STOPPING,
};

/// Feedback is said to be there below this p-value.
const FEEDBACK: f64 = 1e-4;
/// A controller whose command differs from the measured one by more than this part of what that moves is another one.
/// What it differs by less is known, and simulated with the loop.
const OTHER_CONTROLLER: f64 = 0.05;
/// Lags at which the residual is looked for in the command.
const LAGS: usize = 10;
/// Highest order of the filters that whiten the residual and the command.
const WHITENING_ORDER: usize = 20;

/// What follows where a model runs on the measured command of a loop.
const MEASURED: &str = "The model runs on the measured command, which holds the noise: where the noise has another colour than the one that was found, estimates and scores are biased, and the standard errors are made wider for it.";

/// Closes the loop around a fitted node where that is possible, and says what is known of the loop.
pub(crate) fn enclose<'a>(
    problem: &Problem,
    options: &Options,
    node: Node<'a>,
) -> Result<(Node<'a>, Option<ControlLoop>), Error> {
    let Some(controller) = &problem.controller else {
        // A term in time that was kept from this record has followed its noise, what came later too: the residual beside it says
        // nothing of what the command answers to.
        let timed = problem
            .terms
            .iter()
            .any(|term| term.variable == Variable::Time);
        if timed {
            return Ok((node, None));
        }
        return Ok(match feedback_p(&node)? {
            p if p < FEEDBACK => {
                let said = format!(
                    "The command answers to the noise (p {}): there is feedback, and no [controller] in the model file; give it, and the reference, and the loop is simulated. {MEASURED}",
                    chance(p)
                );
                (node, Some(ControlLoop::measured(Some(p), None, said)))
            }
            _ => (node, None),
        });
    };
    check_stable(&node, controller)?;
    if !options.simulate_loop {
        return Ok((node, Some(not_simulated("as was asked for", None))));
    }
    let (setup, x) = match node.setup.in_loop(controller, &node.fit.x) {
        Ok(closed) => closed,
        Err(
            why @ (greybox::Error::NoReference { .. }
            | greybox::Error::ConstantReference { .. }
            | greybox::Error::CommandNotHeld { .. }),
        ) => return Ok((node, Some(not_simulated(&why.to_string(), None)))),
        Err(error) => return Err(error.into()),
    };
    let (mismatch, part) = disagreement(setup.replays());
    if part > OTHER_CONTROLLER {
        let why = format!(
            "the measured command disagrees with the controller of the model file, R/S (r - y), by {mismatch:.3} {} rms, {:.0} % of what it moves: check gain, integral_time (s), u_min and u_max, the sign, and that u is the command as it was recorded",
            problem.records[0].input.unit,
            100.0 * part
        );
        return Ok((node, Some(not_simulated(&why, Some(mismatch)))));
    }
    let fit = fit_from(&setup, &[x], &node.fit.noise, STOPPING)?.continuing(&node.fit);
    let said = format!(
        "The loop is simulated from its reference: no noise that came back through the command is in the model. The measured command agrees with the controller's to {mismatch:.4} {} rms.",
        problem.records[0].input.unit
    );
    let enclosed = Node { setup, fit, ..node };
    Ok((
        enclosed,
        Some(ControlLoop {
            simulated: true,
            feedback_p: None,
            mismatch: Some(mismatch),
            said: vec![said],
        }),
    ))
}

fn not_simulated(why: &str, mismatch: Option<f64>) -> ControlLoop {
    let said = format!("The loop is not simulated: {why}. {MEASURED}");
    ControlLoop::measured(None, mismatch, said)
}

fn chance(p: f64) -> String {
    if p < 1e-9 {
        "< 1e-9".to_string()
    } else {
        format!("= {p:.0e}")
    }
}

/// How far the measured commands are from the controller's own, and which part that is of what they move; the worst
/// record's.
fn disagreement(replays: &[Replay]) -> (f64, f64) {
    replays
        .iter()
        .map(|replay| (replay.rms, replay.rms / replay.moves.max(f64::MIN_POSITIVE)))
        .fold(
            (0.0, 0.0),
            |worst, own| if own.1 >= worst.1 { own } else { worst },
        )
}

/// p-value of the test that the past and present of the residual do not show in the command, which a controller makes of
/// the reading; of several records the smallest, corrected for having taken it.
///
/// Haugh's test with the command as what follows, on the ranks of the two whitened series: a few large steps of a set
/// point, which a command holds beside the noise, would otherwise drown it. The ranks are whitened once more: those of a
/// command that is held for long are not white.
fn feedback_p(node: &Node) -> Result<f64, Error> {
    let residuals = node.setup.residuals(&node.fit.x)?;
    let (mut least, mut count) = (1.0_f64, 0.0);
    for (record, residual) in node.setup.records.iter().zip(&residuals) {
        let lags = LAGS.min(record.len() / 4).max(1);
        let (before, after) = (
            whitened(&ranks(&whitened(residual)?))?,
            whitened(&ranks(&whitened(&record.input.values)?))?,
        );
        let n = record.len() as f64;
        let correlation = residual_tests::cross_correlation(&before, &after, lags);
        let q: f64 = correlation
            .iter()
            .enumerate()
            .map(|(lag, r)| n * (n + 2.0) * r * r / (n - lag as f64))
            .sum();
        let all = ChiSquared::new((lags + 1) as f64).map_or(1.0, |chi| chi.sf(q));
        // The present alone: a proportional part shows there.
        let now = erfc(correlation[0].abs() * (0.5 * n).sqrt());
        least = least.min(all).min(now);
        count += 2.0;
    }
    Ok((least * count).min(1.0))
}

/// A series about its mean, made white by an autoregressive filter of its own.
fn whitened(x: &[f64]) -> Result<Vec<f64>, Error> {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    let x: Vec<f64> = x.iter().map(|value| value - mean).collect();
    Ok(ArModel::fit(&[&x], WHITENING_ORDER)?.whiten(&x))
}

/// The place of each value in the order of all of them; equal ones share theirs.
fn ranks(x: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..x.len()).collect();
    order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
    let mut ranks = vec![0.0; x.len()];
    let mut from = 0;
    while from < order.len() {
        let mut to = from;
        while to + 1 < order.len() && x[order[to + 1]] <= x[order[from]] {
            to += 1;
        }
        for &at in &order[from..=to] {
            ranks[at] = 0.5 * (from + to) as f64;
        }
        from = to + 1;
    }
    ranks
}

/// Standard errors that allow for a bias from feedback: the fits in the metric of white noise and of the noise that was
/// found are both right where no noise comes back, and differ by about the bias where it does.
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

fn other_metric(setup: &Setup, node: &Node) -> Result<Vec<f64>, Error> {
    Ok(if node.fit.noise.order() == 0 {
        coloured(setup, node.fit.clone(), NOISE_ORDER, STOPPING)?.x
    } else {
        let white = ArModel::white(1.0);
        fit_from(setup, std::slice::from_ref(&node.fit.x), &white, STOPPING)?.x
    })
}
