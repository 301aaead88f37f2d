//! "Larger values lead to numerical difficulties" (the paper, of P(0)): how many runs fail, for Euler's rule and for the exact step.
//!
//! `cargo run --release -p stabilized-oe --example larger_p0`
#![allow(missing_docs)]

use ct_rls::{ContinuousRls, Euler, ExactHold, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use stabilized_oe::{
    BlockDiagonal, Error, Integrator, IoSample, LateDifference, StabilizedOe, UNGUARDED,
};

const SEEDS: u64 = 50;
const SCALES: [f64; 12] = [
    1.0, 10.0, 15.0, 18.0, 20.0, 30.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e8,
];
const DT: f64 = 0.3125;
const TAU: f64 = 10.0;
/// Standard deviation of the noise: a tenth of the output's power.
const NOISE: f64 = 0.2077;

/// Table 1 with `P(0)` times `scale`: whether it went to its end with numbers that are some, and the largest late error of theta.
fn run<I: Integrator>(scale: f64, seed: u64) -> Result<Option<f64>, Error> {
    let weights = Weights::least_squares(0.01)?;
    let p1 = SMatrix::from_diagonal(&SVector::from([0.1, 0.001])) * scale;
    let p2 = SMatrix::from([[0.1]]) * scale;
    let theta = ContinuousRls::with_integrator(SVector::from([0.95, 0.0]), p1, weights)?;
    let filter = ContinuousRls::with_integrator(SVector::from([0.0]), p2, weights)?;
    let gain = BlockDiagonal::<1, 2, I>::new(
        theta.with_guards(UNGUARDED)?,
        filter.with_guards(UNGUARDED)?,
    );
    let mut estimator = StabilizedOe::new(gain, LateDifference::<5>::new())?
        .with_filter_bounds(ct_constrained::Bounds::new([-20.0], [20.0])?)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut y0, mut late) = (0.5, 0.0_f64);
    let steps = (1000.0 / DT) as usize;
    for k in 0..steps {
        let u = if (k as f64 * DT / 31.5).floor() % 2.0 == 0.0 {
            1.0
        } else {
            -1.0
        };
        let noise: f64 = StandardNormal.sample(&mut rng);
        let sample = IoSample {
            u,
            y: y0 + NOISE * noise,
        };
        if !estimator.update(&sample, DT).outcome.used() || estimator.health().is_err() {
            return Ok(None);
        }
        y0 += (1.0 - (-DT / TAU).exp()) * (u - y0);
        if k > steps / 2 {
            let [tau, gain] = [estimator.theta()[0], estimator.theta()[1]];
            late = late.max(((tau - TAU) / TAU).abs()).max((gain - 1.0).abs());
        }
    }
    Ok(Some(late))
}

/// Runs that failed, and the median of the largest late error over the others.
fn over_seeds<I: Integrator>(scale: f64) -> Result<(usize, f64), Error> {
    let mut late = Vec::new();
    for seed in 0..SEEDS {
        late.extend(run::<I>(scale, seed)?);
    }
    late.sort_by(f64::total_cmp);
    let median = late.get(late.len() / 2).copied().unwrap_or(f64::NAN);
    Ok((SEEDS as usize - late.len(), median))
}

fn main() -> Result<(), Error> {
    println!(
        "| P(0) times | Euler's rule fails | median error | exact step fails | median error |"
    );
    println!("|---|---|---|---|---|");
    for scale in SCALES {
        let (euler, euler_error) = over_seeds::<Euler>(scale)?;
        let (exact, exact_error) = over_seeds::<ExactHold>(scale)?;
        println!(
            "| {scale:e} | {euler} of {SEEDS} | {euler_error:.2} | {exact} of {SEEDS} | {exact_error:.2} |"
        );
    }
    Ok(())
}
