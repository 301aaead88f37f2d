//! A sample costs no allocation, neither with a step that is known nor with a new one.

use ct_lti::{Hold, Simulator, StateSpace, StateVariableFilter, TransferFunction};

#[test]
fn per_sample() {
    let g = TransferFunction::from_coefficients(&[1.0, 2.0], &[1.0, 2.0, 3.0, 1.0]).unwrap();
    let mut simulator = Simulator::new(StateSpace::controllable(&g).unwrap(), Hold::First);
    let mut filter = StateVariableFilter::with_bandwidth(3, 2.0, Hold::First).unwrap();
    let mut sum = 0.0;
    let counted = allocation_counter::measure(|| {
        for k in 0..1000 {
            let step = if k % 10 == 0 {
                0.1 + f64::from(k) * 1e-4
            } else {
                0.1
            };
            sum += simulator.update(1.0, step).unwrap_or(f64::NAN);
            sum += filter.update(1.0, step).map_or(f64::NAN, |d| d[3]);
        }
    });
    assert!(sum.is_finite());
    assert_eq!(counted.count_total, 0);
    let counted = allocation_counter::measure(|| {
        assert!(ct_lti::is_hurwitz(&[1.0, 5.0, 9.0, 7.0, 2.0, 0.1]));
        assert!(!ct_lti::is_hurwitz(&[1.0, 5.0, 9.0, 7.0, 20.0, 10.0]));
    });
    assert_eq!(counted.count_total, 0);
    // The counter counts.
    assert!(allocation_counter::measure(|| drop(simulator.clone())).count_total > 0);
}
