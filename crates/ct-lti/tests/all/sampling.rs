//! Exact sampling against 80-digit references and closed forms; two steps against one of twice the length.

use approx::assert_relative_eq;
use ct_lti::{Error, Hold, Polynomial, Simulator, StateSpace, TransferFunction};
use proptest::prelude::*;

fn plant(b: &[f64], a: &[f64]) -> StateSpace {
    StateSpace::controllable(&TransferFunction::from_coefficients(b, a).unwrap()).unwrap()
}

/// Largest error of an entry over the largest entry of the same vector or matrix row.
fn error(found: &[f64], expected: &[f64], width: usize) -> f64 {
    let rows = found.chunks(width).zip(expected.chunks(width));
    rows.map(|(found, expected)| {
        let size = expected.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
        let off = found.iter().zip(expected).map(|(f, e)| (f - e).abs());
        off.fold(0.0, f64::max) / size.max(f64::MIN_POSITIVE)
    })
    .fold(0.0, f64::max)
}

/// The reference is made by `data/sampling.py`. Row by row, so that a slow mode beside a fast one counts.
#[test]
fn against_eighty_digits() {
    let mut lines = include_str!("data/sampling.txt").lines().skip(1);
    let mut cases = 0;
    while let (Some(name), Some(numbers)) = (lines.next(), lines.next()) {
        let mut numbers = numbers.split(' ').map(|x| x.parse::<f64>().unwrap());
        let mut take = |count: usize| -> Vec<f64> { numbers.by_ref().take(count).collect() };
        let (n, h) = (take(1)[0] as usize, take(1)[0]);
        let (a, b) = (take(n * n), take(n));
        let (phi, held, ramp) = (take(n * n), take(n), take(n));
        let system = StateSpace::new(a, b, vec![0.0; n], 0.0).unwrap();
        let zero = system.sampled(Hold::Zero, h).unwrap();
        let first = system.sampled(Hold::First, h).unwrap();
        assert_eq!((&zero.phi, zero.step), (&first.phi, h));
        assert!(zero.g1.iter().all(|g| *g == 0.0));
        let sum: Vec<f64> = first.g0.iter().zip(&first.g1).map(|(a, b)| a + b).collect();
        // A rotation by 1000 rad cannot be known better than its angle; beside modes that are 1e8 times faster, and
        // entry by entry, some digits are lost.
        let bound = match name {
            _ if name.contains("1000 rad") => 3e-13,
            _ if name.starts_with("stiff") => 2e-11,
            _ => 1e-13,
        };
        for (what, off) in [
            ("phi0", error(&zero.phi, &phi, n)),
            ("phi1", error(&zero.g0, &held, 1)),
            ("phi2", error(&first.g1, &ramp, 1)),
            ("first-order hold", error(&sum, &held, 1)),
        ] {
            println!("{name}: {what} {off:.1e}");
            assert!(off < bound, "{name}: {what} is off by {off:e}");
        }
        cases += 1;
    }
    assert_eq!(cases, 16);
}

#[test]
fn closed_forms() {
    // A double integrator: x = (h^2/2, h) under a held 1, (h^3/6, h^2/2) under a ramp to h.
    let h = 0.3;
    let double = StateSpace::new([0.0, 1.0, 0.0, 0.0], [0.0, 1.0], [1.0, 0.0], 0.0).unwrap();
    let held = double.sampled(Hold::Zero, h).unwrap();
    assert_eq!(held.phi, [1.0, h, 0.0, 1.0]);
    assert_relative_eq!(held.g0[0], h * h / 2.0, max_relative = 1e-15);
    let ramp = double.sampled(Hold::First, h).unwrap();
    assert_relative_eq!(ramp.g1[0], h * h / 6.0, max_relative = 1e-15);
    assert_relative_eq!(ramp.g0[0], h * h / 3.0, max_relative = 1e-15);
}

#[test]
fn a_ramp_of_a_lag() {
    // y = K (t - tau (1 - e^(-t/tau))), whatever the steps are.
    let (gain, tau) = (2.5, 3.0);
    let mut lag = Simulator::new(plant(&[gain], &[1.0, tau]), Hold::First);
    let mut t = 0.0;
    lag.update(0.0, f64::NAN).unwrap();
    for step in [0.1, 0.7, 0.1, 2.0, 1e-6, 5.0, 0.7, 0.3, 0.31, 0.1]
        .into_iter()
        .cycle()
        .take(100)
    {
        t += step;
        let y = lag.update(t, step).unwrap();
        assert_relative_eq!(
            y,
            gain * (t + tau * f64::exp_m1(-t / tau)),
            max_relative = 1e-13,
            epsilon = 1e-15
        );
    }
}

#[test]
fn a_biproper_system_jumps_with_its_input() {
    // (1 + 2p)/(1 + p): 2 at once, then towards 1.
    let mut lead = Simulator::new(plant(&[1.0, 2.0], &[1.0, 1.0]), Hold::Zero);
    assert_eq!(lead.update(0.0, 1.0).unwrap(), 0.0);
    assert_eq!(lead.update(1.0, 1.0).unwrap(), 2.0);
    assert_relative_eq!(
        lead.update(1.0, 1.0).unwrap(),
        1.0 + (-1.0_f64).exp(),
        max_relative = 1e-15
    );
}

