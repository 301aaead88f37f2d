//! Directional forgetting: against exponential forgetting, against its differential equation, and within its bounds.

use crate::support::{State, normal, normals, rng, runge_kutta, spd};
use ct_rls::{
    ContinuousRls, Directional, Guards, Integrator, Outcome, RecursiveEstimator, Sample, Weights,
};
use nalgebra::{SMatrix, SVector, vector};
use proptest::prelude::*;

const UNCAPPED: Guards = Guards {
    trace_limit: f64::INFINITY,
    silent_below: 0.0,
};

fn estimator<const P: usize, I: Integrator>(
    theta: SVector<f64, P>,
    p: SMatrix<f64, P, P>,
    weights: Weights,
) -> ContinuousRls<P, I> {
    ContinuousRls::with_integrator(theta, p, weights)
        .and_then(|rls| rls.with_guards(UNCAPPED))
        .unwrap()
}

fn inverse<const P: usize>(m: SMatrix<f64, P, P>) -> SMatrix<f64, P, P>
where
    nalgebra::Const<P>: nalgebra::ToTypenum,
{
    m.cholesky().unwrap().inverse()
}

#[test]
fn one_parameter_is_exponential_forgetting() {
    let mut rng = rng(1);
    for (c, gamma, eta) in [
        (1.0, 1.0, 0.3),
        (0.7, 0.2, 4.0),
        (0.5, 0.9, 1e-3),
        (1.0, 1.0, 0.0),
    ] {
        let weights = Weights::new(c, gamma, eta).unwrap();
        let mut ours =
            estimator::<1, Directional>(vector![0.4], SMatrix::identity() * 7.0, weights);
        let mut exact =
            estimator::<1, ct_rls::ExactHold>(vector![0.4], SMatrix::identity() * 7.0, weights);
        for _ in 0..300 {
            let phi: SVector<f64, 1> = normals(&mut rng);
            let (y, dt) = (normal(&mut rng), 10_f64.powf(normal(&mut rng)).min(50.0));
            ours.update(&Sample { phi, y }, dt).accepted().unwrap();
            exact.update(&Sample { phi, y }, dt).accepted().unwrap();
            let (a, b) = (ours.covariance()[0], exact.covariance()[0]);
            assert!((a / b - 1.0).abs() < 1e-12, "P {a} {b}");
            let (a, b) = (ours.theta()[0], exact.theta()[0]);
            assert!((a - b).abs() < 1e-12, "theta {a} {b}");
        }
    }
}

/// `R phi` of a regressor that stays is the same as with exponential forgetting whatever `P(0)`; the estimates are where `P(0)` links
/// its direction to no other. And what is known across it is as at the start.
#[test]
fn a_constant_direction_is_forgotten_exponentially() {
    let mut rng = rng(2);
    let weights = Weights::new(0.8, 0.6, 0.2).unwrap();
    let phi = vector![1.0, -2.0, 0.5];
    let start: SVector<f64, 3> = normals(&mut rng);
    for (p0, linked) in [
        (spd::<3>(&mut rng), true),
        (SMatrix::identity() * 2.5, false),
    ] {
        let mut ours = estimator::<3, Directional>(start, p0, weights);
        let mut exact = estimator::<3, ct_rls::ExactHold>(start, p0, weights);
        for k in 0..60 {
            let sample = Sample {
                phi,
                y: normal(&mut rng),
            };
            let dt = 0.1 + 0.05 * f64::from(k % 7);
            ours.update(&sample, dt);
            exact.update(&sample, dt);
            let seen = [ours.covariance(), exact.covariance()].map(|p| inverse(p) * phi);
            let off = (seen[0] - seen[1]).norm() / seen[1].norm();
            assert!(off < 1e-11, "{k}: {off:e}");
            if !linked {
                assert!((ours.theta() - exact.theta()).norm() < 1e-12, "{k}");
                let s = [ours.covariance(), exact.covariance()].map(|p| phi.dot(&(p * phi)));
                assert!((s[0] / s[1] - 1.0).abs() < 1e-12, "{k}: {s:?}");
                let across = vector![2.0, 1.0, 0.0];
                let kept = across.dot(&(ours.covariance() * across));
                assert!((kept / (2.5 * 5.0) - 1.0).abs() < 1e-12, "{k}: {kept}");
            }
        }
    }
}

