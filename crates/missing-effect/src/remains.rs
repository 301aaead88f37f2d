//! Whether what a model leaves is noise: what an autoregressive noise cannot be.
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
//!   residual that wanders with the level, and is no noise however slow it is. As `w` is white and independent of the past, its
//!   regression on any past is chi-square, whatever the colour of the regressors.
//! - **slowness**: the integral of the noise's autocorrelation over positive lags is longer than the slowest time constant
//!   of the process. Such a noise can stand for anything that the process lacks, so it is no answer.
//!
//! **References**: L. D. Haugh, J. American Statistical Association 71 (1976) 378-385; S. A. Billings, W. S. F. Voon,
//! Correlation based model validity tests for non-linear models, Int. J. Control 44 (1986) 235-244.

use std::f64::consts::SQRT_2;

use ct_signals::{ArModel, Record, residual_tests::prewhitened_input_test};
use greybox::{Fit, Noise};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::{
    distribution::{ChiSquared, ContinuousCDF},
    function::erf::erfc,
};

use crate::{
    Error, control_loop::slowest_time_constant, node::Node, noise_floor::slowness_of,
    spectral_line::strongest_line,
};

/// Below this p-value a residual is not noise, in each of the tests, corrected for all that it looked at.
const NOT_NOISE: f64 = 1e-4;
/// Longest window that is looked at, as a part of the record.
const LONGEST_WINDOW: usize = 4;

/// Knots of the functions of the level, evenly over the range that the model visits.
const KNOTS: usize = 11;
/// A function counts where its squares sum to so many samples: fewer are as Gaussian as the noise is, and no more.
const VISITED: f64 = 5.0;

/// What a residual shows that noise does not; the first that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Remains {
    /// The command.
    Input,
    /// A period \[s\].
    Period(f64),
    /// Something from an instant on, for a while \[s\].
    Instant(f64, f64),
    /// The level.
    Level,
    /// A wander: its correlation time and the process's slowest time constant \[s\].
    Slow(f64, f64),
}

/// What a residual shows that noise does not, in which of the fitted records, where it is one of them, and at which output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Left {
    pub what: Remains,
    pub record: Option<usize>,
    pub output: usize,
}

impl Left {
    /// The size of the noise above which there is something to explain. A wander is a noise too, in whose metric effects
    /// are confirmed as in any other; what else remains is in the noise model by mistake, but hardly in what it cannot
    /// predict. By output.
    pub(crate) fn above(&self, noise: &Noise) -> Vec<f64> {
        let size = |noise: &ArModel| match self.what {
            Remains::Slow(..) => noise.stationary_std(),
            _ => noise.sigma(),
        };
        noise.iter().map(size).collect()
    }
}

/// What the residual of a model holds that is not noise; `own` is its fit with the colour of its own residual.
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
        let found = match period(record, residual, level)? {
            None => {
                let white = standardised(own.noise.of_series(i), residual);
                instant(record, &white, level)
            }
            found => found,
        };
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

/// p-value of the test that the command itself does not show in a node's residual at an output; of several records the smallest,
/// corrected for having taken it.
pub(crate) fn input_p(node: &Node, output: usize) -> Result<f64, Error> {
    Ok(least_p(node, Some(output), |u| vec![u.to_vec()])?.0)
}

