//! Wind-up, silent and useless samples, resets, and settings that are refused.

use crate::support::{normals, rng};
use ct_rls::{ContinuousRls, Error, Guards, Outcome, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector, matrix, vector};

fn estimator(eta: f64) -> ContinuousRls<2> {
    let weights = Weights::least_squares(eta).unwrap();
    ContinuousRls::new(SVector::zeros(), SMatrix::identity(), weights).unwrap()
}

#[test]
fn the_trace_stays_at_its_cap() {
    let guards = Guards {
        trace_limit: 50.0,
        silent_below: 0.0,
    };
    let mut rls = estimator(0.1).with_guards(guards).unwrap();
    let theta = vector![1.0, -2.0];
    let mut v = rls.distance(&theta);
    for k in 0..10_000 {
        // one direction only: the other winds up
        let outcome = rls.update(&Sample::new([1.0, 1.0], -1.0), 0.5).outcome;
        let trace = rls.covariance().trace();
        assert!(trace <= 50.0 * (1.0 + 1e-12), "{k}: {trace}");
        let next = rls.distance(&theta);
        assert!(
            next <= v * (1.0 + 1e-9) + 1e-12,
            "V {v} -> {next} at {k}, {outcome:?}"
        );
        v = next;
    }
    let health = rls.health().unwrap();
    assert!(health.capped > 9_000 && health.trace > 49.9 && health.used == 10_000);
    assert!(
        (health.excitation - 0.02).abs() < 1e-3,
        "{}",
        health.excitation
    );
}

#[test]
fn the_cap_that_an_estimator_starts_with_ends_wind_up() {
    let mut rls = estimator(0.1);
    for _ in 0..100_000 {
        rls.update(&Sample::new([1e-12, 0.0], 0.0), 1.0);
    }
    let health = rls.health().unwrap();
    assert!(health.trace <= 2e6 * (1.0 + 1e-12) && health.trace > 1.9e6);
}

#[test]
fn nothing_is_forgotten_while_the_regressor_is_silent() {
    let guards = Guards {
        trace_limit: 1e9,
        silent_below: 1e-3,
    };
    let mut rls = estimator(0.1).with_guards(guards).unwrap();
    for _ in 0..1000 {
        assert_eq!(
            rls.update(&Sample::new([3e-4, 9e-4], 0.0), 1.0).outcome,
            Outcome::Silent
        );
    }
    let trace = rls.health().unwrap().trace;
    assert!(trace < 2.0 && trace > 1.99, "{trace}");
    assert_eq!(rls.health().unwrap().silent, 1000);
    assert_eq!(
        rls.update(&Sample::new([0.0, 1.1e-3], 0.0), 1.0).outcome,
        Outcome::Updated
    );
    // silent by itself, without a threshold
    let mut rls = estimator(0.1);
    assert_eq!(
        rls.update(&Sample::new([0.0, 0.0], 7.0), 1.0).outcome,
        Outcome::Silent
    );
    assert_eq!(rls.covariance(), SMatrix::<f64, 2, 2>::identity());
}

#[test]
fn useless_samples_change_nothing() {
    let mut rls = estimator(0.1);
    rls.update(&Sample::new([1.0, 2.0], 3.0), 0.1);
    let (theta, p) = (*rls.theta(), rls.covariance());
    let mut check = |phi: [f64; 2], y: f64, dt: f64, outcome: Outcome| {
        let innovation = rls.update(&Sample::new(phi, y), dt);
        assert_eq!(innovation.outcome, outcome, "{phi:?} {y} {dt}");
        assert_eq!(innovation.accepted(), Err(Error::Refused { outcome }));
        assert_eq!((*rls.theta(), rls.covariance()), (theta, p));
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200] {
        check([bad, 1.0], 1.0, 0.1, Outcome::NotFinite);
        check([1.0, bad], 1.0, 0.1, Outcome::NotFinite);
        check([1.0, 1.0], bad, 0.1, Outcome::NotFinite);
    }
    for dt in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e6] {
        check([1.0, 1.0], 1.0, dt, Outcome::BadStep);
    }
    assert_eq!(rls.health().unwrap().unused, 17);
    let innovation = rls.update(&Sample::new([1.0, 1.0], 1.0), 0.1);
    assert_eq!(innovation.accepted(), Ok(innovation));
    let refused = rls.update(&Sample::new([1.0, f64::NAN], 1.0), 0.1);
    let message = refused.accepted().unwrap_err().to_string();
    assert!(
        message.contains("NaN") && message.contains("changed nothing"),
        "{message}"
    );
}

#[test]
fn a_reset_follows_a_jump() {
    let mut rng = rng(11);
    let mut rls = estimator(0.001);
    let mut learn = |rls: &mut ContinuousRls<2>, theta: SVector<f64, 2>, n| {
        for _ in 0..n {
            let phi: SVector<f64, 2> = normals(&mut rng);
            rls.update(
                &Sample {
                    phi,
                    y: theta.dot(&phi),
                },
                1.0,
            );
        }
        (rls.theta() - theta).norm()
    };
    learn(&mut rls, vector![1.0, 2.0], 2000);
    let jumped = vector![-1.0, 5.0];
    let mut kept = rls.clone();
    assert!(learn(&mut kept, jumped, 20) > 1.0);
    rls.reset_covariance(&(SMatrix::identity() * 1e4)).unwrap();
    assert!(learn(&mut rls, jumped, 20) < 1e-3);
}

