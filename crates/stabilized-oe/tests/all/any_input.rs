//! For any input there is no panic, and the estimates stay finite.

use ct_constrained::Relation;
use ct_rls::{ContinuousRls, Euler, ExactHold, Outcome, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use stabilized_oe::{
    AdaptivePlusConstant, BlockDiagonal, CoupledRow, Derivatives, Error, Full, Gain, Integrator,
    IoSample, LateDifference, StabilizedOe, StateVariableFilters,
};

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0f64,
        1 => prop::num::f64::ANY,
        1 => prop::sample::select(vec![0.0, f64::NAN, f64::INFINITY, 1e300, -1e150, 1e30]),
    ]
}

fn any_step() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => 0.01..2.0f64,
        1 => prop::sample::select(vec![0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e9, 1e300]),
    ]
}

fn weights() -> Weights {
    Weights::least_squares(0.01).unwrap()
}

fn block<const T: usize, I: Integrator>(start: [f64; T], p: f64) -> ContinuousRls<T, I> {
    ContinuousRls::with_integrator(start.into(), SMatrix::identity() * p, weights()).unwrap()
}

fn survives<const N: usize, const P: usize, D: Derivatives<N, Sample = IoSample>>(
    gain: impl Gain<N, P>,
    derivatives: D,
    record: &[(f64, f64, f64)],
) -> Result<(), TestCaseError> {
    let mut f = [0.0; P];
    f[N] = 1.0;
    let rows = [
        (Relation::Equal, f, [0.1; N], 2.0),
        (Relation::AtLeast, [0.0; P], [1.0; N], f64::MAX),
    ];
    let rows = rows.map(|(relation, f, f_c, w)| CoupledRow::new(relation, f, f_c, 1.0, w).unwrap());
    let mut estimator = StabilizedOe::new(gain, derivatives)
        .unwrap()
        .with_rows(rows)
        .unwrap();
    for &(u, y, dt) in record {
        estimator.update(&IoSample { u, y }, dt);
        let theta: SVector<f64, P> = *estimator.theta();
        prop_assert!(theta.iter().all(|x| x.is_finite()), "{theta}");
        prop_assert!(theta.iter().take(N).all(|a| *a > 0.0), "{theta}");
        prop_assert!(estimator.filter().iter().all(|x| x.is_finite()));
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn estimates_stay_numbers(
        record in prop::collection::vec((any_number(), any_number(), any_step()), 1..60),
        p0 in -3.0..6.0f64,
    ) {
        let p = 10f64.powf(p0);
        let filters = || StateVariableFilters::new(2.0).unwrap();
        survives::<1, 2, _>(
            BlockDiagonal::new(block::<2, Euler>([2.0, 1.0], p), block([2.0], p)),
            LateDifference::<3>::new(),
            &record,
        )?;
        survives::<1, 2, _>(
            BlockDiagonal::new(block::<2, ExactHold>([2.0, 1.0], p), block([2.0], p)),
            LateDifference::<3>::new(),
            &record,
        )?;
        let sum = BlockDiagonal::new(block::<3, ExactHold>([2.0, 1.0, 0.5], p), block([2.0, 1.0], p));
        survives::<2, 3, _>(
            AdaptivePlusConstant::new(sum, SVector::from([p, 0.0, 1e40]), SVector::from([1.0, p])).unwrap(),
            filters(),
            &record,
        )?;
        survives::<3, 5, _>(
            BlockDiagonal::new(block::<5, ExactHold>([3.0, 3.0, 1.0, 1.0, 0.0], p), block([3.0, 3.0, 1.0], p)),
            StateVariableFilters::<3>::new(2.0).unwrap(),
            &record,
        )?;
        survives::<2, 5, _>(
            Full::<2, 5, 7>::new(block([2.0, 1.0, 1.0, 0.0, 0.0, 2.0, 1.0], p)),
            filters(),
            &record,
        )?;
    }
}

#[test]
fn a_gap_is_run_through() {
    let gain = BlockDiagonal::<1, 2>::new(block([5.0, 1.0], 1.0), block([10.0], 0.01));
    let mut estimator = StabilizedOe::new(gain, LateDifference::<3>::new()).unwrap();
    let (dt, mut y) = (0.5, 0.0);
    for k in 0..4000 {
        let u = if k / 60 % 2 == 0 { 1.0 } else { -1.0 };
        let gap = (1000..1500).contains(&k);
        let before = *estimator.theta();
        let measured = if gap { f64::NAN } else { y };
        let innovation = estimator.update(&IoSample { u, y: measured }, dt);
        assert_eq!(innovation.outcome.used(), !gap);
        if gap {
            assert_eq!(innovation.outcome, Outcome::NotFinite);
            assert_eq!(estimator.theta(), &before);
            // the model went on
            assert!((estimator.model_output() - y).abs() < 0.05);
        }
        y += (1.0 - f64::exp(-dt / 10.0)) * (2.0 * u - y);
    }
    assert!((estimator.theta() - SVector::from([10.0, 2.0])).amax() < 0.05);
}

/// The time of a sample whose input is lost passes for the model too: it is where the plant is when the next one comes.
#[test]
fn a_lost_input_is_held_on() {
    let model = |lost: bool| {
        let gain = BlockDiagonal::<1, 2>::new(block([10.0, 2.0], 1e-9), block([10.0], 1e-9));
        let mut estimator =
            StabilizedOe::new(gain, StateVariableFilters::<1>::new(1.0).unwrap()).unwrap();
        for k in 0..30 {
            let u = if lost && (5..12).contains(&k) {
                f64::NAN
            } else {
                1.0
            };
            estimator.update(&IoSample { u, y: 0.0 }, 0.5);
        }
        estimator.model_output()
    };
    let (whole, with_gap) = (model(false), model(true));
    assert!(whole > 1.0);
    assert!((whole - with_gap).abs() < 1e-6, "{whole} {with_gap}");
}

#[test]
fn bad_starts_are_refused_with_their_numbers() {
    let gain =
        |start: [f64; 4]| BlockDiagonal::<3, 4>::new(block(start, 1.0), block([1.0; 3], 1.0));
    let make = |start| StabilizedOe::new(gain(start), StateVariableFilters::<3>::new(1.0).unwrap());
    // (1 + s)(1 + s^2)
    let error = make([1.0, 1.0, 1.0, 1.0]).unwrap_err();
    assert!(
        matches!(error, Error::StartNotHurwitz { highest: 1.0 }),
        "{error}"
    );
    let estimator = make([3.0, 3.0, 1.0, 1.0]).unwrap();
    let narrow = ct_constrained::Bounds::new([2.0; 3], [4.0; 3]).unwrap();
    let error = estimator.clone().with_filter_bounds(narrow).unwrap_err();
    assert!(matches!(
        error,
        Error::StartOutside {
            what: "c",
            index: 0,
            value: 1.0,
            ..
        }
    ));
    assert!(estimator.with_model_state([0.0, f64::NAN, 0.0]).is_err());
    assert!(StateVariableFilters::<2>::new(-1.0).is_err());
}

fn a_fault_stays_out<D: Derivatives<1, Sample = IoSample>>(derivatives: D, fault: f64) {
    let gain = BlockDiagonal::<1, 2>::new(block([10.0, 2.0], 1e-3), block([10.0], 1e-3));
    let mut estimator = StabilizedOe::new(gain, derivatives).unwrap();
    let dt = 0.5;
    for k in 0..20 {
        let before = *estimator.theta();
        let u = if k == 10 { fault } else { 1.0 };
        let innovation = estimator.update(&IoSample { u, y: 1.0 }, dt);
        assert_eq!(innovation.outcome.used(), k != 10, "{fault:e} {k}");
        if k == 10 {
            assert_eq!(innovation.outcome, Outcome::NotFinite);
            assert_eq!(estimator.theta(), &before);
        }
        assert!(estimator.model_output().abs() < 3.0, "{fault:e} {k}");
    }
}

#[test]
fn an_input_out_of_range_is_a_fault_and_does_not_reach_the_model() {
    for fault in [1e31, -1e31, f64::INFINITY, f64::NAN] {
        a_fault_stays_out(LateDifference::<3>::new(), fault);
        a_fault_stays_out(StateVariableFilters::<1>::new(0.4).unwrap(), fault);
    }
}