#[test]
fn what_is_refused_changes_nothing() {
    let mut lag = Simulator::new(plant(&[1.0], &[1.0, 1.0]), Hold::Zero);
    lag.update(1.0, 0.0).unwrap();
    lag.update(1.0, 1.0).unwrap();
    let state = lag.state().to_vec();
    for step in [0.0, -1.0, f64::INFINITY] {
        assert_eq!(lag.update(1.0, step), Err(Error::Step { step }));
    }
    assert!(lag.update(1.0, f64::NAN).is_err());
    assert!(lag.update(f64::NAN, 1.0).is_err());
    assert!(lag.set_state(&[1.0, 2.0]).is_err());
    assert_eq!(lag.state(), state);
    let y = lag.update(1.0, 1.0).unwrap();
    assert_relative_eq!(y, -f64::exp_m1(-2.0), max_relative = 1e-15);
    lag.reset();
    assert_eq!(lag.update(0.0, 1.0).unwrap(), 0.0);
}

#[test]
fn growth_out_of_range_is_an_error() {
    let unstable = plant(&[1.0], &[-1.0, 1.0]);
    assert!(matches!(
        unstable.sampled(Hold::Zero, 1e4),
        Err(Error::Overflow { .. })
    ));
    assert!(matches!(
        unstable.step_response(&[1.0, 1e4]),
        Err(Error::Overflow { .. })
    ));
    let mut growing = Simulator::new(unstable, Hold::Zero);
    growing.update(1.0, 1.0).unwrap();
    let last = (0..2000)
        .map(|_| growing.update(1.0, 1.0))
        .find(Result::is_err);
    assert!(matches!(last, Some(Err(Error::Overflow { .. }))));
    assert!(growing.state()[0].is_finite());
}

#[test]
fn a_stable_system_over_an_endless_step_is_at_rest() {
    let system = plant(&[3.0], &[2.0, 5.0, 4.0, 1.0]);
    for step in [1e3, 1e9, 1e15] {
        let sampled = system.sampled(Hold::Zero, step).unwrap();
        assert!(
            sampled.phi.iter().all(|phi| phi.abs() < 1e-12),
            "{sampled:?}"
        );
        assert_relative_eq!(system.output(&sampled.g0, 0.0), 1.5, max_relative = 1e-12);
    }
}

fn stable() -> impl Strategy<Value = Polynomial> {
    let pairs = prop::collection::vec((0.05..3.0_f64, 0.0..3.0_f64), 1..4);
    (pairs, 0.05..3.0_f64).prop_map(|(pairs, real)| {
        let lag = Polynomial::new([real, 1.0]).unwrap();
        pairs.iter().fold(lag, |product, (re, im)| {
            let pair = Polynomial::new([re * re + im * im, 2.0 * re, 1.0]).unwrap();
            &product * &pair
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Two steps are equivalent to one step of their total length, if the input follows its hold in both.
    #[test]
    fn steps_compose(a in stable(), b in prop::collection::vec(-3.0..3.0_f64, 1..4), h1 in 0.01..2.0_f64, h2 in 0.01..2.0_f64, u0 in -2.0..2.0_f64, u1 in -2.0..2.0_f64) {
        let g = TransferFunction::new(Polynomial::new(b).unwrap(), a).unwrap();
        let system = StateSpace::controllable(&g).unwrap();
        for hold in [Hold::Zero, Hold::First] {
            let u1 = if hold == Hold::Zero { u0 } else { u1 };
            let start: Vec<f64> = (0..system.order()).map(|i| 0.5 - i as f64 * 0.3).collect();
            let mut one = Simulator::new(system.clone(), hold);
            one.set_state(&start).unwrap();
            let mut two = one.clone();
            one.update(u0, 0.0).unwrap();
            one.update(u1, h1 + h2).unwrap();
            two.update(u0, 0.0).unwrap();
            two.update(u0 + (u1 - u0) * h1 / (h1 + h2), h1).unwrap();
            two.update(u1, h2).unwrap();
            let size = one.state().iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            for (a, b) in one.state().iter().zip(two.state()) {
                prop_assert!((a - b).abs() < 1e-12 * size, "{a} {b}");
            }
        }
    }

    /// Held at 1 from rest, the simulation is the step response.
    #[test]
    fn a_held_step_is_the_step_response(a in stable(), b in prop::collection::vec(-3.0..3.0_f64, 1..4), h in 0.01..2.0_f64) {
        let g = TransferFunction::new(Polynomial::new(b).unwrap(), a).unwrap();
        let mut simulator = Simulator::new(StateSpace::controllable(&g).unwrap(), Hold::Zero);
        let times: Vec<f64> = (0..20).map(|k| f64::from(k) * h).collect();
        for y in g.step_response(&times).unwrap() {
            let found = simulator.update(1.0, h).unwrap();
            prop_assert!((found - y).abs() < 1e-11 * (1.0 + y.abs()), "{found} {y}");
        }
    }
}
