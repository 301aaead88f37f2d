//! One run of the stabilised output error method with one of the gains.

use ct_rls::{ContinuousRls, Euler, ExactHold, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use stabilized_oe::{BlockDiagonal, Full, Gain, Integrator, Known, StabilizedOe};

use super::super::Rule;
use super::signals::{Grid, Sample};
use super::{GainKind, Limits, TRUTH, Variant};
use crate::Error;

/// `a_1` (s) and `a_2` (s^2), to which `c^` has to converge.
const FILTER_TRUTH: [f64; 2] = [1.0, 1.0];
/// `a^_1, a^_2, b^_0` at the start.
const START: [f64; 3] = [2.0, 2.0, 0.5];
/// `c^_1, c^_2` at the start.
const FILTER_START: [f64; 2] = [1.0, 1.0];
/// Forgetting rate, 1/s.
const ETA: f64 = 0.01;

/// Called after every step with its number, theta^, and a function that computes `V`.
pub(super) trait Watch: FnMut(usize, &[f64; 3], &dyn Fn() -> f64) {}
impl<F: FnMut(usize, &[f64; 3], &dyn Fn() -> f64)> Watch for F {}

/// One run; false if it failed: an update was rejected, or P was no longer positive definite at the end.
pub(super) fn run(
    variant: Variant,
    samples: &[Sample],
    grid: Grid,
    watch: impl Watch,
) -> Result<bool, Error> {
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
        GainKind::BlockDiagonal => {
            let theta = ContinuousRls::with_integrator(theta, unit, weights)?;
            let c = ContinuousRls::with_integrator(c, SMatrix::identity(), weights)?;
            let gain: BlockDiagonal<2, 3, I> = BlockDiagonal::new(theta, c);
            follow(gain, variant.bounds, (samples, grid), apart, watch)
        }
        GainKind::Full => {
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
        GainKind::Constant => {
            let gain: BlockDiagonal<2, 3, I> =
                BlockDiagonal::constant((theta, unit), (c, SMatrix::identity()), 1.0)?;
            follow(gain, variant.bounds, (samples, grid), apart, watch)
        }
    }
}

/// `delta' P^-1 delta`; NaN where P is not positive definite, as Euler's rule can leave it.
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
