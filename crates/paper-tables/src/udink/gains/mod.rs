//! The three gains of the stabilized output error on one experiment of second order: block-diagonal (the paper's), full, and constant;
//! by Euler's rule and by the exact step; without bounds on `c^`, with wide ones and with sure ones.
//!
//! Plant: `a_2 y'' + a_1 y' + y = b_0 u` with all parameters 1, at rest at 0; `u = sum_i sin(w_i t + 0.7 i^2)`, w = 1.4, 2.2, 3.2 rad/s.
//! Start: `theta^ = (2, 2, 0.5)`, `c^ = (1, 1)`, `P = I`, eta = 0.01 1/s; the constant gain stays at `P(0)`. Derivatives of `y` are given.
//! Wide bounds: c_1 in 0.5 to 3 s, c_2 in 0.4 to 3 s^2; at their corner (0.5, 3) C^/A0 is not positive real. Sure ones: c_1 in 0.9 to 3 s,
//! c_2 in 0.7 to 2 s^2, inside which C^/A0 - 1/2 is strictly positive real for all plants within 10 % of this one. Both are checked.
//! Noise: white noise held over a step through `1/(s/5 + 1)^3`, 1 % of the power of `y`.

use std::sync::atomic::{AtomicUsize, Ordering};

use ct_lti::{Hold, StateVariableFilter};
use ct_rls::{ContinuousRls, Euler, ExactHold, RecursiveEstimator, Weights};
use ct_signals::noise;
use missing_effect::Progress;
use nalgebra::{SMatrix, SVector};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rayon::prelude::*;
use serde::Serialize;
use stabilized_oe::{BlockDiagonal, Full, Gain, Integrator, Known, KnownSample, StabilizedOe};

use super::gain_bounds::checked;
pub use super::gain_bounds::{Checked, Limits};
use super::udink::Rule;
use super::{median, quantile};
use crate::Error;

/// `a_1, a_2, b_0` of the plant.
pub const TRUTH: [f64; 3] = [1.0, 1.0, 1.0];
/// What `c^` is to become: `a_1, a_2`.
const FILTER_TRUTH: [f64; 2] = [1.0, 1.0];
const START: [f64; 3] = [2.0, 2.0, 0.5];
const FILTER_START: [f64; 2] = [1.0, 1.0];
const ETA: f64 = 0.01;
const FREQUENCIES: [f64; 3] = [1.4, 2.2, 3.2];

/// Poles of the noise's filter, rad/s, and its power over that of the output.
const NOISE_POLE: f64 = 5.0;
const NOISE_RATIO: f64 = 0.01;
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
/// Fine enough for what is drawn to be the solution.
const FINE: Grid = Grid {
    dt: 0.01,
    end: 2000.0,
};
/// Points of a curve that is drawn.
const DRAWN: usize = 400;

#[derive(Debug, Clone, Copy)]
struct Grid {
    dt: f64,
    end: f64,
}

impl Grid {
    fn steps(self) -> usize {
        (self.end / self.dt).round() as usize
    }
}

/// What multiplies the regressor and the filtered error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The paper's: nothing between theta^ and c^.
    BlockDiagonal,
    /// One matrix over both.
    Full,
    /// A matrix that stays.
    Constant,
}

impl Kind {
    /// All.
    pub const ALL: [Self; 3] = [Self::BlockDiagonal, Self::Full, Self::Constant];

    /// Its name in sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::BlockDiagonal => "block-diagonal",
            Self::Full => "full",
            Self::Constant => "constant",
        }
    }
}

/// One way to run the experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Variant {
    /// The gain.
    pub gain: Kind,
    /// The rule.
    pub rule: Rule,
    /// What c^ is kept to.
    pub bounds: Limits,
}

/// All of them, the paper's gain first.
pub fn variants() -> Vec<Variant> {
    let mut variants = Vec::new();
    for gain in Kind::ALL {
        for bounds in Limits::ALL {
            for rule in Rule::ALL {
                variants.push(Variant { gain, rule, bounds });
            }
        }
    }
    variants
}

