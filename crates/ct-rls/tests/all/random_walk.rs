//! Parameters that walk at random: against the Kalman filter written plainly, against the differential equation, and at the cap.

use crate::support::{State, normal, normals, rng, runge_kutta, spd};
use ct_rls::{
    ContinuousRls, Error, ExactHold, Guards, Outcome, RandomWalk, RecursiveEstimator, Sample,
    Weights,
};
use nalgebra::{SMatrix, SVector, vector};
use proptest::prelude::*;

fn estimator<const P: usize>(
    p: SMatrix<f64, P, P>,
    weights: Weights,
    q: SVector<f64, P>,
) -> ContinuousRls<P, RandomWalk> {
    ContinuousRls::with_integrator(SVector::zeros(), p, weights)
        .and_then(|rls| rls.with_intensity(q))
        .unwrap()
}

#[test]
fn without_a_walk_it_is_the_exact_step_to_the_bit() {
    let mut rng = rng(1);
    let weights = Weights::new(0.9, 0.7, 0.1).unwrap();
    let p0 = spd::<4>(&mut rng);
    let mut ours = estimator::<4>(p0, weights, SVector::zeros());
    let mut exact = ContinuousRls::<4, ExactHold>::new(SVector::zeros(), p0, weights).unwrap();
    for _ in 0..1000 {
        let sample = Sample {
            phi: normals(&mut rng),
            y: normal(&mut rng),
        };
        assert_eq!(ours.update(&sample, 0.5), exact.update(&sample, 0.5));
    }
    assert_eq!(ours.theta(), exact.theta());
    assert_eq!(ours.covariance(), exact.covariance());
}

/// The Kalman filter of a walk between samples, on whole matrices.
fn kalman<const P: usize>() {
    let mut rng = rng(P as u64);
    let (h, r) = (0.3, 0.04);
    let weights = Weights::new(1.0 / r, 1.0 / r, 0.0).unwrap();
    let mut p = spd::<P>(&mut rng);
    let q: SVector<f64, P> = SVector::from_fn(|i, _| if i % 3 == 1 { 0.0 } else { 0.1 + i as f64 });
    let mut rls = estimator::<P>(p, weights, q);
    let mut theta = SVector::<f64, P>::zeros();
    for k in 0..300 {
        let phi: SVector<f64, P> = normals(&mut rng);
        let y = normal(&mut rng);
        rls.update(&Sample { phi, y }, h).accepted().unwrap();
        p += SMatrix::from_diagonal(&q) * h;
        let g = p * phi / (r / h + phi.dot(&(p * phi)));
        theta += g * (y - phi.dot(&theta));
        // Joseph's form
        let left = SMatrix::identity() - g * phi.transpose();
        p = left * p * left.transpose() + g * g.transpose() * (r / h);
        let off = (rls.covariance() - p).norm() / p.norm();
        assert!(off < 1e-11, "{P} {k}: {off:e}");
        let off = (rls.theta() - theta).norm();
        assert!(off < 1e-10, "{P} {k}: {off:e}");
    }
}

#[test]
fn it_is_the_kalman_filter() {
    kalman::<1>();
    kalman::<2>();
    kalman::<3>();
    kalman::<5>();
    kalman::<10>();
}

/// The equation with `phi` and `y` held, by the Runge-Kutta rule in 4000 steps.
fn reference(
    (theta, p): State,
    (phi, y): (SVector<f64, 3>, f64),
    w: &Weights,
    q: SVector<f64, 3>,
    t: f64,
) -> State {
    let rate = |(theta, p): State| {
        let k = p * phi;
        (
            k * (w.c() * (y - phi.dot(&theta))),
            p * w.eta() + SMatrix::from_diagonal(&q) - k * k.transpose() * w.gamma(),
        )
    };
    runge_kutta(rate, (theta, p), t)
}

/// First order: half the step, half the difference; the extrapolation of both satisfies the equation to 1e-6. Exact without excitation.
#[test]
fn agrees_with_its_equation() {
    let mut rng = rng(3);
    let q = vector![0.3, 0.0, 1.1];
    for (c, gamma, eta) in [(1.0, 1.0, 0.0), (0.7, 1.2, 0.5), (0.6, 0.3, 2.0)] {
        let weights = Weights::new(c, gamma, eta).unwrap();
        let p0 = spd::<3>(&mut rng);
        let phi: SVector<f64, 3> = normals(&mut rng);
        let run = |phi: SVector<f64, 3>, n: u32| -> State {
            let guards = Guards {
                trace_limit: f64::INFINITY,
                silent_below: -1.0,
            };
            let mut rls = estimator::<3>(p0, weights, q).with_guards(guards).unwrap();
            for _ in 0..n {
                rls.update(&Sample { phi, y: 1.3 }, 1.0 / f64::from(n));
            }
            (*rls.theta(), rls.covariance())
        };
        let start = (SVector::zeros(), p0);
        let exact = reference(start, (phi, 1.3), &weights, q, 1.0);
        let off = |s: &State| ((s.0 - exact.0).norm(), (s.1 - exact.1).norm());
        let (coarse, fine) = (run(phi, 2000), run(phi, 4000));
        let (a, b) = (off(&coarse), off(&fine));
        for ratio in [a.0 / b.0, a.1 / b.1] {
            assert!((ratio - 2.0).abs() < 0.02, "{ratio} {a:?} {b:?}");
        }
        let met = off(&(fine.0 * 2.0 - coarse.0, fine.1 * 2.0 - coarse.1));
        assert!(met.0 < 1e-6 && met.1 < 1e-6, "{met:?}");
        let silent = reference(start, (SVector::zeros(), 1.3), &weights, q, 1.0);
        let ours = run(SVector::zeros(), 1);
        assert!((ours.1 - silent.1).norm() < 1e-11 * silent.1.norm());
    }
}

