//! For any input there is no panic: the result is a number, an error, or "no".

use ct_lti::{
    Complex64, Hold, Polynomial, Simulator, StateSpace, StateVariableFilter, TransferFunction,
};
use proptest::prelude::*;

/// Any bit pattern, and the awkward ones often.
fn any_number() -> impl Strategy<Value = f64> {
    let awkward = vec![
        0.0,
        -0.0,
        1.0,
        -1.0,
        f64::NAN,
        f64::INFINITY,
        f64::MAX,
        f64::MIN,
        f64::MIN_POSITIVE,
        f64::from_bits(1),
        1e-200,
        1e200,
    ];
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        prop::sample::select(awkward),
        -10.0..10.0_f64
    ]
}

fn any_numbers() -> impl Strategy<Value = Vec<f64>> {
    let finite = prop_oneof![
        any_number().prop_map(|x| if x.is_finite() { x } else { 1.0 }),
        -10.0..10.0_f64
    ];
    prop_oneof![
        prop::collection::vec(any_number(), 0..8),
        prop::collection::vec(finite, 0..8)
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn of_polynomials(a in any_numbers(), b in any_numbers(), x in any_number()) {
        let _ = Polynomial::from_roots(&a.iter().map(|a| Complex64::new(*a, x)).collect::<Vec<_>>(), x);
        let (Ok(a), Ok(b)) = (Polynomial::new(a), Polynomial::new(b)) else { return Ok(()) };
        for p in [&a + &b, &a * &b, &a - &b, a.pow(3), a.shifted(x), a.scaled(x), a.derivative()] {
            let (_, _, _) = (p.is_hurwitz(), p.decays_faster_than(x), p.to_string());
            let _ = (p.eval(x), p.at_frequency(x), p.eval_complex(Complex64::new(x, x)), p.div_rem(&b));
            if let Ok(roots) = p.roots() {
                prop_assert_eq!(Some(roots.len()), p.degree());
                prop_assert!(roots.iter().all(|z| z.re.is_finite() && z.im.is_finite()));
            }
        }
    }

    #[test]
    fn of_systems(a in any_numbers(), b in any_numbers(), x in any_number(), step in any_number()) {
        let Ok(g) = TransferFunction::from_coefficients(&b, &a) else { return Ok(()) };
        let _ = (g.exceeds(x), g.exceeds(0.0), g.poles(), g.zeros(), g.dc_gain(), g.at_frequency(x));
        if let Ok(responses) = g.step_response(&[0.0, x, step]) {
            prop_assert!(responses.iter().all(|y| y.is_finite()));
        }
        for h in [g.feedback(&g), g.series(&g), g.parallel(&g)].into_iter().flatten() {
            let _ = (h.exceeds(x), h.is_stable());
        }
        let Ok(states) = StateSpace::controllable(&g) else { return Ok(()) };
        let _ = (states.feedback(&states), states.series(&states), states.parallel(&states));
        let mut simulator = Simulator::new(states, Hold::First);
        for (u, step) in [(1.0, 1.0), (x, step), (1.0, 1.0), (x, 0.5)] {
            let before = simulator.state().to_vec();
            match simulator.update(u, step) {
                Ok(y) => prop_assert!(y.is_finite()),
                Err(_) => prop_assert_eq!(simulator.state(), before),
            }
            prop_assert!(simulator.state().iter().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn of_filters(e in any_numbers(), x in any_number(), step in any_number()) {
        let Ok(e) = Polynomial::new(e) else { return Ok(()) };
        let Ok(mut filter) = StateVariableFilter::new(&e, Hold::Zero) else { return Ok(()) };
        for (u, step) in [(1.0, 1.0), (x, step), (1.0, 1.0), (x, 0.5)] {
            let before = filter.derivatives().to_vec();
            match filter.update(u, step) {
                Ok(derivatives) => prop_assert!(derivatives.iter().all(|d| d.is_finite())),
                Err(_) => prop_assert_eq!(filter.derivatives(), before),
            }
        }
    }
}