/// What came of one of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The way.
    #[serde(flatten)]
    pub variant: Variant,
    /// Without noise: where theta^ = (a_1, a_2, b_0) ends; `null` where the run did not come to its end.
    pub quiet_end: Option<[f64; 3]>,
    /// With noise: largest error of theta^, mean over the last quarter; median of the noises.
    pub noisy_error: f64,
    /// 5 % of the noises lie below.
    pub noisy_q05: f64,
    /// 5 % of the noises lie above.
    pub noisy_q95: f64,
    /// Noises with which the run did not come to its end.
    pub noisy_failed: usize,
    /// Largest error over time with the first noise.
    #[serde(skip)]
    pub curve: Curve,
}

/// A line to draw.
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
    /// Noises.
    pub noises: usize,
    /// What the check says of the bounds on c^.
    pub checked: Vec<Checked>,
    /// One for each variant.
    pub rows: Vec<Row>,
    /// The counterexample to the paper's theorem.
    pub counterexample: Vec<Counterexample>,
}

/// theta^ over time without noise, by the exact step of 0.01 s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Counterexample {
    /// The gain.
    pub gain: Kind,
    /// `a_1, a_2, b_0` at 2000 s.
    pub end: [f64; 3],
    /// Time, s.
    #[serde(skip)]
    pub time: Vec<f64>,
    /// `a_1, a_2, b_0`
    #[serde(skip)]
    pub theta: [Vec<f64>; 3],
    /// `V = delta' P^-1 delta` over theta and c: the paper's proof needs it to fall.
    #[serde(skip)]
    pub lyapunov: Vec<f64>,
}