/// A direction without excitation grows by `q` per second, up to the cap; the cap does not end the tracking of the others.
#[test]
fn a_silent_direction_grows_to_the_cap() {
    let mut rng = rng(4);
    let guards = Guards {
        trace_limit: 500.0,
        silent_below: 0.0,
    };
    let weights = Weights::least_squares(0.0).unwrap();
    let mut rls = estimator::<2>(SMatrix::identity(), weights, vector![0.2, 0.2])
        .with_guards(guards)
        .unwrap();
    for k in 1..=400_000_u32 {
        let truth = 3.0 + (f64::from(k) * 1e-4).sin();
        let sample = Sample::new([1.0, 0.0], truth + 0.01 * normal(&mut rng));
        let outcome = rls.update(&sample, 0.5).outcome;
        let p = rls.covariance();
        if k == 4000 {
            assert!((p[(1, 1)] - 401.0).abs() < 1e-9, "{p}");
        }
        assert_eq!(outcome == Outcome::Capped, k > 5000 - 15, "{k} {outcome:?}");
        assert!(p.trace() <= 500.0 * (1.0 + 1e-12), "{k}: {p}");
        if k > 100 {
            assert!(
                (rls.theta()[0] - truth).abs() < 0.04,
                "{k}: {}",
                rls.theta()
            );
        }
    }
    // all silent: the walk goes on, nothing else happens
    let mut rls = estimator::<2>(SMatrix::identity(), weights, vector![0.2, 0.0]);
    for _ in 0..1000 {
        let outcome = rls.update(&Sample::new([0.0, 0.0], 1.0), 0.5).outcome;
        assert_eq!(outcome, Outcome::Silent);
    }
    assert!((rls.covariance() - SMatrix::from_diagonal(&vector![101.0, 1.0])).norm() < 1e-9);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn stays_finite_and_definite(
        seed in any::<u64>(),
        sizes in prop::collection::vec((-6.0..6.0, -3.0..3.0), 1..30),
        q in prop::array::uniform3(prop_oneof![Just(0.0), (-12.0..12.0).prop_map(|x: f64| 10_f64.powf(x))]),
        eta in prop_oneof![Just(0.0), 0.0..10.0],
        ratio in 0.0..1.999,
    ) {
        let mut rng = rng(seed);
        let weights = Weights::new(1.0, ratio, eta).unwrap();
        let mut rls = estimator::<3>(spd::<3>(&mut rng), weights, SVector::from(q));
        let limit = rls.guards().trace_limit;
        for (size, dt) in sizes {
            let phi = normals::<3>(&mut rng) * 10_f64.powf(size);
            let dt = 10_f64.powf(dt).min(if eta > 0.0 { 250.0 / eta } else { 1e3 });
            let outcome = rls.update(&Sample { phi, y: normal(&mut rng) }, dt).outcome;
            prop_assert!(outcome.used(), "{outcome:?}");
            let health = rls.health().unwrap();
            prop_assert!(health.smallest_pivot > 0.0 && health.trace <= limit * (1.0 + 1e-12), "{health:?}");
            prop_assert!(rls.theta().iter().all(|x| x.is_finite()), "{}", rls.theta());
            prop_assert!(rls.covariance().iter().all(|x| x.is_finite()));
        }
    }

    /// After a step along one axis, its variance is at most that from the data of the step, `1/(gamma h phi^2)`, and no parameter's
    /// variance is below that from its walk and the data.
    #[test]
    fn one_parameter_stays_between_its_bounds(
        q in (-6.0..6.0).prop_map(|x: f64| 10_f64.powf(x)),
        phi in (-6.0..6.0).prop_map(|x: f64| 10_f64.powf(x)),
        dt in (-3.0..3.0).prop_map(|x: f64| 10_f64.powf(x)),
    ) {
        let weights = Weights::least_squares(0.0).unwrap();
        let guards = Guards { trace_limit: f64::INFINITY, silent_below: 0.0 };
        let mut rls = estimator::<1>(SMatrix::identity(), weights, vector![q]).with_guards(guards).unwrap();
        for _ in 0..20 {
            rls.update(&Sample::new([phi], 1.0), dt);
            let p = rls.covariance()[0];
            prop_assert!(p <= (1.0 + 1e-12) / (dt * phi * phi));
            prop_assert!(p >= (1.0 - 1e-12) / (1.0 / (q * dt) + dt * phi * phi));
        }
    }
}

#[test]
fn intensities_that_are_refused() {
    let weights = Weights::least_squares(0.0).unwrap();
    let new = || {
        ContinuousRls::<2, RandomWalk>::with_integrator(
            SVector::zeros(),
            SMatrix::identity(),
            weights,
        )
        .unwrap()
    };
    for bad in [-1e-9, f64::NAN, f64::INFINITY, 1e61] {
        let refused = new().with_intensity(vector![0.0, bad]).unwrap_err();
        assert!(
            matches!(refused, Error::Intensity { index: 1, .. }),
            "{refused}"
        );
    }
    // a reset of P keeps the intensity
    let mut rls = new().with_intensity(vector![0.0, 1e60]).unwrap();
    rls.set_intensity(vector![0.5, 0.0]).unwrap();
    rls.reset_covariance(&(SMatrix::identity() * 3.0)).unwrap();
    assert_eq!(rls.intensity(), vector![0.5, 0.0]);
}

#[test]
fn its_health_tells_the_smallest_pivot() {
    let weights = Weights::least_squares(0.0).unwrap();
    let p = SMatrix::from_diagonal(&vector![4.0, 0.25]);
    let rls = estimator::<2>(p, weights, vector![0.1, 0.1]);
    assert_eq!(rls.health().unwrap().smallest_pivot, 0.25);
}
