//! Three gains of the stabilized output error on one experiment of second order: block-diagonal (the paper's), full, and constant; by
//! Euler's rule and by the exact step; without bounds on `c^`, with wide ones and with sure ones.
//!
//! Plant: `a_2 y'' + a_1 y' + y = b_0 u` with all parameters 1, at rest at 0; u is a sum of three sines (`signals.rs`).
//! Start: `theta^ = (2, 2, 0.5)`, `c^ = (1, 1)`, `P = I`, eta = 0.01 1/s; the constant gain stays at `P(0)`. Derivatives of `y` are given.
//! Bounds: [`Limits`]; whether `C^/A0 - 1/2` is strictly positive real inside them for all plants within 10 % of this one is checked.

mod counterexample;
mod filter_bounds;
mod run;
mod signals;

use rayon::prelude::*;
use serde::Serialize;

pub use counterexample::{Counterexample, counterexample};
pub use filter_bounds::{Checked, Limits};

use self::filter_bounds::checked;
use self::run::run;
use self::signals::{Grid, Sample, samples};
use super::{Rule, median, quantile};
use crate::progress::Counter;
use crate::{Error, Progress, Stage};

/// `a_1` (s), `a_2` (s^2), `b_0` of the plant.
pub const TRUTH: [f64; 3] = [1.0, 1.0, 1.0];

/// Number of noises.
const NOISES: usize = 20;

/// Step and end of the runs without noise, s.
const QUIET: Grid = Grid {
    dt: 0.05,
    end: 2000.0,
};
/// Step and end of the runs with noise, s.
const NOISY: Grid = Grid {
    dt: 0.1,
    end: 1000.0,
};
/// Points of a curve over time, about.
const DRAWN: usize = 400;

/// Gain of the regressor and the filtered error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum GainKind {
    /// The paper's (4.11): one matrix for theta^, another for c^.
    BlockDiagonal,
    /// One matrix for theta^ and c^ (4.9b).
    Full,
    /// A constant matrix.
    Constant,
}

impl GainKind {
    /// All.
    pub const ALL: [Self; 3] = [Self::BlockDiagonal, Self::Full, Self::Constant];

    /// Its name in tables and sentences.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BlockDiagonal => "block-diagonal",
            Self::Full => "full",
            Self::Constant => "constant",
        }
    }
}

/// A variant of the experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Variant {
    /// The gain.
    pub gain: GainKind,
    /// The rule.
    pub rule: Rule,
    /// The bounds on c^.
    pub bounds: Limits,
}

/// All variants, the paper's gain first.
#[must_use]
pub fn variants() -> Vec<Variant> {
    let mut variants = Vec::new();
    for gain in GainKind::ALL {
        for bounds in Limits::ALL {
            for rule in Rule::ALL {
                variants.push(Variant { gain, rule, bounds });
            }
        }
    }
    variants
}

/// The result of one variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The variant.
    #[serde(flatten)]
    pub variant: Variant,
    /// Without noise: theta^ = (a_1 (s), a_2 (s^2), b_0) at 2000 s; `null` if the run failed.
    pub quiet_end: Option<[f64; 3]>,
    /// With noise: largest error of theta^, mean over the last quarter of 1000 s; median of the noises, NaN (`null`) if all runs failed.
    pub noisy_error: f64,
    /// 5 % of the noises lie below.
    pub noisy_q05: f64,
    /// 5 % of the noises lie above.
    pub noisy_q95: f64,
    /// Noises with which the run failed.
    pub noisy_failed: usize,
    /// Largest error of theta^ over time with the first noise.
    #[serde(skip)]
    pub curve: Curve,
}

/// Values over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Time, s.
    pub time: Vec<f64>,
    /// Values.
    pub values: Vec<f64>,
}

/// The whole comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gains {
    /// How many noises there are.
    pub noises: usize,
    /// Result of the check of the wide and the sure bounds on c^.
    pub checked: Vec<Checked>,
    /// One row for each variant.
    pub rows: Vec<Row>,
    /// The counterexample to the paper's theorem.
    pub counterexample: Vec<Counterexample>,
}

/// Runs all variants on the same records; `seed`: seed of the noises.
///
/// # Errors
/// None in practice: all settings are fixed and sound.
pub fn compare(seed: u64, progress: &(dyn Fn(Progress) + Sync)) -> Result<Gains, Error> {
    let (variants, quiet) = (variants(), samples(QUIET, None)?);
    let noisy: Vec<Vec<Sample>> = (0..NOISES)
        .into_par_iter()
        .map(|run| samples(NOISY, Some((seed, run))))
        .collect::<Result<_, _>>()?;
    let total = variants.len() * (NOISES + 1);
    let counter = Counter::new(total, Stage::UdinkGains, progress);
    let rows = variants
        .into_par_iter()
        .map(|variant| {
            let mut end = None;
            let finished = run(variant, &quiet, QUIET, |_, theta, _| end = Some(*theta))?;
            counter.one_more();
            let errors: Vec<(Option<f64>, Curve)> = noisy
                .par_iter()
                .map(|samples| {
                    let result = noisy_error(variant, samples);
                    counter.one_more();
                    result
                })
                .collect::<Result<_, _>>()?;
            let errors_of_finished = || errors.iter().filter_map(|(error, _)| *error);
            Ok(Row {
                variant,
                quiet_end: end.filter(|_| finished),
                noisy_error: median(errors_of_finished()),
                noisy_q05: quantile(errors_of_finished(), 0.05),
                noisy_q95: quantile(errors_of_finished(), 0.95),
                noisy_failed: NOISES - errors_of_finished().count(),
                curve: errors
                    .into_iter()
                    .next()
                    .map_or_else(Curve::default, |(_, curve)| curve),
            })
        })
        .collect::<Result<_, Error>>()?;
    Ok(Gains {
        noises: NOISES,
        checked: checked()?,
        rows,
        counterexample: counterexample()?,
    })
}

/// Largest error, mean over the last quarter; `None` where the run failed. And the error over time.
fn noisy_error(variant: Variant, samples: &[Sample]) -> Result<(Option<f64>, Curve), Error> {
    let steps = samples.len();
    let (mut sum, mut count, mut curve) = (0.0, 0, Curve::default());
    let finished = run(variant, samples, NOISY, |k, theta, _| {
        let errors = theta.iter().zip(TRUTH).map(|(a, b)| (a - b).abs());
        let error = errors.fold(0.0, f64::max);
        if 4 * k >= 3 * steps {
            sum += error;
            count += 1;
        }
        if k % (steps / DRAWN) == 0 {
            curve.time.push(k as f64 * NOISY.dt);
            curve.values.push(error);
        }
    })?;
    Ok((finished.then_some(sum / f64::from(count)), curve))
}