/// After a step change without a reset, old data are forgotten: `V` falls to `e^{-eta t}` of its value after the step.
#[test]
fn forgetting_follows_a_jump() {
    let mut rng = rng(12);
    let (eta, dt) = (0.05, 0.5);
    let mut rls = estimator(eta);
    for jumped in [vector![1.0, 2.0], vector![-1.0, 5.0], vector![40.0, -0.1]] {
        let start = rls.distance(&jumped);
        let mut trace = 0.0;
        for _ in 0..400 {
            let phi: SVector<f64, 2> = normals(&mut rng);
            let y = jumped.dot(&phi);
            assert!(rls.update(&Sample { phi, y }, dt).outcome.used());
            trace = rls.covariance().trace();
        }
        // ten memories: |delta|^2 <= trace(P) V
        let off = (rls.theta() - jumped).norm_squared();
        let bound = trace * start * (-eta * dt * 400.0).exp();
        assert!(off <= bound * (1.0 + 1e-9), "{off:e} {bound:e}");
        assert!(off < 1e-3, "{off:e}");
    }
}

#[test]
fn bad_settings_are_refused_with_their_numbers() {
    let weights = Weights::least_squares(0.02).unwrap();
    let new = |theta, p| ContinuousRls::<2>::new(theta, p, weights);
    let zero = SVector::<f64, 2>::zeros();
    assert!(matches!(
        Weights::new(0.0, 0.0, 0.0),
        Err(Error::Weight { .. })
    ));
    assert!(matches!(
        Weights::new(-1.0, 0.0, 0.0),
        Err(Error::Weight { .. })
    ));
    assert!(matches!(
        Weights::new(f64::INFINITY, 0.0, 0.0),
        Err(Error::Weight { .. })
    ));
    assert!(matches!(
        Weights::new(1.1e40, 0.0, 0.0),
        Err(Error::Weight { .. })
    ));
    for eta in [-1e-9, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            Weights::new(1.0, 1.0, eta),
            Err(Error::Forgetting { .. })
        ));
    }
    for (lambda, dt) in [(0.0, 1.0), (1.1, 1.0), (0.98, 0.0), (f64::NAN, 1.0)] {
        assert!(matches!(
            Weights::from_forgetting_factor(lambda, dt),
            Err(Error::Lambda { .. })
        ));
    }
    assert!(matches!(
        new(vector![0.0, f64::NAN], SMatrix::identity()),
        Err(Error::Theta { index: 1, .. })
    ));
    for p in [
        matrix![1.0, 0.0; 0.0, 0.0],
        matrix![1.0, 2.0; 2.0, 1.0],
        matrix![1.0, 1.0; 1.0, 1.0],
        matrix![-1.0, 0.0; 0.0, 1.0],
        matrix![1.0, 0.0; 0.0, f64::INFINITY],
        matrix![1.0, 0.0; 0.0, f64::NAN],
    ] {
        assert!(
            matches!(new(zero, p), Err(Error::NotPositiveDefinite { .. })),
            "{p}"
        );
    }
    let p = matrix![1.0, 0.3; 0.2, 1.0];
    let message = new(zero, p).unwrap_err().to_string();
    assert!(
        message.contains("(0, 1) is 0.3") && message.contains("(1, 0) is 0.2"),
        "{message}"
    );
    assert!(matches!(
        new(zero, matrix![1.0, f64::NAN; 0.2, 1.0]),
        Err(Error::NotSymmetric { .. })
    ));

    let guarded = |trace_limit, silent_below| {
        estimator(0.1).with_guards(Guards {
            trace_limit,
            silent_below,
        })
    };
    assert!(matches!(
        guarded(1.9, 0.0),
        Err(Error::TraceAboveLimit { .. })
    ));
    for (limit, silent) in [
        (0.0, 0.0),
        (f64::NAN, 0.0),
        (10.0, f64::NEG_INFINITY),
        (10.0, f64::NAN),
    ] {
        assert!(matches!(guarded(limit, silent), Err(Error::Guard { .. })));
    }
    assert!(guarded(f64::INFINITY, 0.0).is_ok());
}

#[test]
fn below_zero_even_an_exact_silence_is_forgotten_in() {
    let silent = Sample::new([0.0, 0.0], 0.0);
    for (silent_below, grows) in [(0.0, false), (-1.0, true)] {
        let guards = Guards {
            trace_limit: f64::INFINITY,
            silent_below,
        };
        let mut rls = estimator(0.1).with_guards(guards).unwrap();
        let before = rls.factor().trace();
        rls.update(&silent, 1.0);
        assert_eq!(rls.factor().trace() > before, grows);
    }
}

