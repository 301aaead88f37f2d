//! Penalties: rows of finite weight.

use ct_constrained::{ConstrainedRls, Row};
use ct_rls::{ContinuousRls, Guards, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};
use ode_solvers::dopri5::Dopri5;
use ode_solvers::{OutputType, System};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::{array, dot, estimator, normal, normals};

/// The data and a violated penalty together, as the paper's equations have them: the splitting is of first order in the step.
struct Penalised {
    phi: SVector<f64, 2>,
    y: f64,
    f: SVector<f64, 2>,
    chi: f64,
    w: f64,
    eta: f64,
}

type State = SVector<f64, 5>;

impl System<f64, State> for Penalised {
    fn system(&self, _: f64, x: &State, dx: &mut State) {
        let (theta, q) = (
            SVector::from([x[0], x[1]]),
            SMatrix::<f64, 2, 2>::new(x[2], x[3], x[3], x[4]),
        );
        let k = q * self.phi;
        let violation = (self.f.dot(&theta) - self.chi).max(0.0);
        let theta_rate = k * (self.y - theta.dot(&self.phi)) - q * self.f * (self.w * violation);
        let q_rate = q * self.eta - k * k.transpose();
        *dx = SVector::from([
            theta_rate[0],
            theta_rate[1],
            q_rate[(0, 0)],
            q_rate[(0, 1)],
            q_rate[(1, 1)],
        ]);
    }
}

#[test]
fn penalties_converge_to_the_equations() {
    let (phi, y, eta) = ([1.0, 0.4], 3.0, 0.1);
    let (f, chi, w) = ([0.2, 1.0], 0.1, 4.0);
    let duration = 2.0;
    let start = State::from([0.0, 0.0, 2.0, 0.0, 2.0]);
    let system = Penalised {
        phi: SVector::from(phi),
        y,
        f: SVector::from(f),
        chi,
        w,
        eta,
    };
    let mut solver = Dopri5::from_param(
        system,
        0.0,
        duration,
        duration,
        start,
        1e-11,
        1e-11,
        0.9,
        0.04,
        0.2,
        10.0,
        1e-3,
        1e-4,
        1_000_000,
        1_000_000,
        OutputType::Sparse,
    );
    solver.integrate().unwrap();
    let end = *solver.y_out().last().unwrap();
    let error = |steps: u32| {
        let weights = Weights::least_squares(eta).unwrap();
        let rls = ContinuousRls::new(SVector::zeros(), SMatrix::identity() * 2.0, weights).unwrap();
        let row = Row::at_most(f, chi, w).unwrap();
        let mut constrained = ConstrainedRls::new(rls, [row]).unwrap();
        for _ in 0..steps {
            constrained.update(&Sample::new(phi, y), duration / f64::from(steps));
        }
        let p = constrained.covariance();
        assert!(
            (p[(0, 1)] - end[3]).abs() < 1e-8,
            "P does not know of penalties"
        );
        (constrained.theta() - SVector::from([end[0], end[1]])).norm()
    };
    let ratio = error(400) / error(800);
    assert!((1.9..2.1).contains(&ratio), "{ratio}");
    assert!(error(6400) < 1e-3, "{}", error(6400));
}

/// A step so long and a weight so large that Euler's rule would overshoot: the row is reached, not passed.
#[test]
fn penalties_never_overshoot() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for exponent in -3..12 {
        let rls = estimator::<3>(&mut rng, 1e4, 1.0, 0.0);
        let (f, chi) = (array(&mut rng), normal(&mut rng));
        for row in [
            Row::at_most(f, chi, 10_f64.powi(exponent)).unwrap(),
            Row::at_least(f, chi, 10_f64.powi(exponent)).unwrap(),
        ] {
            let before = row.violation(rls.theta());
            let mut constrained = ConstrainedRls::new(rls.clone(), [row]).unwrap();
            constrained.update(&Sample::new([0.0; 3], 0.0), 10.0);
            let after = constrained.violations()[0];
            assert!(
                after.abs() <= before.abs() && after * before >= 0.0,
                "{before} {after}"
            );
        }
    }
}