/// The same for all signals that are made of a record's commands, and the series that shows it most.
fn least_p(
    node: &Node,
    output: Option<usize>,
    signals: impl Fn(&[f64]) -> Vec<Vec<f64>>,
) -> Result<(f64, Option<usize>), Error> {
    let residuals = node.setup.disturbance(&node.fit.x)?;
    // In a loop the command holds the noise that came back; what moves it from outside is the reference.
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
                    // Too few pairs of samples are there: it says nothing.
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

/// The command, its square about the mean, and the size of its moves.
fn of_command(u: &[f64]) -> Vec<Vec<f64>> {
    let mean = u.iter().sum::<f64>() / u.len() as f64;
    let square = u.iter().map(|u| (u - mean).powi(2)).collect();
    let mut moves = vec![0.0];
    moves.extend(u.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    vec![u.to_vec(), square, moves]
}

/// The whitened residual, of unit variance; zero where the sample is missing, so that sums and products leave it out.
fn standardised(noise: &ArModel, residual: &[f64]) -> Vec<f64> {
    let mut white = noise.whiten(residual);
    let present = || white.iter().filter(|w| !w.is_nan());
    let count = present().count().max(1);
    let rms = (present().map(|w| w * w).sum::<f64>() / count as f64).sqrt();
    for w in &mut white {
        *w = if w.is_nan() {
            0.0
        } else {
            *w / rms.max(f64::MIN_POSITIVE)
        };
    }
    white
}

/// p-value of the test that a whitened residual is independent of what the model read a sample before.
fn level_p(model: &[f64], white: &[f64]) -> f64 {
    let (low, high) = model
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &y| {
            (low.min(y), high.max(y))
        });
    let width = (high - low) / (KNOTS - 1) as f64;
    if !(width.is_finite() && width > 0.0) {
        return 1.0;
    }
    // Hats, which sum to one: at a sample two neighbours are not zero.
    let mut gram = DMatrix::<f64>::zeros(KNOTS, KNOTS);
    let mut moment = DVector::<f64>::zeros(KNOTS);
    // Zero where the sample is missing.
    for (y, w) in model.iter().zip(&white[1..]).filter(|(_, w)| **w != 0.0) {
        let at = (y - low) / width;
        let left = (at as usize).min(KNOTS - 2);
        let hats = [(left, left as f64 + 1.0 - at), (left + 1, at - left as f64)];
        for (i, a) in hats {
            moment[i] += a * w;
            for (j, b) in hats {
                gram[(i, j)] += a * b;
            }
        }
    }
    let visited: Vec<usize> = (0..KNOTS).filter(|&i| gram[(i, i)] > VISITED).collect();
    let gram = gram.select_rows(&visited).select_columns(&visited);
    let moment = moment.select_rows(&visited);
    let explained = gram
        .cholesky()
        .map_or(0.0, |factor| moment.dot(&factor.solve(&moment)));
    ChiSquared::new(visited.len() as f64).map_or(1.0, |chi| chi.sf(explained.max(0.0)))
}

fn instant(record: &Record, white: &[f64], level: f64) -> Option<Remains> {
    let n = white.len();
    let lengths =
        || std::iter::successors(Some(1), |l| Some(2 * l)).take_while(|l| LONGEST_WINDOW * l <= n);
    let windows: usize = lengths().map(|length| n - length + 1).sum();
    let mut running = vec![0.0];
    running.extend(white.iter().scan(0.0, |sum, w| {
        *sum += w;
        Some(*sum)
    }));
    let (size, from, length) = lengths()
        .flat_map(|length| (0..=n - length).map(move |from| (from, length)))
        .map(|(from, length)| {
            let sum: f64 = running[from + length] - running[from];
            (sum.abs() / (length as f64).sqrt(), from, length)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    let chance = windows as f64 * erfc(size / SQRT_2);
    (chance < level).then(|| {
        let to = (from + length).min(n - 1);
        Remains::Instant(record.time[from], record.time[to] - record.time[from])
    })
}

fn period(record: &Record, residual: &[f64], level: f64) -> Result<Option<Remains>, Error> {
    Ok(strongest_line(residual)?
        .filter(|line| line.chance < level)
        .map(|line| Remains::Period(record.duration() / line.cycles as f64)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]
    use std::f64::consts::PI;

    use ct_signals::ArModel;

    use super::*;
    use ct_signals::{Channel, noise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const SAMPLES: usize = 800;

    fn record() -> Record {
        Record {
            name: "r".to_string(),
            time: (0..SAMPLES).map(|k| 2.0 * k as f64).collect(),
            inputs: vec![Channel::new("u", "V", vec![0.0; SAMPLES])],
            outputs: vec![Channel::new("y", "cm", vec![0.0; SAMPLES])],
            references: Vec::new(),
            calendar: None,
        }
    }

    #[test]
    fn noise_of_any_colour_has_no_period_and_no_instant() {
        let record = record();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        // At a level of one in a hundred, 600 series: chance exceeds 15 of them once in a thousand.
        let (mut periods, mut instants, mut levels) = (0, 0, 0);
        // A level that wanders, and one that steps and stays.
        let wander = noise::ar1(SAMPLES, 3.0, 0.99, &mut rng);
        let steps: Vec<f64> = (0..SAMPLES).map(|k| wander[k / 50 * 50]).collect();
        for run in 0..600 {
            let colour = [0.0, 0.8, 0.95][run % 3];
            let e = noise::ar1(SAMPLES, 0.1, colour, &mut rng);
            let model = ArModel::from_coefficients(&[colour], 1.0).unwrap();
            periods += usize::from(period(&record, &e, 0.01).unwrap().is_some());
            let white = standardised(&model, &e);
            instants += usize::from(instant(&record, &white, 0.01).is_some());
            levels += usize::from(level_p([&wander, &steps][run % 2], &white) < 0.01);
        }
        assert!(periods <= 15 && instants <= 15, "{periods}, {instants}");
        assert!((1..=15).contains(&levels), "{levels}");
    }

    #[test]
    fn a_period_is_found_with_its_length_in_noise_of_its_own_size() {
        let record = record();
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for wanted in [5.0, 21.3, 160.0, 400.0] {
            let e: Vec<f64> = noise::white(SAMPLES, 0.1, &mut rng)
                .into_iter()
                .zip(&record.time)
                .map(|(e, t)| e + 0.14 * (2.0 * PI * t / wanted).sin())
                .collect();
            let Some(Remains::Period(found)) = period(&record, &e, NOT_NOISE).unwrap() else {
                panic!("no period of {wanted} s");
            };
            // To the width of a line.
            assert!((1.0 / found - 1.0 / wanted).abs() < 1.0 / record.duration());
        }
    }

    #[test]
    fn a_function_of_the_level_is_found_under_noise_of_its_own_size() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let level = noise::ar1(SAMPLES, 3.0, 0.99, &mut rng);
        let mut white = noise::white(SAMPLES, 1.0, &mut rng);
        assert!(level_p(&level, &white) > 0.01);
        for k in 1..SAMPLES {
            white[k] += 0.5 * (2.0 * level[k - 1]).sin();
        }
        assert!(level_p(&level, &white) < NOT_NOISE);
        assert!(level_p(&[2.0; SAMPLES], &white) == 1.0);
    }

    #[test]
    fn an_instant_is_found_where_it_is() {
        let record = record();
        let mut white = noise::white(SAMPLES, 1.0, &mut ChaCha8Rng::seed_from_u64(3));
        white[300] += 8.0;
        assert_eq!(
            instant(&record, &white, NOT_NOISE),
            Some(Remains::Instant(600.0, 2.0))
        );
        white[300] -= 8.0;
        for value in &mut white[500..520] {
            *value += 2.0;
        }
        let Some(Remains::Instant(from, length)) = instant(&record, &white, NOT_NOISE) else {
            panic!("nothing was found");
        };
        assert!((from - 1000.0).abs() < 20.0 && (length - 40.0).abs() < 30.0);
    }
}
