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

use ct_signals::{ArModel, residual_tests::prewhitened_input_test};
use effect_search::residual_tests::white::{instant, level_p, of_command, period, standardised};
use greybox::{Fit, Noise};
use rayon::prelude::*;

use crate::{
    Error, NotNoise,
    base::control_loop::slowest_time_constant,
    fit::{node::Node, noise_model::slowness_of},
};

/// Significance level of each residual test, corrected for the number of its comparisons.
const NOT_NOISE: f64 = 1e-4;

impl NotNoise {
    /// The noise level above which there is something to explain. A drift is noise too, and effects are confirmed with it as weighting;
    /// other unexplained structure is absorbed by the noise model, but hardly enters its innovations. By output.
    pub(crate) fn above(&self, noise: &Noise) -> Vec<f64> {
        let size = |noise: &ArModel| match self {
            Self::Slow { .. } => noise.stationary_std(),
            _ => noise.sigma(),
        };
        noise.iter().map(size).collect()
    }
}

/// Structure in the residual of a model that is not noise; `own` is the model's fit with the noise model of its own residual.
pub(crate) fn not_noise(node: &Node, own: &Fit) -> Result<Option<NotNoise>, Error> {
    let records = node.setup.records;
    let outputs = node.setup.outputs();
    let output = |i: usize| records[0].outputs[i % outputs].name.clone();
    let record = |i: usize| records[i / outputs].name.clone();
    let (p, series) = least_p(node, None, of_command)?;
    if let Some(i) = series.filter(|_| p < NOT_NOISE) {
        return Ok(Some(NotNoise::Input {
            output: output(i),
            record: record(i),
        }));
    }
    let residuals = node.setup.disturbance(&own.x)?;
    let level = NOT_NOISE / residuals.len() as f64;
    for (i, residual) in residuals.iter().enumerate() {
        let time = &records[i / outputs].time;
        if let Some(cycles) = period(residual, level)? {
            return Ok(Some(NotNoise::Period {
                output: output(i),
                record: record(i),
                period: records[i / outputs].duration() / cycles as f64,
            }));
        }
        let white = standardised(own.noise.of_series(i), residual);
        if let Some((from, to)) = instant(&white, level) {
            return Ok(Some(NotNoise::Instant {
                output: output(i),
                record: record(i),
                from: time[from],
                to: time[to],
            }));
        }
    }
    let models = match node.setup.simulate_loop(&own.x)? {
        Some(run) => run.output,
        None => node.setup.simulate(&own.x)?.output,
    };
    for (i, (model, residual)) in models.iter().zip(&residuals).enumerate() {
        if level_p(model, &standardised(own.noise.of_series(i), residual)) < level {
            return Ok(Some(NotNoise::Level {
                output: output(i),
                record: record(i),
            }));
        }
    }
    if own.noise.order() == 0 {
        return Ok(None);
    }
    let interval = node.setup.structure.scales.sample_interval;
    let times = own.noise.iter().enumerate();
    let times = times.map(|(o, noise)| (0.5 * interval * slowness_of(noise), o));
    let slowest = times.max_by(|a, b| a.0.total_cmp(&b.0));
    let time_constant = slowest_time_constant(node)?;
    Ok(slowest
        .filter(|(time, _)| *time > time_constant)
        .map(|(correlation_time, o)| NotNoise::Slow {
            output: output(o),
            correlation_time,
            time_constant,
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
