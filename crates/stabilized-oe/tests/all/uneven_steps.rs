//! The bounds that hold where none are given do not stand in the way of the plant: not with one long step among short ones, and not where
//! every step is longer than its time constant. Euler's rule needs its model slower than the step, and gets it.

use ct_rls::{ContinuousRls, Euler, ExactHold, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use stabilized_oe::{BlockDiagonal, Integrator, Known, KnownSample, StabilizedOe};

const GAIN: f64 = 2.0;

/// `a_1` after 1000 samples of a plant with one lag of `tau` s under a square wave, from a start of 30 s; `step(k)` s between them,
/// `p` times the usual P(0). And how often a bound acted.
fn found<I: Integrator>(p: f64, tau: f64, step: impl Fn(usize) -> f64) -> (f64, u64) {
    let weights = Weights::least_squares(1e-3).unwrap();
    let start = SVector::from([30.0, 1.0]);
    let p = SMatrix::from_diagonal(&SVector::from([100.0 * p, p]));
    let theta = ContinuousRls::with_integrator(start, p, weights).unwrap();
    let remember = Weights::least_squares(0.0).unwrap();
    let filter = SVector::from([20.0]);
    let filter = ContinuousRls::with_integrator(filter, SMatrix::identity(), remember).unwrap();
    let gain = BlockDiagonal::<1, 2, I>::new(theta, filter);
    let mut estimator = StabilizedOe::new(gain, Known::<1, 1>::new(false)).unwrap();
    let mut y = 0.0;
    for k in 0..1000 {
        let u = if k / 30 % 2 == 0 { 1.0 } else { -1.0 };
        let sample = KnownSample {
            u: [u],
            y,
            derivatives: [(GAIN * u - y) / tau],
        };
        let dt = step(k);
        assert!(estimator.update(&sample, dt).outcome.used());
        y += -f64::exp_m1(-dt / tau) * (GAIN * u - y);
    }
    (estimator.theta()[0], estimator.bounded().theta)
}

#[test]
fn one_long_step_among_short_ones_does_not_lift_the_time_constant() {
    let (tau, _) = found::<ExactHold>(1.0, 20.0, |k| if k % 200 == 199 { 40.0 } else { 1.0 });
    assert!((tau - 20.0).abs() < 0.05, "{tau}");
    let (tau, _) = found::<ExactHold>(1.0, 20.0, |k| if k % 2 == 0 { 5.0 } else { 25.0 });
    assert!((tau - 20.0).abs() < 0.05, "{tau}");
}

#[test]
fn a_time_constant_below_the_step_is_found() {
    let (tau, _) = found::<ExactHold>(1.0, 20.0, |_| 30.0);
    assert!((tau - 20.0).abs() < 0.2, "{tau}");
}

#[test]
fn eulers_model_is_kept_slower_than_its_step() {
    let (tau, bounded) = found::<Euler>(1e-4, 20.0, |_| 30.0);
    assert!(tau >= 30.0 && bounded > 0, "{tau}, {bounded}");
}