#[test]
fn records_are_checked_when_they_are_read() {
    let weights = Weights::new(1.0, 0.5, 0.02).unwrap();
    let text = serde_json::to_string(&weights).unwrap();
    assert_eq!(serde_json::from_str::<Weights>(&text).unwrap(), weights);
    let error = serde_json::from_str::<Weights>(r#"{"c":1,"gamma":2,"eta":0}"#).unwrap_err();
    assert!(error.to_string().contains("gamma is 2"), "{error}");
}

#[test]
fn excitation_is_the_smallest_eigenvalue_of_the_information() {
    let mut rng = rng(4);
    let mut rls = ContinuousRls::<5>::new(
        SVector::zeros(),
        SMatrix::identity() * 1e3,
        Weights::least_squares(0.01).unwrap(),
    )
    .unwrap();
    for k in 0..300 {
        let mut phi: SVector<f64, 5> = normals(&mut rng);
        phi[4] = phi[3] + 1e-3 * phi[4];
        rls.update(&Sample { phi, y: 1.0 }, 0.1);
        if k % 50 == 49 {
            let eigenvalues = rls.covariance().symmetric_eigenvalues();
            let expected = 1.0 / eigenvalues.max();
            let health = rls.health().unwrap();
            assert!(
                (health.excitation - expected).abs() < 1e-9 * expected,
                "{} {expected}",
                health.excitation
            );
            assert!((health.trace - eigenvalues.sum()).abs() < 1e-9 * health.trace);
        }
    }
}

#[test]
fn no_threshold_of_silence_lets_a_regressor_in_that_is_too_long() {
    for silent_below in [1e31, 1e200, f64::MAX] {
        let guards = Guards {
            trace_limit: 1e9,
            silent_below,
        };
        let mut rls = estimator(0.1).with_guards(guards).unwrap();
        let long = Sample::new([1.1e30, 0.0], 0.0);
        assert_eq!(rls.update(&long, 1.0).outcome, Outcome::NotFinite);
        let short = Sample::new([0.9e30, 0.0], 0.0);
        assert_eq!(rls.update(&short, 1.0).outcome, Outcome::Silent);
    }
}

#[test]
fn a_relaxation_beyond_the_floating_point_range_is_refused() {
    let mut rls = estimator(0.1);
    let row = vector![1e-160, 0.0];
    assert_eq!(rls.relax(&row, 1.0, f64::INFINITY), None);
    assert_eq!(*rls.theta(), vector![0.0, 0.0]);
    assert_eq!(rls.relax(&SVector::zeros(), 1.0, 1.0), Some(1.0));
}

/// Below the rounding error of its entries, a pivot is positive but has no significant digits.
#[test]
fn a_start_that_is_singular_to_rounding_is_refused() {
    let weights = Weights::least_squares(0.0).unwrap();
    let refused = |p| {
        let made = ContinuousRls::<2>::new(SVector::zeros(), p, weights);
        matches!(made, Err(Error::NotPositiveDefinite { .. }))
    };
    let above_one = 1.0 + f64::EPSILON;
    assert!(refused(SMatrix::from([[above_one, 1.0], [1.0, 1.0]])));
    assert!(!refused(SMatrix::from([[1.0 + 1e-13, 1.0], [1.0, 1.0]])));
    // too small by itself, its range being that of the inverse
    assert!(refused(SMatrix::from([[1e-101, 0.0], [0.0, 1.0]])));
    assert!(!refused(SMatrix::from([[1e-99, 0.0], [0.0, 1.0]])));
}

#[test]
fn a_forgetting_factor_is_the_same_memory_in_seconds() {
    for (lambda, dt) in [(0.5, 2.0), (0.98, 0.1), (1.0, 3.0)] {
        let weights = Weights::from_forgetting_factor(lambda, dt).unwrap();
        // a step of dt leaves the share lambda of the information
        let left = f64::exp(-weights.eta() * dt);
        assert!((left - lambda).abs() < 1e-15, "{left} {lambda}");
        assert_eq!((weights.c(), weights.gamma()), (1.0, 1.0));
    }
}

/// The cap is enforced for every integration rule of `P`.
#[test]
fn the_trace_stays_at_its_cap_for_the_textbooks_rules_too() {
    fn capped<I: ct_rls::Integrator>() {
        let weights = Weights::least_squares(0.1).unwrap();
        let guards = Guards {
            trace_limit: 5.0,
            silent_below: 0.0,
        };
        let mut rls =
            ContinuousRls::<2, I>::with_integrator(SVector::zeros(), SMatrix::identity(), weights)
                .and_then(|rls| rls.with_guards(guards))
                .unwrap();
        for _ in 0..1000 {
            rls.update(&Sample::new([1.0, 0.0], 1.0), 0.1);
            assert!(rls.covariance().trace() <= 5.0 * (1.0 + 1e-12));
        }
        assert!(rls.health().unwrap().capped > 0);
    }
    capped::<ct_rls::Euler>();
    capped::<ct_rls::Rk4>();
}
