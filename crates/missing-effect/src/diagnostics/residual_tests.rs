//! Tests whether the residual of a model is stationary AR noise that is independent of the input.
//!
//! An autoregressive model fits any series, even a random walk, so a white innovation alone proves nothing. Noise is independent of the
//! command, does not change over the record, has no period, and has a shorter correlation time than the process. Each test uses the
//! residual `w`, whitened by the noise model that was fitted to this residual:
//! - **command**: the past of the command, of its square and of the size of its changes against `w` (Haugh's test; the square and the
//!   changes show what is even in the command or depends on its direction). A white series is independent of the past of any signal, the
//!   output of a controller included.
//! - **period**: a spectral line above its neighbours (`spectral_line.rs`).
//! - **instant**: windows of 1, 2, 4, ... samples of `w`; a sum over the root of the window's length is standard normal.
//! - **level**: `w` against functions of the model's output one sample before. A term that is missing from a balance leaves a residual that
//!   depends on the level, however slow it is. As `w` is white and independent of the past, its regression on any past signal is
//!   chi-square.
//! - **drift**: the integral of the noise's autocorrelation over positive lags exceeds the slowest time constant of the process. Such noise
//!   can imitate any missing effect, so it is no explanation.
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
pub(crate) enum Pattern {
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
pub(crate) struct NotNoise {
    pub what: Pattern,
    pub record: Option<usize>,
    pub output: usize,
}

impl NotNoise {
    /// The noise level above which there is something to explain. A drift is noise too, and effects are confirmed with it as weighting;
    /// other unexplained structure is absorbed by the noise model, but hardly enters its innovations. By output.
    pub(crate) fn above(&self, noise: &Noise) -> Vec<f64> {
        let size = |noise: &ArModel| match self.what {
            Pattern::Slow(..) => noise.stationary_std(),
            _ => noise.sigma(),
        };
        noise.iter().map(size).collect()
    }
}

/// Structure in the residual of a model that is not noise; `own` is the model's fit with the noise model of its own residual.
pub(crate) fn not_noise(node: &Node, own: &Fit) -> Result<Option<NotNoise>, Error> {
    let outputs = node.setup.outputs();
    let (p, series) = least_p(node, None, of_command)?;
    if p < NOT_NOISE {
        return Ok(Some(NotNoise {
            what: Pattern::Input,
            record: series.map(|i| i / outputs),
            output: series.map_or(0, |i| i % outputs),
        }));
    }
    let residuals = node.setup.disturbance(&own.x)?;
    let records = node.setup.records;
    let level = NOT_NOISE / residuals.len() as f64;
    let left = |what: Pattern, i: usize| NotNoise {
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
            return Ok(Some(left(Pattern::Level, i)));
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
        .map(|(wander, output)| NotNoise {
            what: Pattern::Slow(wander, process),
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
) -> Result<Option<Pattern>, Error> {
    if let Some(cycles) = period(residual, level)? {
        return Ok(Some(Pattern::Period(record.duration() / cycles as f64)));
    }
    let found = instant(&standardised(noise, residual), level);
    Ok(found
        .map(|(from, to)| Pattern::Instant(record.time[from], record.time[to] - record.time[from])))
}