/// The equation with `phi` and `y` held, by the Runge-Kutta rule in 4000 steps.
fn reference((theta, p): State, phi: SVector<f64, 3>, y: f64, w: &Weights, t: f64) -> State {
    let rate = |(theta, p): State| {
        let k = p * phi;
        let rho = phi.dot(&(inverse(p) * phi));
        (
            k * (w.c() * (y - phi.dot(&theta))),
            phi * phi.transpose() * (w.eta() / rho) - k * k.transpose() * w.gamma(),
        )
    };
    runge_kutta(rate, (theta, p), t)
}

/// First order where `P` links the regressor's direction to others: half the step, half the difference; the extrapolation of both
/// meets the equation to 1e-6.
#[test]
fn agrees_with_its_equation() {
    let mut rng = rng(3);
    for (c, gamma, eta) in [(1.0, 1.0, 0.5), (0.7, 1.2, 0.1), (0.6, 0.3, 2.0)] {
        let weights = Weights::new(c, gamma, eta).unwrap();
        let start: SVector<f64, 3> = normals(&mut rng);
        let p0 = spd::<3>(&mut rng);
        let phi: SVector<f64, 3> = normals(&mut rng);
        let exact = reference((start, p0), phi, 1.3, &weights, 1.0);
        let split = |n: u32| -> State {
            let mut rls = estimator::<3, Directional>(start, p0, weights);
            for _ in 0..n {
                rls.update(&Sample { phi, y: 1.3 }, 1.0 / f64::from(n));
            }
            (*rls.theta(), rls.covariance())
        };
        let (coarse, fine) = (split(2000), split(4000));
        let off = |s: &State| ((s.0 - exact.0).norm(), (s.1 - exact.1).norm());
        let (a, b) = (off(&coarse), off(&fine));
        for ratio in [a.0 / b.0, a.1 / b.1] {
            assert!((ratio - 2.0).abs() < 0.02, "{ratio} {a:?} {b:?}");
        }
        let met = (fine.0 * 2.0 - coarse.0, fine.1 * 2.0 - coarse.1);
        let met = off(&met);
        assert!(met.0 < 1e-6 && met.1 < 1e-6, "{met:?}");
        // one step forgets more across phi than the equation, by what the documentation says
        let h = 1e-3;
        let mut rls = estimator::<3, Directional>(start, p0, weights);
        rls.update(&Sample { phi, y: 1.3 }, h);
        let exact = reference((start, p0), phi, 1.3, &weights, h);
        let excess = inverse(exact.1) - inverse(rls.covariance());
        let r = inverse(p0);
        let (n2, rho) = (phi.norm_squared(), phi.dot(&(r * phi)));
        let w = r * phi - phi * (rho / n2);
        let predicted = w * w.transpose() * (gamma * eta * h * h * n2 * n2 / (2.0 * rho * rho));
        let off = (excess - predicted).norm() / predicted.norm();
        assert!(off < 0.05, "{off} {excess} {predicted}");
    }
}

/// Eigenvalues of `P`, smallest and largest, each from its own triangular factor so that neither is lost beside the other.
fn eigenvalues(rls: &ContinuousRls<3, Directional>) -> (f64, f64) {
    let root = rls.root().unwrap();
    let inverse = root
        .solve_upper_triangular(&SMatrix::<f64, 3, 3>::identity())
        .unwrap();
    let largest = |m: SMatrix<f64, 3, 3>| (m * m.transpose()).symmetric_eigenvalues().max();
    (1.0 / largest(inverse.transpose()), largest(root))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Every step of every length keeps `P` between the bounds, and the Lyapunov function falls.
    #[test]
    fn stays_within_its_bounds(
        seed in any::<u64>(),
        sizes in prop::collection::vec((-6.0..6.0, -3.0..3.0), 1..12),
        eta in prop_oneof![Just(0.0), 0.0..10.0],
        ratio in 0.0..1.999,
        p0 in -3.0..6.0,
    ) {
        let mut rng = rng(seed);
        // at most 250 memories in a step
        let weights = Weights::new(1.0, ratio, eta).unwrap();
        let p0: SMatrix<f64, 3, 3> = spd::<3>(&mut rng) * 10_f64.powf(p0);
        let theta: SVector<f64, 3> = normals(&mut rng);
        let mut rls = estimator::<3, Directional>(normals(&mut rng), p0, weights);
        for (size, dt) in sizes {
            let phi = normals::<3>(&mut rng) * 10_f64.powf(size);
            let dt = 10_f64.powf(dt).min(if eta > 0.0 { 250.0 / eta } else { 1e3 });
            let (low, high) = eigenvalues(&rls);
            let v = rls.distance(&theta);
            let innovation = rls.update(&Sample { phi, y: theta.dot(&phi) }, dt);
            prop_assert!(innovation.outcome.used(), "{innovation:?}");
            prop_assert!(rls.theta().iter().all(|x| x.is_finite()));
            let (next_low, next_high) = eigenvalues(&rls);
            prop_assert!(next_low > 0.0 && next_high.is_finite());
            if innovation.outcome == Outcome::Updated {
                // infinite for gamma = 0, where 1/r is only bounded from below
                let excited = eta / (ratio * phi.norm_squared());
                prop_assert!(next_high <= high.max(excited) * (1.0 + 1e-6), "{next_high:e} {high:e} {excited:e}");
                prop_assert!(next_low >= low.min(excited) * (1.0 - 1e-6), "{next_low:e} {low:e} {excited:e}");
            } else {
                prop_assert!(next_high <= high * (1.0 + 1e-6), "{next_high:e} {high:e}");
            }
            // theta is known to its last digits only, which weighs as much as P is small
            let unit = 8.0 * f64::EPSILON * (theta.norm() + rls.theta().norm());
            let blur = 2.0 * unit * (v / next_low).sqrt() + unit * unit / next_low;
            prop_assert!(rls.distance(&theta) <= v * (1.0 + 1e-6) + 4.0 * blur, "V {v:e} {:e}", rls.distance(&theta));
        }
    }
}

