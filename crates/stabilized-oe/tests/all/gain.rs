//! Parts of the gains: their state, and their bounds.

use ct_constrained::{Bounds, Keep};
use ct_rls::{ContinuousRls, Euler, ExactHold, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};
use stabilized_oe::{BlockDiagonal, Full, Gain};

#[test]
fn the_full_gain_shows_the_blocks_of_its_matrix() {
    // no two entries are the same
    let p = SMatrix::<f64, 5, 5>::from_fn(|i, j| {
        let (low, high) = (i.min(j), i.max(j));
        if low == high {
            10.0 + low as f64
        } else {
            0.1 * (1 + low + 5 * high) as f64
        }
    });
    let weights = Weights::least_squares(0.0).unwrap();
    let start = SVector::from([2.0, 1.0, 0.5, 3.0, 4.0]);
    let gain = Full::<2, 3, 5>::new(ContinuousRls::new(start, p, weights).unwrap());
    let (theta, filter) = (gain.covariance(), gain.filter_covariance());
    assert!((theta - p.fixed_view::<3, 3>(0, 0)).amax() < 1e-12);
    assert!((filter - p.fixed_view::<2, 2>(3, 3)).amax() < 1e-12);
    assert_eq!(gain.theta(), SVector::from([2.0, 1.0, 0.5]));
    assert_eq!(gain.filter(), SVector::from([3.0, 4.0]));
}

#[test]
fn a_gain_asks_for_half_the_ratio_of_its_weights() {
    let weights = |gamma| Weights::new(2.0, gamma, 0.0).unwrap();
    fn block<const K: usize>(weights: Weights) -> ContinuousRls<K> {
        ContinuousRls::new(SVector::repeat(1.0), SMatrix::identity(), weights).unwrap()
    }
    let full = Full::<1, 2, 3>::new(block(weights(1.0)));
    assert_eq!(full.positive_above(), 0.25);
    // of the model's parameters
    let blocks = BlockDiagonal::<1, 2>::new(block(weights(3.0)), block(weights(1.0)));
    assert_eq!(blocks.positive_above(), 0.75);
}

#[test]
fn a_run_of_c_that_has_stopped_is_told() {
    let weights = Weights::least_squares(0.0).unwrap();
    let theta =
        ContinuousRls::with_integrator(SVector::from([2.0, 1.0]), SMatrix::identity(), weights);
    let filter = ContinuousRls::with_integrator(SVector::from([2.0]), SMatrix::identity(), weights);
    let mut gain = BlockDiagonal::<1, 2, Euler>::new(theta.unwrap(), filter.unwrap());
    assert!(gain.health().is_ok());
    // too long a step for Euler's rule
    gain.blocks_mut().1.update(&Sample::new([100.0], 0.0), 1.0);
    assert!(gain.theta_block().health().is_ok());
    assert!(gain.health().is_err());
}

const DT: f64 = 0.5;
const WEIGHT: f64 = 3.0;

/// From `(5, 1)` and `c = 4`, with `P = diag(0.5, 2)` and 0.25.
fn full() -> Full<1, 2, 3> {
    let p = SMatrix::from_diagonal(&SVector::from([0.5, 2.0, 0.25]));
    let weights = Weights::least_squares(0.0).unwrap();
    Full::new(ContinuousRls::new(SVector::from([5.0, 1.0, 4.0]), p, weights).unwrap())
}

fn blocks() -> BlockDiagonal<1, 2, ExactHold> {
    let weights = Weights::least_squares(0.0).unwrap();
    let p = SMatrix::from_diagonal(&SVector::from([0.5, 2.0]));
    let theta = ContinuousRls::new(SVector::from([5.0, 1.0]), p, weights);
    let filter = ContinuousRls::new(SVector::from([4.0]), SMatrix::identity() * 0.25, weights);
    BlockDiagonal::new(theta.unwrap(), filter.unwrap())
}

fn is_kept<G: Gain<1, 2>>(make: impl Fn() -> G) {
    let penalty = Keep::Penalty { weight: WEIGHT };
    // without correlation each entry is set to its bound, or moves towards it by a penalty
    let kept = |keep: Keep, start: f64, bound: f64, p: f64| match keep {
        Keep::Projection | Keep::Clamp => bound,
        Keep::Penalty { weight } => bound + (start - bound) * f64::exp(-weight * p * DT),
    };
    for of_theta in [Keep::Projection, Keep::Clamp, penalty] {
        for of_filter in [Keep::Projection, Keep::Clamp, penalty] {
            for (theta_out, filter_out) in
                [(false, false), (false, true), (true, false), (true, true)]
            {
                let highest = if theta_out { 3.0 } else { 6.0 };
                let theta = Bounds::new([0.0; 2], [highest, 9.0]).unwrap();
                let theta = theta.kept_by(of_theta).unwrap();
                let highest_c = if filter_out { 1.5 } else { 8.0 };
                let filter = Bounds::new([0.0], [highest_c]).unwrap();
                let filter = filter.kept_by(of_filter).unwrap();
                let mut gain = make();
                let outside = gain.keep(&theta, &filter, DT).unwrap();
                assert_eq!(outside, [theta_out, filter_out]);
                let a1 = if theta_out {
                    kept(of_theta, 5.0, 3.0, 0.5)
                } else {
                    5.0
                };
                let c1 = if filter_out {
                    kept(of_filter, 4.0, 1.5, 0.25)
                } else {
                    4.0
                };
                let found = (gain.theta(), gain.filter());
                assert!(
                    (found.0 - SVector::from([a1, 1.0])).amax() < 1e-14,
                    "{found:?}"
                );
                assert!((found.1[0] - c1).abs() < 1e-14, "{found:?}");
            }
        }
    }
}

#[test]
fn both_theta_and_c_are_kept_each_in_its_way() {
    is_kept(full);
    is_kept(blocks);
}
