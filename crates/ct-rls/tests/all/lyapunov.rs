//! The Lyapunov function `V = delta' P^-1 delta` over the exact step: it falls as the equations say.

use crate::support::{normals, rng, spd};
use ct_rls::{ContinuousRls, Error, Guards, RecursiveEstimator, Sample, UdFactor, Weights};
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

/// One step: `V` before, after, and as predicted; and the influence of rounding.
struct Fall {
    before: f64,
    after: f64,
    predicted: f64,
    rounding: f64,
}

#[derive(Clone, Copy, Debug)]
struct Case {
    seed: u64,
    p0: f64,
    size: f64,
    c: f64,
    /// gamma/c, below 2
    ratio: f64,
    eta: f64,
    dt: f64,
}

fn fall<const P: usize>(case: Case) -> Vec<Fall> {
    let mut rng = rng(case.seed);
    let theta: SVector<f64, P> = normals(&mut rng);
    let p0: SMatrix<f64, P, P> = spd::<P>(&mut rng) * case.p0;
    let weights = Weights::new(case.c, case.ratio * case.c, case.eta).unwrap();
    // no cap: it may forget less than eta says
    let guards = Guards {
        trace_limit: f64::INFINITY,
        silent_below: 0.0,
    };
    let mut rls = ContinuousRls::<P>::new(normals(&mut rng), p0, weights)
        .unwrap()
        .with_guards(guards)
        .unwrap();
    (0..4)
        .map(|_| {
            let phi = normals::<P>(&mut rng) * case.size;
            let before = rls.distance(&theta);
            let start = rls.theta().norm();
            let information = information_trace(&rls);
            let s = rls.factor().times(&phi).1;
            let sample = Sample {
                phi,
                y: theta.dot(&phi),
            };
            let innovation = rls.update(&sample, case.dt);
            assert!(innovation.outcome.used());
            let after = rls.distance(&theta);
            let x = case.eta * case.dt;
            let length = if x == 0.0 {
                case.dt
            } else {
                x.exp_m1() / case.eta
            };
            let gamma = weights.gamma();
            let gone = if gamma == 0.0 {
                -(-2.0 * case.c * length * s).exp_m1()
            } else {
                let exponent = 1.0 - 2.0 * case.c / gamma;
                -(exponent * (gamma * length * s).ln_1p()).exp_m1()
            };
            let predicted = (-x).exp() * (before - innovation.epsilon.powi(2) * gone / s);
            // theta has an accuracy of some units in the last place on both sides, which limits the accuracy of V and eps
            let unit = 4.0 * f64::EPSILON * (theta.norm() + start + rls.theta().norm());
            let blur = |v: f64, information: f64| {
                2.0 * unit * (information * v).sqrt() + unit * unit * information
            };
            let in_epsilon = unit * phi.norm();
            let rounding = 1e-12 * before
                + blur(before, information)
                + blur(after, information_trace(&rls))
                + in_epsilon * (2.0 * innovation.epsilon.abs() + in_epsilon) / s;
            Fall {
                before,
                after,
                predicted,
                rounding,
            }
        })
        .collect()
}

/// Trace of `P^-1`, which bounds its norm.
fn information_trace<const P: usize>(rls: &ContinuousRls<P>) -> f64 {
    let unit = |i: usize| SVector::from_fn(|j, _| f64::from(u8::from(i == j)));
    (0..P)
        .map(|i| rls.factor().information_norm(&unit(i)))
        .sum()
}

fn by_size(p: usize, case: Case) -> Vec<Fall> {
    match p {
        1 => fall::<1>(case),
        2 => fall::<2>(case),
        3 => fall::<3>(case),
        4 => fall::<4>(case),
        5 => fall::<5>(case),
        6 => fall::<6>(case),
        7 => fall::<7>(case),
        _ => fall::<8>(case),
    }
}

fn log_range(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn falls_as_predicted(
        p in 1_usize..=8,
        seed in any::<u64>(),
        p0 in log_range(1e-3, 1e8),
        size in log_range(1e-2, 1e2),
        c in log_range(0.1, 10.0),
        ratio in prop_oneof![Just(0.0), Just(1.0), 0.0..1.999],
        eta in prop_oneof![Just(0.0), log_range(1e-4, 1.0)],
        dt in log_range(1e-3, 10.0),
    ) {
        for step in by_size(p, Case { seed, p0, size, c, ratio, eta, dt }) {
            prop_assert!(step.after <= (-eta * dt).exp() * step.before + step.rounding, "{} -> {}", step.before, step.after);
            prop_assert!(
                (step.after - step.predicted).abs() <= step.rounding,
                "V {} -> {}, predicted {} +- {:e}", step.before, step.after, step.predicted, step.rounding
            );
        }
    }
}

#[test]
fn a_gamma_of_twice_c_or_more_is_refused() {
    for (c, gamma) in [
        (1.0, 2.0),
        (1.0, 2.5),
        (0.3, 0.6),
        (1.0, f64::NAN),
        (1.0, -1e-9),
    ] {
        assert!(matches!(
            Weights::new(c, gamma, 0.02),
            Err(Error::Gamma { .. })
        ));
    }
    let message = Weights::new(1.0, 3.0, 0.0).unwrap_err().to_string();
    assert!(
        message.contains("gamma is 3") && message.contains("= 2;"),
        "{message}"
    );
    assert!(Weights::new(1.0, 1.999_999, 0.0).is_ok());
}

/// The exact step for any gamma: with 3 c, the Lyapunov function grows as the equation predicts.
#[test]
fn such_a_gamma_would_let_the_lyapunov_function_grow() {
    let mut rng = rng(5);
    let (c, gamma, h) = (1.0, 3.0, 0.5);
    for _ in 0..100 {
        let p: SMatrix<f64, 3, 3> = spd(&mut rng);
        let (delta, phi): (SVector<f64, 3>, SVector<f64, 3>) =
            (normals(&mut rng), normals(&mut rng));
        let s = (phi.transpose() * p * phi)[0];
        let d = 1.0 + gamma * h * s;
        let epsilon = delta.dot(&phi);
        let after = delta - p * phi * (epsilon * (1.0 - d.powf(-c / gamma)) / s);
        let p_after = p - (p * phi) * (phi.transpose() * p) * (gamma * h / d);
        let before = UdFactor::new(&p).unwrap().information_norm(&delta);
        let grown = UdFactor::new(&p_after).unwrap().information_norm(&after) - before;
        let predicted = epsilon * epsilon * (d.powf(1.0 - 2.0 * c / gamma) - 1.0) / s;
        assert!(predicted > 0.0);
        assert!(
            (grown - predicted).abs() < 1e-9 * (before + predicted),
            "{grown} {predicted}"
        );
    }
}