/// A million samples in a plane: what is known across it is neither lost nor gained, and `P` stays bounded.
#[test]
fn a_silent_direction_is_kept() {
    let mut rng = rng(4);
    let weights = Weights::least_squares(0.2).unwrap();
    let p0 = spd::<3>(&mut rng);
    let mut rls = estimator::<3, Directional>(SVector::zeros(), p0, weights);
    let across = vector![1.0, 1.0, -1.0];
    let (a, b) = (vector![1.0, 0.0, 1.0], vector![0.0, 1.0, 1.0]);
    for _ in 0..1_000_000 {
        let phi = a * normal(&mut rng) + b * normal(&mut rng);
        let sample = Sample {
            phi,
            y: phi.sum() + 0.01 * normal(&mut rng),
        };
        rls.update(&sample, 0.5).accepted().unwrap();
    }
    // the links to the plane are gone, so what is left across it is 1/(P^-1 across)
    let r = inverse(p0);
    let health = rls.health().unwrap();
    let kept = across.dot(&(rls.covariance() * across)) / 9.0;
    let (least, most) = (
        1.0 / r.symmetric_eigenvalues().max(),
        p0.symmetric_eigenvalues().max(),
    );
    let along = across.dot(&(p0 * across)) / 9.0;
    assert!(
        kept <= along * (1.0 + 1e-9) && kept >= least / 3.0,
        "{kept} {along} {least}"
    );
    assert!(
        health.trace < 3.0 * most && health.capped == 0,
        "{health:?}"
    );
    assert!((a.dot(rls.theta()) - 2.0).abs() < 0.05, "{}", rls.theta());
}

/// A regressor too weak to hold `P` below the cap forgets nothing; the others do.
#[test]
fn a_weak_regressor_does_not_raise_p_above_the_cap() {
    let guards = Guards {
        trace_limit: 50.0,
        silent_below: 0.0,
    };
    let weights = Weights::least_squares(0.1).unwrap();
    let mut rls = ContinuousRls::<2, Directional>::with_integrator(
        SVector::zeros(),
        SMatrix::identity(),
        weights,
    )
    .and_then(|rls| rls.with_guards(guards))
    .unwrap();
    // 0.1/50 = 0.002 is the squared length at the cap
    for k in 0..200_000 {
        let truth = 1.0 + f64::from(k) * 1e-5;
        let outcome = rls.update(&Sample::new([1.0, 0.0], truth), 0.5).outcome;
        assert_eq!(outcome, Outcome::Updated);
        let weak = Sample::new([0.0, 0.03], 0.03);
        assert_eq!(rls.update(&weak, 0.5).outcome, Outcome::Capped);
        let enough = Sample::new([0.01, 0.05], 0.05 + 0.01 * truth);
        assert_eq!(rls.update(&enough, 0.5).outcome, Outcome::Updated);
        if k > 1000 {
            assert!(
                (rls.theta()[0] - truth).abs() < 1e-3,
                "{k}: {}",
                rls.theta()
            );
        }
    }
    let health = rls.health().unwrap();
    assert_eq!(health.capped, 200_000);
    assert!(1.0 / health.excitation <= 50.0, "{health:?}");
}
