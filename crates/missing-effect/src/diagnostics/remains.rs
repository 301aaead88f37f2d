//! Tests whether the residual of a model is stationary AR noise that is independent of the input.
//!
//! An autoregressive model fits anything, a random walk included: that a residual *can* be whitened says nothing. Noise is
//! what is independent of the command, has no place in time, no period, and forgets faster than the process does.
//! Each of these is a test of the residual `w` whitened by the noise model of its own model's fit:
//! - **the command**: the past of the command, of its square, and of the size of its moves, against `w` (Haugh's test; a
//!   square and a move show what is even in the command or hangs on its direction). A whitened residual is independent of
//!   the past of anything, a controller's output included.
//! - **a period**: a line of the spectrum that stands out of its neighbours (`spectral_line.rs`).
//! - **an instant**: windows of 1, 2, 4, ... samples of `w`, whose sums over the root of their length are standard normal.
//! - **the level**: `w` against functions of what the model read a sample before. A term that is missing from a balance leaves a
//!   residual that drifts with the level, and is no noise however slow it is. As `w` is white and independent of the past, its   regression
//!   on any past is chi-square, whatever the colour of the regressors.
//! - **slowness**: the integral of the noise's autocorrelation over positive lags is longer than the slowest time constant
//!   of the process. Such a noise can stand for anything that the process lacks, so it is no answer.
//!
//! **References**: L. D. Haugh, J. American Statistical Association 71 (1976) 378-385; S. A. Billings, W. S. F. Voon,
//! Correlation based model validity tests for non-linear models, Int. J. Control 44 (1986) 235-244.

use ct_signals::{ArModel, Record, residual_tests::prewhitened_input_test};
use effect_search::residual::{instant, level_p, of_command, period, standardised};
use greybox::{Fit, Noise};
use rayon::prelude::*;

use crate::{
    Error,
    base::control_loop::slowest_time_constant,
    fit::{node::Node, noise_model::slowness_of},
};

/// Significance level of each residual test, corrected for the number of its comparisons.
const NOT_NOISE: f64 = 1e-4;

/// Structure of a residual that noise does not explain; the first one found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Remains {
    /// The command.
    Input,
    /// A period \[s\].
    Period(f64),
    /// An abrupt change from an instant on, for a while \[s\].
    Instant(f64, f64),
    /// The level.
    Level,
    /// A drift: its correlation time and the process's slowest time constant \[s\].
    Slow(f64, f64),
}

/// Structure of a residual that noise does not explain, with its record, if it is in one of the fitted records, and its output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Left {
    pub what: Remains,
    pub record: Option<usize>,
    pub output: usize,
}

impl Left {
    /// The noise level above which there is something to explain. A drift is noise too, and effects are confirmed with it as weighting;
    /// other unexplained structure is absorbed by the noise model, but hardly enters its innovations. By output.
    pub(crate) fn above(&self, noise: &Noise) -> Vec<f64> {
        let size = |noise: &ArModel| match self.what {
            Remains::Slow(..) => noise.stationary_std(),
            _ => noise.sigma(),
        };
        noise.iter().map(size).collect()
    }
}

