//! Connections against the algebra of complex gains, step responses against closed forms.

use approx::assert_relative_eq;
use ct_lti::{Complex64, Error, Polynomial, StateSpace, TransferFunction};
use proptest::prelude::*;

fn tf(b: &[f64], a: &[f64]) -> TransferFunction {
    TransferFunction::from_coefficients(b, a).unwrap()
}

#[test]
fn step_responses_in_closed_form() {
    let times = [0.0, 0.01, 0.5, 1.0, 7.0, 300.0];
    let lag = tf(&[6.0], &[1.0, 110.0]);
    for (t, y) in times.into_iter().zip(lag.step_response(&times).unwrap()) {
        assert_relative_eq!(y, -6.0 * f64::exp_m1(-t / 110.0), max_relative = 2e-15);
    }
    // wn = 2, damping 0.1.
    let (w, d) = (2.0_f64, 0.1_f64);
    let pair = tf(&[w * w], &[w * w, 2.0 * d * w, 1.0]);
    let wd = w * (1.0 - d * d).sqrt();
    for (t, y) in times.into_iter().zip(pair.step_response(&times).unwrap()) {
        let decay = (-d * w * t).exp();
        let expected = 1.0 - decay * ((wd * t).cos() + d * w / wd * (wd * t).sin());
        assert_relative_eq!(y, expected, epsilon = 1e-13, max_relative = 1e-12);
    }
    // A triple pole, and an integrator.
    for (t, y) in times.into_iter().zip(
        tf(&[1.0], &[1.0, 3.0, 3.0, 1.0])
            .step_response(&times)
            .unwrap(),
    ) {
        let expected = 1.0 - (-t).exp() * (1.0 + t + t * t / 2.0);
        assert_relative_eq!(y, expected, epsilon = 1e-15);
    }
    assert_eq!(
        tf(&[2.0], &[0.0, 1.0]).step_response(&[1.5]).unwrap(),
        [3.0]
    );
}

#[test]
fn the_loop_of_a_lag_and_a_pi_controller() {
    // c0 = Ki K, c1 = 1 + K Kp, c2 = tau.
    let (gain, tau, kp, ki) = (6.0, 110.0, 0.5, 0.02);
    let plant = tf(&[gain], &[1.0, tau]);
    let controller = tf(&[ki, kp], &[0.0, 1.0]);
    let unit = tf(&[1.0], &[1.0]);
    let closed = plant.series(&controller).unwrap().feedback(&unit).unwrap();
    assert_eq!(
        closed.denominator().coefficients(),
        [ki * gain, 1.0 + gain * kp, tau]
    );
    assert_eq!(closed.dc_gain(), Some(1.0));
    assert!(closed.is_stable());
    assert_eq!(controller.dc_gain(), None);
    // From a disturbance at the input of the plant: the static gain is zero.
    assert_eq!(plant.feedback(&controller).unwrap().dc_gain(), Some(0.0));
}

#[test]
fn what_cannot_be_is_refused() {
    let p = Polynomial::p();
    let improper = TransferFunction::new(&p * &p, &p + &Polynomial::one());
    let (numerator, denominator) = (2, 1);
    assert_eq!(
        improper,
        Err(Error::Improper {
            numerator,
            denominator
        })
    );
    assert!(TransferFunction::new(p, Polynomial::zero()).is_err());
    let (plus, minus) = (tf(&[1.0], &[1.0]), tf(&[-1.0], &[1.0]));
    assert!(matches!(
        plus.feedback(&minus),
        Err(Error::AlgebraicLoop { .. })
    ));
    let spaces = [&plus, &minus].map(|g| StateSpace::controllable(g).unwrap());
    assert!(matches!(
        spaces[0].feedback(&spaces[1]),
        Err(Error::AlgebraicLoop { .. })
    ));
    let huge = tf(&[1e300], &[1.0]);
    assert!(matches!(huge.series(&huge), Err(Error::Overflow { .. })));
    assert!(Polynomial::new([f64::NAN]).is_err());
    let message = Polynomial::new([1.0, f64::INFINITY])
        .unwrap_err()
        .to_string();
    assert_eq!(message, "a polynomial: entry 1 is inf; give finite numbers");
}

#[test]
fn at_any_frequency() {
    let g = tf(&[1.0, 2.0], &[1.0, 3.0, 4.0]);
    assert_eq!(g.at_frequency(0.0), Complex64::new(1.0, 0.0));
    assert_eq!(g.at_frequency(f64::INFINITY), Complex64::new(0.0, 0.0));
    assert_eq!(
        tf(&[1.0, 6.0], &[1.0, 3.0]).at_frequency(f64::INFINITY).re,
        2.0
    );
    let high = g.at_frequency(1e200);
    assert_relative_eq!(high.im, -0.5e-200, max_relative = 1e-14);
}

#[test]
fn poles_and_zeros() {
    let g = tf(&[-6.0, 1.0, 1.0], &[4.0, 0.0, 1.0]);
    let zeros: Vec<f64> = g.zeros().unwrap().iter().map(|z| z.re).collect();
    assert_eq!(zeros, [-3.0, 2.0]);
    assert_eq!(
        g.poles().unwrap(),
        [Complex64::new(0.0, -2.0), Complex64::new(0.0, 2.0)]
    );
    assert!(tf(&[], &[1.0, 1.0]).zeros().unwrap().is_empty());
}

fn any_tf() -> impl Strategy<Value = TransferFunction> {
    (1..4_usize).prop_flat_map(|n| {
        let numerator = prop::collection::vec(-2.0..2.0_f64, 1..=n + 1);
        let denominator = prop::collection::vec(0.3..2.0_f64, n + 1);
        (numerator, denominator).prop_map(|(b, a)| tf(&b, &a))
    })
}

fn close(a: Complex64, b: Complex64) -> bool {
    (a - b).norm() <= 1e-10 * (1.0 + a.norm() + b.norm())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn connections_are_those_of_the_gains(g in any_tf(), h in any_tf(), w in 0.0..5.0_f64) {
        let (one, two) = (g.at_frequency(w), h.at_frequency(w));
        let loop_gain = Complex64::new(1.0, 0.0) + one * two;
        prop_assume!(loop_gain.norm() > 1e-2 && (1.0 + g.direct_term() * h.direct_term()).abs() > 1e-2);
        prop_assume!(one.norm() < 1e3 && two.norm() < 1e3);
        prop_assert!(close(g.series(&h).unwrap().at_frequency(w), one * two));
        prop_assert!(close(g.parallel(&h).unwrap().at_frequency(w), one + two));
        prop_assert!(close(g.feedback(&h).unwrap().at_frequency(w), one / loop_gain));
    }

    /// Both connections of the same systems have the same step response.
    #[test]
    fn connections_of_states_are_those_of_polynomials(g in any_tf(), h in any_tf()) {
        prop_assume!((1.0 + g.direct_term() * h.direct_term()).abs() > 0.1);
        let [a, b] = [&g, &h].map(|g| StateSpace::controllable(g).unwrap());
        let times = [0.0, 0.3, 1.0, 2.0];
        for (states, polynomials) in [
            (a.series(&b), g.series(&h)),
            (a.parallel(&b), g.parallel(&h)),
            (a.feedback(&b), g.feedback(&h)),
        ] {
            let states = states.unwrap().step_response(&times).unwrap();
            let polynomials = polynomials.unwrap().step_response(&times).unwrap();
            for (x, y) in states.iter().zip(&polynomials) {
                prop_assert!((x - y).abs() < 1e-8 * (1.0 + x.abs()), "{states:?} {polynomials:?}");
            }
        }
    }
}
