//! A sample costs no allocation, with any gain, filters, and rows and bounds that act.
#![allow(clippy::unwrap_used)]

use ct_constrained::{Bounds, Keep, Relation};
use ct_rls::{ContinuousRls, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use stabilized_oe::{
    AdaptivePlusConstant, BlockDiagonal, CoupledRow, Full, Gain, IoSample, StabilizedOe,
    StateVariableFilters,
};

/// Allocations of 2000 updates that follow the first; and how often bounds acted.
fn allocations(gain: impl Gain<3, 5>, keep: Keep) -> (u64, u64) {
    let bounds = Bounds::new([2.5, 2.0, 0.5], [3.5, 4.0, 2.0]).unwrap();
    let mut estimator = StabilizedOe::new(gain, StateVariableFilters::<3>::new(3.0).unwrap())
        .unwrap()
        .with_offset()
        .with_filter_bounds(bounds.kept_by(keep).unwrap())
        .unwrap()
        .with_rows([
            CoupledRow::new(
                Relation::Equal,
                [0.0, 0.0, 0.0, 1.0, 0.0],
                [0.1; 3],
                1.5,
                0.1,
            )
            .unwrap(),
            CoupledRow::new(Relation::AtMost, [0.0; 5], [1.0, 0.0, 0.0], 2.8, 10.0).unwrap(),
        ])
        .unwrap();
    let mut update = |k: u32| {
        let t = 0.1 * f64::from(k);
        let u = if (t / 7.0).floor() % 2.0 == 0.0 {
            1.0
        } else {
            -1.0
        };
        let dt = if k.is_multiple_of(10) {
            0.1 + 1e-6 * f64::from(k)
        } else {
            0.1
        };
        let y = (0.3 * t).sin() + 0.2 * (7.0 * t).cos();
        estimator.update(&IoSample { u, y }, dt)
    };
    update(0);
    let counted = allocation_counter::measure(|| {
        for k in 1..2000 {
            update(k);
        }
    });
    estimator.health().unwrap();
    (counted.count_total, estimator.bounded().filter)
}

#[test]
fn per_sample() {
    let weights = Weights::least_squares(0.01).unwrap();
    let theta = SVector::from([3.0, 3.0, 1.0, 1.0, 0.0]);
    let c = SVector::from([3.0, 3.0, 1.0]);
    for keep in [Keep::Projection, Keep::Clamp, Keep::Penalty { weight: 1e3 }] {
        let gain = BlockDiagonal::<3, 5>::new(
            ContinuousRls::with_integrator(theta, SMatrix::identity(), weights).unwrap(),
            ContinuousRls::with_integrator(c, SMatrix::identity(), weights).unwrap(),
        );
        let sum = AdaptivePlusConstant::new(gain.clone(), theta * 0.01, c * 0.01).unwrap();
        let (count, bounded) = allocations(sum, keep);
        assert_eq!(count, 0);
        assert!(bounded > 0);
        let (count, bounded) = allocations(gain, keep);
        assert_eq!(count, 0);
        assert!(bounded > 0);
        let both = SVector::from([3.0, 3.0, 1.0, 1.0, 0.0, 3.0, 3.0, 1.0]);
        let rls = ContinuousRls::with_integrator(both, SMatrix::identity(), weights).unwrap();
        let (count, bounded) = allocations(Full::<3, 5, 8>::new(rls), keep);
        assert_eq!(count, 0);
        assert!(bounded > 0);
    }
    // The counter counts.
    assert!(allocation_counter::measure(|| drop(std::hint::black_box(vec![0; 9]))).count_total > 0);
}
