//! Steps over several sampling intervals: inputs that are held for many samples.

use ct_model::{Dual, Scalar, Simulation};

use crate::simulated::steps;
use crate::support::{Case, model};

/// Two tanks with inputs that are held for 40 samples, an overflow that begins and ends within them, and outputs that are not the states.
const TANKS: &str = "model Tanks
  parameter Real k = 3;
  parameter Real a = 6;
  parameter Real b = 5;
  parameter Real rim = 9;
  input Real u;
  output Real y = h2 + 0.1*u*rim;
  output Real spill = if h1 > rim then 20*(h1 - rim) else 0;
  Real h1(start=4);
  Real h2(start=6);
equation
  30*der(h1) = k*u - a*sqrt(max(h1, 0)) - spill;
  30*der(h2) = a*sqrt(max(h1, 0)) - b*sqrt(max(h2, 0));
end Tanks;";

fn tanks(tolerance: f64, irregular: bool) -> Case {
    let mut case = Case::new(TANKS, 800, 0.4, |k| vec![2.0 * steps(k / 4) + 3.0]);
    if irregular {
        for (k, time) in case.time.iter_mut().enumerate() {
            *time += 0.1 * (k as f64).sin();
        }
    }
    case.tolerance = tolerance;
    case
}

fn with_derivatives(case: &Case) -> Vec<Vec<Dual<4>>> {
    let parameters = case.model.parameters();
    let by = parameters.iter().enumerate();
    let by: Vec<_> = by.map(|(i, p)| Dual::variable(*p, i)).collect();
    case.run(&by, &[4.0, 6.0].map(Dual::constant)).0
}

/// Largest difference of two simulations as a share of the largest value.
fn difference(a: &[Vec<Dual<4>>], b: &[Vec<Dual<4>>], of: impl Fn(Dual<4>) -> f64) -> f64 {
    let pairs = || a.iter().flatten().zip(b.iter().flatten());
    let largest = pairs().fold(0.0, |most: f64, (_, b)| most.max(of(*b).abs()));
    let differences = pairs().map(|(a, b)| (of(*a) - of(*b)).abs());
    differences.fold(0.0, f64::max) / largest
}

#[test]
fn values_and_derivatives_are_as_accurate_as_the_tolerance() {
    for irregular in [false, true] {
        let fine = with_derivatives(&tanks(1e-13, irregular));
        assert!(fine.iter().any(|y| y[1].re > 1.0), "nothing overflows");
        for (tolerance, most) in [(1e-5, 1e-4), (1e-7, 1e-6), (1e-10, 1e-9)] {
            let own = with_derivatives(&tanks(tolerance, irregular));
            let error = difference(&own, &fine, |y| y.re);
            assert!(error < most, "{tolerance}: {error}");
            for lane in 0..4 {
                let error = difference(&own, &fine, |y| y.eps[lane]);
                assert!(error < 10.0 * most, "{tolerance}, lane {lane}: {error}");
            }
        }
    }
}

/// Inputs that differ by next to nothing from sample to sample prevent long steps.
#[test]
fn long_steps_are_taken_where_inputs_are_held() {
    let held = tanks(1e-7, false);
    let mut moving = tanks(1e-7, false);
    for (k, u) in moving.inputs.iter_mut().enumerate() {
        u[0] += 1e-15 * (k % 2) as f64;
    }
    let (held, moving) = (with_derivatives(&held), with_derivatives(&moving));
    assert!(difference(&held, &moving, |y| y.re) > 1e-11);
    assert!(difference(&held, &moving, |y| y.re) < 1e-6);
}

#[test]
fn readings_with_other_inputs_change_nothing() {
    let case = tanks(1e-7, false);
    let parameters = case.model.parameters();
    let undisturbed = case.run(&parameters, &[4.0, 6.0]).0;
    let mut simulation =
        Simulation::new(&case.model, &parameters, &[4.0, 6.0], 0.0).with_tolerance(1e-7);
    let (mut y, mut other) = ([0.0; 2], [0.0; 2]);
    for (k, expected) in undisturbed.iter().enumerate().take(700) {
        let u = &case.inputs[k];
        if k % 37 == 0 {
            // The next interval follows a reading with other inputs.
            simulation.read(&[u[0] + 1.0], &mut other);
            assert!((other[0] - expected[0] - 0.9).abs() < 1e-5);
        } else {
            for _ in 0..1 + k % 2 {
                simulation.read(u, &mut y);
                for (y, expected) in y.iter().zip(expected) {
                    assert!((y - expected).abs() < 1e-5, "{k}: {y} {expected}");
                }
            }
        }
        simulation.advance(u, u, case.time[k + 1]).unwrap();
    }
}