fn falls<const P: usize>(
    seed: u64,
    p0: f64,
    eta: f64,
    dt: f64,
    weight: f64,
) -> Result<(), TestCaseError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let theta: SVector<f64, P> = normals(&mut rng);
    // no cap, because a cap reduces the forgetting below eta
    let guards = Guards {
        trace_limit: f64::INFINITY,
        silent_below: 0.0,
    };
    let rls = estimator::<P>(&mut rng, p0, 1.0, eta)
        .with_guards(guards)
        .unwrap();
    let f = array(&mut rng);
    let chi = dot(&f, &theta);
    // two inequalities that the true parameters obey, one of them only just, and an equality
    let (g, slack) = (array(&mut rng), normal(&mut rng).abs());
    let rows = [
        Row::equal(f, chi, weight).unwrap(),
        Row::at_most(g, dot(&g, &theta) + slack, weight).unwrap(),
        Row::at_least(f, chi, 3.0 * weight).unwrap(),
    ];
    let mut constrained = ConstrainedRls::new(rls, rows).unwrap();
    for _ in 0..5 {
        let phi: SVector<f64, P> = normals(&mut rng);
        let blurred = |rls: &ContinuousRls<P>| {
            // theta is accurate to some units in the last place, which limits the accuracy of V
            let axis = |i: usize| SVector::from_fn(|j, _| f64::from(u8::from(i == j)));
            let information: f64 = (0..P)
                .map(|i| rls.factor().information_norm(&axis(i)))
                .sum();
            let unit = 8.0 * f64::EPSILON * (theta.norm() + rls.theta().norm());
            let v = rls.distance(&theta);
            (
                v,
                2.0 * unit * (information * v).sqrt() + unit * unit * information,
            )
        };
        let (before, blur_before) = blurred(constrained.rls());
        let sample = Sample {
            phi,
            y: theta.dot(&phi),
        };
        constrained.update(&sample, dt);
        let (after, blur_after) = blurred(constrained.rls());
        let blur = blur_before + blur_after;
        prop_assert!(
            after <= (-eta * dt).exp() * before * (1.0 + 1e-12) + blur,
            "{} -> {}",
            before,
            after
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_lyapunov_function_falls(
        p in 1_usize..=8,
        seed in any::<u64>(),
        p0 in (-3.0..8.0).prop_map(|x: f64| 10_f64.powf(x)),
        eta in prop_oneof![Just(0.0), (-4.0..0.0).prop_map(|x: f64| 10_f64.powf(x))],
        dt in (-3.0..1.0).prop_map(|x: f64| 10_f64.powf(x)),
        weight in (-2.0..4.0).prop_map(|x: f64| 10_f64.powf(x)),
    ) {
        match p {
            1 => falls::<1>(seed, p0, eta, dt, weight)?,
            2 => falls::<2>(seed, p0, eta, dt, weight)?,
            3 => falls::<3>(seed, p0, eta, dt, weight)?,
            4 => falls::<4>(seed, p0, eta, dt, weight)?,
            5 => falls::<5>(seed, p0, eta, dt, weight)?,
            6 => falls::<6>(seed, p0, eta, dt, weight)?,
            7 => falls::<7>(seed, p0, eta, dt, weight)?,
            _ => falls::<8>(seed, p0, eta, dt, weight)?,
        }
    }
}

/// Reason for `Gamma = 0` of penalties: used as equality rows while violated, the Lyapunov function can grow.
#[test]
fn a_penalty_with_gamma_of_its_weight_would_let_it_grow() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let (mut tried, mut grown, mut most) = (0, 0, 0.0_f64);
    for _ in 0..20_000 {
        let theta: SVector<f64, 2> = normals(&mut rng);
        let mut rls = estimator::<2>(&mut rng, 1.0, 1.0, 0.0);
        let f = array(&mut rng);
        let chi = dot(&f, &theta) + normal(&mut rng).abs();
        let row = Row::at_most(f, chi, 1.0).unwrap();
        if row.violation(rls.theta()) == 0.0 {
            continue;
        }
        let before = rls.distance(&theta);
        let mut relaxed = rls.clone();
        relaxed.relax(row.f(), chi, 10.0).unwrap();
        assert!(relaxed.distance(&theta) <= before * (1.0 + 1e-12));
        rls.absorb(row.f(), chi, 10.0).unwrap();
        let growth = rls.distance(&theta) - before;
        tried += 1;
        grown += u32::from(growth > 0.0);
        most = most.max(growth);
    }
    println!("V grew in {grown} of {tried} cases, by {most:.1} at most");
    assert!(grown > 100 && most > 10.0, "{grown} of {tried}, {most}");
}
