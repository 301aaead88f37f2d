//! The error of a simulation and its tolerance.

use ct_model::{Dual, Scalar, Simulation};

use crate::simulated::steps;
use crate::support::{Case, model};

#[test]
fn the_error_follows_the_tolerance() {
    // A motor whose friction has a sharp bend, with many steps in each interval.
    let model = model(
        "model Motor
  parameter Real gain = 100;
  parameter Real b = 2;
  parameter Real c = 120;
  input Real u;
  output Real w(start=0);
equation
  der(w) = gain*u - b*w - c*tanh(w/2);
end Motor;",
    );
    let parameters = model.parameters();
    let run = |tolerance: Option<f64>| -> Vec<f64> {
        let mut simulation = Simulation::new(&model, &parameters, &[0.0], 0.0);
        if let Some(tolerance) = tolerance {
            simulation = simulation.with_tolerance(tolerance);
        }
        let mut y = [0.0];
        let rows = (0..60).map(|k| {
            let u = [steps(k)];
            simulation.read(&u, &mut y);
            simulation
                .advance(&u, &u, 0.5 * (f64::from(k as u32) + 1.0))
                .unwrap();
            y[0]
        });
        rows.collect()
    };
    let fine = run(Some(1e-13));
    let largest = fine
        .iter()
        .fold(0.0, |largest: f64, w| largest.max(w.abs()));
    let error = |rows: &[f64]| {
        let pairs = rows.iter().zip(&fine);
        pairs.map(|(w, fine)| (w - fine).abs()).fold(0.0, f64::max) / largest
    };
    assert_eq!(run(None), run(Some(ct_model::TOLERANCE)));
    let errors = [1e-4, 1e-7, 1e-10].map(|tolerance| error(&run(Some(tolerance))));
    for (error, most) in errors.into_iter().zip([1e-2, 1e-5, 1e-8]) {
        assert!(error < most, "{errors:?}");
    }
    assert!(
        errors[0] > 1e2 * errors[1] && errors[1] > 1e2 * errors[2],
        "{errors:?}"
    );
}

/// Two tanks whose upper one overflows at times, sampled in short intervals.
fn short_intervals(lines: bool) -> Case {
    let text = "model Tanks
  parameter Real k = 3;
  parameter Real a = 6;
  parameter Real b = 5;
  parameter Real rim = 9;
  input Real u;
  output Real h2(start=6);
  Real h1(start=4);
equation
  30*der(h1) = k*u - a*sqrt(max(h1, 0)) - (if h1 > rim then 20*(h1 - rim) else 0);
  30*der(h2) = a*sqrt(max(h1, 0)) - b*sqrt(max(h2, 0));
end Tanks;";
    let mut case = Case::new(text, 400, 0.4, |k| vec![steps(k / 4) + 0.5]);
    case.lines = lines;
    case
}

#[test]
fn short_intervals_are_as_accurate_with_steps_of_order_four() {
    for lines in [false, true] {
        let mut case = short_intervals(lines);
        let parameters = case.model.parameters();
        let by = |i: usize, value: &f64| Dual::<4>::variable(*value, i);
        let by: Vec<_> = parameters
            .iter()
            .enumerate()
            .map(|(i, p)| by(i, p))
            .collect();
        let initial = [6.0, 4.0].map(Dual::constant);
        let mut at = |tolerance: f64| {
            case.tolerance = tolerance;
            case.run(&by, &initial).0
        };
        let (fine, own) = (at(1e-13), at(1e-7));
        let largest = |of: &dyn Fn(&Dual<4>) -> f64| {
            let rows = fine.iter().map(|row| of(&row[0]).abs());
            rows.fold(0.0, f64::max)
        };
        let error = |of: &dyn Fn(&Dual<4>) -> f64| {
            let pairs = own.iter().zip(&fine);
            let errors = pairs.map(|(own, fine)| (of(&own[0]) - of(&fine[0])).abs());
            errors.fold(0.0, f64::max) / largest(of)
        };
        assert!(error(&|y| y.re) < 1e-6);
        for i in 0..4 {
            assert!(error(&|y| y.eps[i]) < 1e-5, "{}", error(&|y| y.eps[i]));
        }
        // With a smaller tolerance than 1e-8 all steps are of order five.
        assert_ne!(at(1e-8), at(0.999e-8));
    }
}

#[test]
fn the_error_of_order_four_is_of_order_four() {
    // As many intervals as the record is refined: every interval is one step, so that the error falls with the fourth power of its length.
    let text =
        "model Decay input Real u; output Real x(start=1); equation der(x) = u - x^2; end Decay;";
    let error = |rows: usize| {
        let mut case = Case::new(text, rows + 1, 1.0 / rows as f64, |k| {
            // A change of the input ends a span over several intervals.
            vec![1e-100 * (k % 2) as f64]
        });
        case.tolerance = 1e-4;
        let (rows, _) = case.plain();
        (rows[rows.len() - 1][0] - 0.5).abs()
    };
    for rows in [8, 16, 32] {
        let ratio = error(rows) / error(2 * rows);
        assert!((12.0..22.0).contains(&ratio), "{rows}: {ratio}");
    }
}

#[test]
fn what_moves_within_an_interval_is_as_accurate() {
    // The states do not act on their slopes: an error estimate from slopes at one time would not see these errors.
    let waves = "model Waves
  parameter Real c = 1e-5;
  input Real u;
  output Real fast(start=0);
  output Real slow(start=20);
  output Real volume(start=0);
equation
  der(fast) = sin(6.283185307179586*time/1.25);
  der(slow) = c*(25 - slow^2) + 0.02*sin(1.5707963267948966*time);
  der(volume) = sqrt(u + 0.1);
end Waves;";
    let mut case = Case::new(waves, 60, 1.0, |k| vec![(k % 2) as f64]);
    case.lines = true;
    let fine = case.plain().0;
    case.tolerance = 1e-7;
    for output in 0..3 {
        let range = Case::range(&fine, output);
        for (own, fine) in case.plain().0.iter().zip(&fine) {
            let error = (own[output] - fine[output]).abs();
            assert!(error < 1e-5 * range, "output {output}: {error} of {range}");
        }
    }
}