/// Structure in the residual of a model that is not noise; `own` is the model's fit with the noise model of its own residual.
pub(crate) fn remains(node: &Node, own: &Fit) -> Result<Option<Left>, Error> {
    let outputs = node.setup.outputs();
    let (p, series) = least_p(node, None, of_command)?;
    if p < NOT_NOISE {
        return Ok(Some(Left {
            what: Remains::Input,
            record: series.map(|i| i / outputs),
            output: series.map_or(0, |i| i % outputs),
        }));
    }
    let residuals = node.setup.disturbance(&own.x)?;
    let records = node.setup.records;
    let level = NOT_NOISE / residuals.len() as f64;
    let left = |what: Remains, i: usize| Left {
        what,
        record: Some(i / outputs),
        output: i % outputs,
    };
    for (i, residual) in residuals.iter().enumerate() {
        let record = &records[i / outputs];
        let found = place_in_time(record, residual, own.noise.of_series(i), level)?;
        if let Some(what) = found {
            return Ok(Some(left(what, i)));
        }
    }
    let models = match node.setup.simulate_loop(&own.x)? {
        Some(run) => run.output,
        None => node.setup.simulate(&own.x)?.output,
    };
    for (i, (model, residual)) in models.iter().zip(&residuals).enumerate() {
        if level_p(model, &standardised(own.noise.of_series(i), residual)) < level {
            return Ok(Some(left(Remains::Level, i)));
        }
    }
    if own.noise.order() == 0 {
        return Ok(None);
    }
    let interval = node.setup.structure.scales.sample_interval;
    let wanders = own.noise.iter().enumerate();
    let wanders = wanders.map(|(o, noise)| (0.5 * interval * slowness_of(noise), o));
    let slowest = wanders.max_by(|a, b| a.0.total_cmp(&b.0));
    let process = slowest_time_constant(node)?;
    Ok(slowest
        .filter(|(wander, _)| *wander > process)
        .map(|(wander, output)| Left {
            what: Remains::Slow(wander, process),
            record: None,
            output,
        }))
}

/// p-value of the test that a model's residual at an output does not depend on the command; of several records the smallest, corrected for
/// the selection.
pub(crate) fn input_p(node: &Node, output: usize) -> Result<f64, Error> {
    Ok(least_p(node, Some(output), |u| vec![u.to_vec()])?.0)
}

/// The least p-value over all signals derived from a record's commands, and the series with this value.
fn least_p(
    node: &Node,
    output: Option<usize>,
    signals: impl Fn(&[f64]) -> Vec<Vec<f64>>,
) -> Result<(f64, Option<usize>), Error> {
    let residuals = node.setup.disturbance(&node.fit.x)?;
    // In a loop the command contains fed-back noise; the reference is the external signal.
    let in_loop = !node.setup.replays().is_empty();
    let (mut least, mut at, mut count) = (1.0, None, 0.0);
    let outputs = node.setup.outputs();
    let wanted = |k: usize| output.is_none_or(|output| output == k % outputs);
    for (k, residual) in residuals.iter().enumerate().filter(|(k, _)| wanted(*k)) {
        let record = &node.setup.records[k / outputs];
        let samples = residual.iter().filter(|e| !e.is_nan()).count();
        let lags = (samples / 10).clamp(2, 25);
        let from_outside = record
            .references
            .first()
            .filter(|_| in_loop)
            .unwrap_or(&record.inputs[0]);
        let all = [Some(from_outside), record.inputs.get(1)];
        let all = all.into_iter().flatten();
        let all: Vec<Vec<f64>> = all.flat_map(|command| signals(&command.values)).collect();
        let tests: Vec<(Vec<f64>, f64)> = all
            .par_iter()
            .map(
                |signal| match prewhitened_input_test(signal, residual, lags) {
                    // Too few pairs of samples: no test is possible.
                    Err(ct_signals::Error::TooFewSamples { .. }) => Ok((Vec::new(), 1.0)),
                    tested => tested,
                },
            )
            .collect::<Result<_, _>>()?;
        for (_, p) in tests {
            if p < least {
                (least, at) = (p, Some(k));
            }
            count += 1.0;
        }
    }
    Ok(((least * count).min(1.0), at))
}

/// A period of a residual, or otherwise an instant.
fn place_in_time(
    record: &Record,
    residual: &[f64],
    noise: &ArModel,
    level: f64,
) -> Result<Option<Remains>, Error> {
    if let Some(cycles) = period(residual, level)? {
        return Ok(Some(Remains::Period(record.duration() / cycles as f64)));
    }
    let found = instant(&standardised(noise, residual), level);
    Ok(found
        .map(|(from, to)| Remains::Instant(record.time[from], record.time[to] - record.time[from])))
}
