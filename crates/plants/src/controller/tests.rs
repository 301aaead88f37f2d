//! Limits, invalid settings, and equivalent forms of one controller.

use super::*;

#[test]
fn the_integral_stands_still_at_a_limit_and_comes_back_at_once() {
    let mut pi = Pi::new(1.0, 10.0, (0.0, 5.0), 2.0).unwrap();
    for _ in 0..1000 {
        assert_eq!(pi.command(20.0, 0.0, 1.0), 5.0);
    }
    // With windup, the command would stay at the limit for a thousand samples.
    assert!(pi.command(0.0, 1.0, 1.0) < 5.0);
}

#[test]
fn impossible_settings_are_refused() {
    assert!(Pi::new(0.0, 1.0, (0.0, 1.0), 0.0).is_err());
    assert!(Pi::new(1.0, 0.0, (0.0, 1.0), 0.0).is_err());
    assert!(Pi::new(1.0, 1.0, (1.0, 1.0), 0.0).is_err());
    assert!(Pi::new(1.0, f64::NAN, (0.0, 1.0), 0.0).is_err());
    let none = (f64::NEG_INFINITY, f64::INFINITY);
    assert!(Controller::sampled(&[1.0], &[], none).is_err());
    assert!(Controller::sampled(&[0.0], &[1.0], none).is_err());
    assert!(Controller::sampled(&[1.0], &[0.0, 1.0], none).is_err());
    assert!(Controller::sampled(&[1.0; 11], &[1.0], none).is_err());
    assert!(Controller::continuous(&[1.0, 0.0, 0.0], &[1.0, 1.0], 1.0, none).is_err());
}

/// A PI controller written as R/S, in q and in p, gives the same commands while nothing is limited.
#[test]
fn a_pi_is_one_of_the_controllers_r_over_s() {
    let (gain, time, h) = (0.7, 30.0, 2.0);
    let none = (f64::NEG_INFINITY, f64::INFINITY);
    let mut pi = Controller::pi(gain, time, none).unwrap().start(&[3.0]);
    let r = [gain, gain * (h / time - 1.0)];
    let mut sampled = Controller::sampled(&r, &[1.0, -1.0], none)
        .unwrap()
        .start(&[3.0]);
    let mut in_p = Controller::continuous(&[gain * time, gain], &[time, 0.0], h, none)
        .unwrap()
        .start(&[3.0]);
    for k in 0..200 {
        let y = (0.3 * f64::from(k)).sin();
        let u = pi.command(1.0, y, h);
        assert!((sampled.command(1.0, y, h) - u).abs() < 1e-12);
        assert!((in_p.command(1.0, y, h) - u).abs() < 1e-9);
    }
}

/// A second-order controller in p against its step response in closed form: `1/(p + a) + 1/(p + b)`.
#[test]
fn a_controller_in_p_is_sampled_exactly() {
    let (a, b, h) = (0.1, 0.4, 1.5);
    let none = (f64::NEG_INFINITY, f64::INFINITY);
    let controller = Controller::continuous(&[2.0, a + b], &[1.0, a + b, a * b], h, none).unwrap();
    let mut regulator = controller.start::<f64>(&[]);
    for k in 0..50 {
        let t = h * f64::from(k);
        let wanted = (1.0 - (-a * t).exp()) / a + (1.0 - (-b * t).exp()) / b;
        assert!((regulator.command(1.0, 0.0, h) - wanted).abs() < 1e-10);
    }
}

#[test]
fn the_linear_controller_is_the_one_that_runs() {
    let wide = (-1e9, 1e9);
    for controller in [
        Controller::pi(0.7, 30.0, wide).unwrap(),
        Controller::sampled(&[1.0, -0.8, 0.1], &[1.0, -1.3, 0.3], wide).unwrap(),
        Controller::sampled(&[1.0, -0.8], &[1.0, -0.3, 0.1], wide).unwrap(),
        Controller::sampled(&[2.0], &[1.0], wide).unwrap(),
    ] {
        let linear = controller.linear(2.0);
        let mut x: Vec<f64> = (0..controller.states()).map(|i| 1.0 + i as f64).collect();
        let mut regulator = controller.start(&x);
        for k in 0..30 {
            let e = (0.5 * f64::from(k)).cos();
            let u: f64 = linear.c.iter().zip(&x).map(|(c, x)| c * x).sum::<f64>() + linear.d * e;
            let given = regulator.command(e, 0.0, 2.0);
            // The operating point is added outside the recursion.
            assert!((given - u).abs() < 1e-9, "{controller:?} {k}: {given} {u}");
            x = linear
                .a
                .iter()
                .zip(&linear.b)
                .map(|(row, b)| row.iter().zip(&x).map(|(a, x)| a * x).sum::<f64>() + b * e)
                .collect();
        }
    }
}

#[test]
fn an_integral_that_is_updated_first_is_another_controller() {
    let (gain, time, h) = (0.7, 30.0, 2.0);
    let none = (f64::NEG_INFINITY, f64::INFINITY);
    let given = Controller::pi(gain, time, none).unwrap();
    let other = given.with_integral_first().unwrap();
    assert!(other.with_integral_first().is_none());
    // The linear form of both agrees with the running controller.
    for controller in [given, other] {
        let (linear, mut running) = (controller.linear(h), controller.start(&[3.0]));
        let mut integral = 3.0;
        for k in 0..20 {
            let error = (f64::from(k) * 0.7).sin();
            let command = running.command(error, 0.0, h);
            assert!((command - (integral + linear.d * error)).abs() < 1e-12);
            integral += linear.b[0] * error;
        }
    }
}

#[test]
fn the_reading_behind_a_command_is_found() {
    let limits = (-2.0, 8.0);
    let pi = Controller::pi(0.7, 30.0, limits).unwrap();
    let in_p = Controller::continuous(&[21.0, 0.7], &[30.0, 0.0], 4.0, limits).unwrap();
    let without_integral = Controller::sampled(&[0.9, -0.5], &[1.0, -0.4], limits).unwrap();
    let first = pi.with_integral_first().unwrap();
    for controller in [pi, first, in_p, without_integral] {
        let mut running = controller.start(&[1.0, 0.5]);
        let mut found = 0;
        for k in 0..60 {
            let (reference, reading) = (1.0, (f64::from(k) * 0.4).sin() * 3.0);
            let before = running.clone();
            let command = running.command(reference, reading, 4.0);
            if let Some(again) = before.reading_for(reference, command, 4.0) {
                assert!((again - reading).abs() < 1e-9, "{controller:?}, {k}");
                found += 1;
            }
        }
        assert!(found > 20, "{controller:?}: {found}");
    }
    // A command that depends on earlier readings only says nothing of the present one.
    let late = Controller::sampled(&[0.0, 2.0], &[1.0, -1.0], limits).unwrap();
    assert!(late.start(&[1.0]).reading_for(1.0, 0.5, 4.0).is_none());
}