/// A pulse after a long rest, in a text that reads the time.
#[test]
fn a_pulse_after_a_rest_is_seen() {
    let text = "model Pulse
  input Real u;
  output Real x(start=1);
equation
  der(x) = 0.01*(u - x) + exp(-((time - 500)/5)^2);
end Pulse;";
    let mut case = Case::new(text, 800, 1.0, |_| vec![1.0]);
    case.tolerance = 1e-6;
    let rows = case.plain().0;
    let exact = 1.0 + 5.0 * std::f64::consts::PI.sqrt();
    assert!((rows[515][0] - exact).abs() < 1.5, "{}", rows[515][0]);
}

/// A state that reaches a bound exactly at a sample: the reading is that of the branch for this sample.
#[test]
fn a_bound_that_is_reached_at_a_sample_holds_there() {
    let text = "model Ramp
  input Real u;
  output Real y = if x >= 20 then 1 else 0;
  output Real z = if w == 4 then 1 else 0;
  Real x(start=0);
  Real w(start=4);
equation
  der(x) = u;
  der(w) = 0*x^2;
end Ramp;";
    let mut case = Case::new(text, 60, 0.5, |_| vec![1.0]);
    case.tolerance = 1e-7;
    for (row, t) in case.plain().0.iter().zip(&case.time) {
        if (t - 20.0).abs() > 1e-9 || row[0] == 1.0 {
            assert_eq!(row[0], f64::from(u8::from(*t >= 20.0 - 1e-9)), "{t}");
        }
        assert_eq!(row[1], 1.0, "{t}");
    }
}

/// The state of an effect that is absent is zero, whatever its time constant; its derivative is not.
#[test]
fn what_is_absent_and_fast_has_exact_derivatives() {
    let text = "model Lag
  parameter Real c = 0;
  input Real u;
  output Real y = x + z;
  Real x(start=1);
  Real z(start=0);
  Real s(start=0);
  Real c4(start=1);
equation
  der(x) = 0.01*(u - x^2);
  der(s) = 4*c4;
  der(c4) = -4*s;
  der(z) = c*u*s - 2*z;
end Lag;";
    let mut case = Case::new(text, 200, 0.5, |k| vec![1.0 + (k / 50) as f64]);
    case.tolerance = 1e-7;
    let rows = case
        .run(
            &[Dual::<2>::variable(0.0, 0)],
            &[1.0, 0.0, 0.0, 1.0].map(Dual::constant),
        )
        .0;
    // One long before the sample, the sine's response at a rate of 2 and a frequency of 4.
    for (k, row) in rows.iter().enumerate().skip(40) {
        let t = case.time[k];
        let since_change = t - 25.0 * (t / 25.0).floor();
        if since_change < 10.0 {
            continue;
        }
        let gain = 1.0 + (k / 50) as f64;
        let exact = gain * (2.0 * (4.0 * t).sin() - 4.0 * (4.0 * t).cos()) / 20.0;
        assert!(
            (row[0].eps[0] - exact).abs() < 1e-3,
            "{t}: {} {exact}",
            row[0].eps[0]
        );
    }
}

#[test]
fn a_model_without_value_at_a_sample_fails_there() {
    let model = model(
        "model Falls input Real u; output Real h(start=1); equation der(h) = u - 0.1/sqrt(h); end Falls;",
    );
    let mut simulation = Simulation::new(&model, &[], &[1.0], 0.0).with_tolerance(1e-7);
    let failure = (0..200).find_map(|k| {
        let until = 0.05 * f64::from(k + 1);
        simulation.advance(&[0.0], &[0.0], until).err()
    });
    // h^1.5 = 1 - 0.15 t
    let time = failure.unwrap().time;
    assert!((6.5..6.7).contains(&time), "{time}");
}