/// Runs all variants on the same data.
///
/// # Errors
/// None in fact: the settings are sound.
pub fn compare(seed: u64, progress: &(impl Fn(Progress) + Sync)) -> Result<Gains, Error> {
    let (variants, quiet) = (variants(), samples(QUIET, None)?);
    let noisy: Vec<Vec<Sample>> = (0..NOISES)
        .into_par_iter()
        .map(|run| samples(NOISY, Some((seed, run))))
        .collect::<Result<_, _>>()?;
    let total = variants.len() * (NOISES + 1);
    let done = AtomicUsize::new(0);
    let tell = || {
        progress(Progress {
            phase: "comparing the gains",
            done: done.fetch_add(1, Ordering::Relaxed) + 1,
            total,
        });
    };
    let rows = variants
        .into_par_iter()
        .map(|variant| {
            let mut end = None;
            let came = run(variant, &quiet, QUIET, |_, theta, _| end = Some(*theta))?;
            tell();
            let errors: Vec<(Option<f64>, Curve)> = noisy
                .par_iter()
                .map(|samples| {
                    let result = noisy_error(variant, samples);
                    tell();
                    result
                })
                .collect::<Result<_, _>>()?;
            let finished = || errors.iter().filter_map(|(error, _)| *error);
            Ok(Row {
                variant,
                quiet_end: end.filter(|_| came),
                noisy_error: median(finished()),
                noisy_q05: quantile(finished(), 0.05),
                noisy_q95: quantile(finished(), 0.95),
                noisy_failed: NOISES - finished().count(),
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

/// The example without noise where the paper's gain ends elsewhere, gain by gain.
///
/// # Errors
/// None in fact: the settings are sound.
pub fn counterexample() -> Result<Vec<Counterexample>, Error> {
    let samples = samples(FINE, None)?;
    Kind::ALL
        .into_par_iter()
        .map(|gain| {
            let variant = Variant {
                gain,
                rule: Rule::Exact,
                bounds: Limits::None,
            };
            let mut found = Counterexample {
                gain,
                end: [f64::NAN; 3],
                time: Vec::new(),
                theta: Default::default(),
                lyapunov: Vec::new(),
            };
            let every = samples.len() / DRAWN;
            run(variant, &samples, FINE, |k, theta, distance| {
                found.end = *theta;
                if k % every == 0 {
                    found.time.push(k as f64 * FINE.dt);
                    found.lyapunov.push(distance());
                    for (curve, value) in found.theta.iter_mut().zip(theta) {
                        curve.push(*value);
                    }
                }
            })?;
            Ok(found)
        })
        .collect()
}

/// Largest error, mean over the last quarter; nothing where the run did not come to its end.
fn noisy_error(variant: Variant, samples: &[Sample]) -> Result<(Option<f64>, Curve), Error> {
    let steps = samples.len();
    let (mut sum, mut count, mut curve) = (0.0, 0, Curve::default());
    let came = run(variant, samples, NOISY, |k, theta, _| {
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
    Ok((came.then_some(sum / f64::from(count)), curve))
}

/// Is shown every step: its number, theta^, and what computes `V`.
trait Watch: FnMut(usize, &[f64; 3], &dyn Fn() -> f64) {}
impl<F: FnMut(usize, &[f64; 3], &dyn Fn() -> f64)> Watch for F {}

/// One run; whether it came to its end.
fn run(variant: Variant, samples: &[Sample], grid: Grid, watch: impl Watch) -> Result<bool, Error> {
    match variant.rule {
        Rule::Euler => run_by::<Euler>(variant, samples, grid, watch),
        Rule::Exact => run_by::<ExactHold>(variant, samples, grid, watch),
    }
}

fn run_by<I: Integrator>(
    variant: Variant,
    samples: &[Sample],
    grid: Grid,
    watch: impl Watch,
) -> Result<bool, Error> {
    let (theta, c) = (SVector::from(START), SVector::from(FILTER_START));
    let weights = Weights::least_squares(ETA)?;
    let unit = SMatrix::identity();
    let apart = |gain: &BlockDiagonal<2, 3, I>| {
        distance(gain.theta_block(), TRUTH) + distance(gain.filter_block(), FILTER_TRUTH)
    };
    match variant.gain {
        Kind::BlockDiagonal => {
            let theta = ContinuousRls::with_integrator(theta, unit, weights)?;
            let c = ContinuousRls::with_integrator(c, SMatrix::identity(), weights)?;
            let gain: BlockDiagonal<2, 3, I> = BlockDiagonal::new(theta, c);
            follow(gain, variant.bounds, (samples, grid), apart, watch)
        }
        Kind::Full => {
            let [a1, a2, b0] = START;
            let [c1, c2] = FILTER_START;
            let both = SVector::from([a1, a2, b0, c1, c2]);
            let rls = ContinuousRls::with_integrator(both, SMatrix::identity(), weights)?;
            let gain: Full<2, 3, 5, I> = Full::new(rls);
            let ([a1, a2, b0], [c1, c2]) = (TRUTH, FILTER_TRUTH);
            let truth = [a1, a2, b0, c1, c2];
            let together = |gain: &Full<2, 3, 5, I>| distance(gain.rls(), truth);
            follow(gain, variant.bounds, (samples, grid), together, watch)
        }
        Kind::Constant => {
            let gain: BlockDiagonal<2, 3, I> =
                BlockDiagonal::constant((theta, unit), (c, SMatrix::identity()), 1.0)?;
            follow(gain, variant.bounds, (samples, grid), apart, watch)
        }
    }
}

/// `delta' P^-1 delta`; NaN where Euler's rule has lost P.
fn distance<const P: usize, I: Integrator>(rls: &ContinuousRls<P, I>, truth: [f64; P]) -> f64 {
    let delta = rls.theta() - SVector::from(truth);
    rls.covariance()
        .cholesky()
        .map_or(f64::NAN, |p| delta.dot(&p.solve(&delta)))
}

fn follow<G: Gain<2, 3>>(
    gain: G,
    limits: Limits,
    (samples, grid): (&[Sample], Grid),
    distance: impl Fn(&G) -> f64,
    mut watch: impl Watch,
) -> Result<bool, Error> {
    let mut estimator = StabilizedOe::new(gain, Known::<2, 1>::new(true))?;
    if let Some(bounds) = limits.bounds()? {
        estimator = estimator.with_filter_bounds(bounds)?;
    }
    for (k, sample) in samples.iter().enumerate() {
        if !estimator.update(sample, grid.dt).outcome.used() {
            return Ok(false);
        }
        let [theta] = &estimator.theta().data.0;
        watch(k, theta, &|| distance(estimator.gain()));
    }
    Ok(estimator.health().is_ok())
}

type Sample = KnownSample<2, 1>;

/// The record, without noise or with that of a seed and its stream.
fn samples(grid: Grid, noise_of: Option<(u64, usize)>) -> Result<Vec<Sample>, Error> {
    let mut samples: Vec<Sample> = (0..grid.steps())
        .map(|k| {
            let (u, [y, slope, curvature]) = plant(k as f64 * grid.dt);
            Sample {
                u: [u],
                y,
                derivatives: [slope, curvature],
            }
        })
        .collect();
    let Some((seed, run)) = noise_of else {
        return Ok(samples);
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(run as u64);
    let mut filter = StateVariableFilter::with_bandwidth(3, NOISE_POLE, Hold::Zero)?;
    let mut disturbance = Vec::with_capacity(samples.len());
    for white in noise::white(samples.len(), 1.0, &mut rng) {
        let derivatives = filter.update(white, grid.dt)?;
        disturbance.push([derivatives[0], derivatives[1], derivatives[2]]);
    }
    let of_noise: f64 = disturbance.iter().map(|v| v[0] * v[0]).sum();
    let of_output: f64 = samples.iter().map(|sample| sample.y * sample.y).sum();
    let level = (NOISE_RATIO * of_output / of_noise).sqrt();
    for (sample, [v, slope, curvature]) in samples.iter_mut().zip(disturbance) {
        sample.y += level * v;
        sample.derivatives[0] += level * slope;
        sample.derivatives[1] += level * curvature;
    }
    Ok(samples)
}

/// `u` and `y, y', y''` at `t`, in closed form: each sine's stationary response, and what dies out.
fn plant(t: f64) -> (f64, [f64; 3]) {
    let (decay, w0) = (0.5_f64, 0.75_f64.sqrt());
    let (mut u, mut y, mut slope) = (0.0, 0.0, 0.0);
    let (mut y_at_0, mut slope_at_0) = (0.0, 0.0);
    for (i, w) in FREQUENCIES.iter().enumerate() {
        let phase = 0.7 * (i * i) as f64;
        let (re, im) = (1.0 - w * w, *w);
        let size = re.hypot(im);
        let shift = phase - im.atan2(re);
        u += (w * t + phase).sin();
        y += (w * t + shift).sin() / size;
        slope += w * (w * t + shift).cos() / size;
        y_at_0 += shift.sin() / size;
        slope_at_0 += w * shift.cos() / size;
    }
    // e^{-t/2} (p cos(w0 t) + q sin(w0 t))
    let (p, q) = (-y_at_0, -(slope_at_0 + decay * y_at_0) / w0);
    let ((sin, cos), fade) = ((w0 * t).sin_cos(), (-decay * t).exp());
    y += fade * (p * cos + q * sin);
    slope += fade * ((q * w0 - decay * p) * cos - (p * w0 + decay * q) * sin);
    (u, [y, slope, u - y - slope])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plant_is_its_equation() {
        let h = 1e-4;
        for t in [0.0, 0.3, 2.0, 17.0] {
            let (_, [before, slope_before, _]) = plant(t - h);
            let (_, [after, slope_after, _]) = plant(t + h);
            let (_, [_, slope, curvature]) = plant(t);
            assert!(((after - before) / (2.0 * h) - slope).abs() < 1e-7);
            assert!(((slope_after - slope_before) / (2.0 * h) - curvature).abs() < 1e-7);
        }
        let (_, [y, slope, _]) = plant(0.0);
        assert!(y.abs() < 1e-15 && slope.abs() < 1e-15);
    }

    #[test]
    fn the_papers_gain_ends_elsewhere_and_the_others_do_not() {
        let found = counterexample().unwrap();
        let [block, full, constant] = [0, 1, 2].map(|k| found[k].end);
        let distance = |a: [f64; 3], b: [f64; 3]| {
            let errors = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            errors.fold(0.0, f64::max)
        };
        // the end that an independent integrator of the same equations gives
        assert!(distance(block, [2.67, 2.41, 2.62]) < 0.03, "{block:?}");
        assert!(distance(full, TRUTH) < 1e-3, "{full:?}");
        assert!(distance(constant, TRUTH) < 1e-3, "{constant:?}");
    }
}
