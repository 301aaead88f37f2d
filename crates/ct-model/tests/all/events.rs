//! Models with branches: outputs against an adaptive solver or a fine reference, derivatives against central differences.

use ct_model::{Dual, Method, Model, ModelSpec, Scalar};

use crate::support::{Case, check_outside, model};

/// A mass on a spring, swinging, with a force that has branches, and a store that takes it up. A force that jumps does so by the place:
/// nothing slides.
fn swinging(term: &str) -> Case {
    let text = format!(
        r#"
model Swinging
  parameter Real w2 = 0.36;
  parameter Real c = 0.06;
  parameter Real limit = 0.35;
  input Real u;
  output Real y = x;
  output Real z = s;
  Real x(start=1);
  Real v(start=0.1);
  Real s(start=0.2);
equation
  der(x) = v;
  der(v) = -w2*x + 0.3*u - c*({term});
  der(s) = ({term}) - 0.2*s;
end Swinging;"#
    );
    // Held for slightly more than a second, so that rows and turning points are at different times.
    Case::new(&text, 60, 1.13, |k| {
        vec![f64::from(u8::from(k / 9 % 2 == 0))]
    })
}

#[test]
fn every_kind_of_branch() {
    for term in [
        "sign(x - limit)",
        "abs(v - limit)",
        "min(v, limit) + 0.1*v",
        "max(x, -limit)*max(v, 0)",
        "if x > limit then 1 + v else 0.3*v",
        "if x > limit and not x > 3*limit then 1 else if x > 0.5 or x < -limit then -0.5 else 0.2",
        "if u > 0.5 then max(v, limit) else v",
        "max(min(v, limit), -limit)",
        "sign(sin(3*time + limit))",
    ] {
        println!("{term}");
        let case = swinging(term);
        check_outside(&case, 1e-7);
        case.check_derivatives(1e-5);
        let mut lines = swinging(term);
        lines.lines = true;
        check_outside(&lines, 1e-7);
        lines.check_derivatives(1e-5);
    }
}

/// More combinations of branches than a simulation remembers, which come again in any order.
#[test]
fn branches_that_come_again() {
    let text = |frequencies: &[f64]| {
        let (mut declared, mut equations) = (String::new(), String::new());
        for (i, w) in frequencies.iter().enumerate() {
            declared += &format!("  output Real x{i}(start=1);\n");
            equations += &format!("  der(x{i}) = u*max(sin({w}*time), 0) - 0.1*x{i};\n");
        }
        format!("model Several\n  input Real u;\n{declared}equation\n{equations}end Several;")
    };
    let inputs: Vec<f64> = (0..200).map(|k| 1.0 + f64::from(k / 7 % 3)).collect();
    let simulated = |frequencies: &[f64]| {
        let model = Model::new(ModelSpec::parse(&text(frequencies)).unwrap());
        model
            .simulate(&model.parameters(), 0.7, &[&inputs])
            .unwrap()
    };
    let frequencies = [0.31, 0.47, 0.83, 1.13, 1.71];
    let together = simulated(&frequencies);
    for (i, w) in frequencies.iter().enumerate() {
        let alone = &simulated(&[*w])[0];
        let apart = together[i].iter().zip(alone).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-8, "{w}");
    }
}

/// Two tanks that have run empty fill again: the lower level rises from zero with a slope of zero.
#[test]
fn empty_tanks_fill_again() {
    let text = "model Tanks
       input Real u;
       output Real a(start=1);
       output Real b(start=1);
       Real q;
     equation
       q = sqrt(max(a, 0));
       der(a) = u - q;
       der(b) = q - sqrt(max(b, 0));
     end Tanks;";
    let model = model(text);
    let inputs: Vec<f64> = (0..60).map(|k| f64::from(u8::from(k >= 20))).collect();
    let simulated = model.simulate(&[], 0.5, &[&inputs]).unwrap();
    for level in &simulated {
        assert!(level[20].abs() < 1e-9, "{}", level[20]);
        assert!(level.iter().all(|h| *h > -1e-9));
    }
    // A fine reference from the moment that the inflow begins.
    let (mut a, mut b) = (0.0_f64, 0.0_f64);
    let parts = 200_000;
    let step = 0.5 / f64::from(parts);
    let levels = simulated[0].iter().zip(&simulated[1]).enumerate().skip(21);
    for (k, (upper, lower)) in levels {
        for _ in 0..parts {
            // The midpoint rule.
            let slopes = |a: f64, b: f64| {
                let q = a.max(0.0).sqrt();
                (1.0 - q, q - b.max(0.0).sqrt())
            };
            let (da, db) = slopes(a, b);
            let (da, db) = slopes(a + 0.5 * step * da, b + 0.5 * step * db);
            (a, b) = (a + step * da, b + step * db);
        }
        assert!((upper - a).abs() < 1e-6, "{k}: {upper} {a}");
        assert!((lower - b).abs() < 1e-6, "{k}: {lower} {b}");
    }
}

#[test]
fn a_branch_behind_a_delay() {
    let text = r#"
model Behind
  parameter Real d = 1.7;
  parameter Real e = 0.9;
  parameter Real limit = 0.4;
  input Real u;
  output Real y = x;
  Real x(start=0.2);
equation
  der(x) = (if delay(x, e) > limit then -0.7 else 0.9*delay(u, d)) - 0.1*x + 0.2*max(delay(u, d) - 0.5, 0);
end Behind;"#;
    let case = Case::new(text, 80, 0.51, |k| vec![(k / 7 % 3) as f64 * 0.7]);
    case.check_derivatives(1e-5);
}

/// `tau x' = K u(t - d) - x`, `4 w' = x(t - e) - w - 0.1 w^2` by the classical Runge-Kutta method in steps that divide rows and both
/// delays.
fn late_reference(inputs: &[f64], parts: usize, (d, e): (usize, usize)) -> Vec<f64> {
    let h = 1.0 / parts as f64;
    let (k, tau) = (2.0, 7.0);
    // Half steps, so that the middle of a step is available.
    let (mut x, mut w) = (vec![1.0_f64], 1.0_f64);
    let input = |half: isize| {
        let row = half.div_euclid(2 * parts as isize).max(0) as usize;
        inputs[row.min(inputs.len() - 1)]
    };
    let mut read = vec![w];
    for step in 0..(inputs.len() - 1) * parts {
        let u = input(2 * step as isize - 2 * d as isize);
        // Linear with a held input: exact.
        let decayed = |from: f64, time: f64| k * u + (from - k * u) * f64::exp(-time / tau);
        let from = x[2 * step];
        x.push(decayed(from, 0.5 * h));
        x.push(decayed(from, h));
        let late = |half: usize| {
            if half < 2 * e { 1.0 } else { x[half - 2 * e] }
        };
        let slope = |w: f64, late: f64| (late - w - 0.1 * w * w) / 4.0;
        let [a, b, c] = [0, 1, 2].map(|half| late(2 * step + half));
        let k1 = slope(w, a);
        let k2 = slope(w + 0.5 * h * k1, b);
        let k3 = slope(w + 0.5 * h * k2, b);
        let k4 = slope(w + h * k3, c);
        w += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
        if (step + 1) % parts == 0 {
            read.push(w);
        }
    }
    read
}

#[test]
fn delays_of_inputs_and_states_agree_with_a_fine_reference() {
    let text = r#"
model Late
  parameter Real d = 3.3;
  parameter Real e = 2.1;
  input Real u;
  output Real y = w;
  Real x(start=1);
  Real w(start=1);
equation
  7*der(x) = 2*delay(u, d) - x;
  4*der(w) = delay(x, e) - w - 0.1*w^2;
end Late;"#;
    let case = Case::new(text, 200, 1.0, |k| vec![((k / 10 * 7919) % 13) as f64]);
    let inputs: Vec<f64> = case.inputs.iter().map(|u| u[0]).collect();
    let reference = late_reference(&inputs, 200, (660, 420));
    let (rows, _) = case.plain();
    let range = Case::range(&rows, 0);
    for (k, (own, reference)) in rows.iter().zip(&reference).enumerate() {
        let off = (own[0] - reference).abs() / range;
        assert!(off < 1e-7, "row {k}: off by {off:e} of the range");
    }
}

/// Time constants of 1 ms and of 1000 s together, with rows at both rates: both have an analytic solution.
#[test]
fn fast_and_slow_side_by_side() {
    let text = r#"
model Two
  parameter Real fast = 1e-3;
  parameter Real slow = 1e3;
  input Real u;
  output Real y = a;
  output Real z = b;
  Real a(start=1);
  Real b(start=0.2);
equation
  fast*der(a) = u - a + 0*a*a;
  slow*der(b) = a - b + 0*b*b;
end Two;"#;
    let mut case = Case::new(text, 160, 1.0, |k| vec![(k / 8 % 4) as f64]);
    let mut now = 0.0;
    for (k, time) in case.time.iter_mut().enumerate() {
        *time = now;
        now += [5e-4, 5e-4, 1e-3, 3e-3, 30.0, 30.0, 30.0, 200.0][k % 8];
    }
    assert_eq!(case.plain().1, Method::Implicit);
    let variables = [1e-3, 1e3, 1.0, 0.2].map({
        let mut lane = 0;
        move |value| {
            lane += 1;
            Dual::<4>::variable(value, lane - 1)
        }
    });
    let [fast, slow, mut a, mut b] = variables;
    let mut expected = vec![[a, b]];
    for (k, times) in case.time.windows(2).enumerate() {
        let (u, h) = (case.inputs[k][0], times[1] - times[0]);
        let left = |lag: Dual<4>| (-(Dual::constant(h) / lag)).exp();
        let own = (a - u) * fast / (fast - slow);
        b = own * left(fast) + (b - own - u) * left(slow) + u;
        a = (a - u) * left(fast) + u;
        expected.push([a, b]);
    }
    let (found, _) = case.run(&variables[..2], &variables[2..]);
    for output in 0..2 {
        for lane in 0..4 {
            let slope = |row: &[Dual<4>]| row[output].eps[lane];
            let largest = expected.iter().map(|row| slope(row).abs());
            let largest = largest.fold(0.0, f64::max);
            for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let value = (found[output].re - expected[output].re).abs();
                assert!(value < 3e-7, "row {k}: {value:e}");
                let off = (slope(found) - slope(expected)).abs();
                assert!(
                    off <= 1e-5 * largest,
                    "row {k}, output {output} by {lane}: off by {off:e}, largest {largest:e}"
                );
            }
        }
    }
}

/// The first event makes the argument of the maximum jump: the maximum changes its branch there, and no state moves at once.
#[test]
fn a_guard_that_an_event_makes_jump_moves_no_state() {
    let text = |right: &str| {
        format!(
            "model Jump
  parameter Real p = 0.713;
  input Real u;
  output Real x(start=0.096, fixed=true);
  Real z(start=0.409, fixed=true);
equation
  der(x) = tanh({right}) - 1.3*x;
  der(z) = -0.3 - 2.3*z;
end Jump;"
        )
    };
    let one = text("max(if u > time + 0.137 then z else p, x)");
    let other = text("if u > time + 0.137 then max(z, x) else max(p, x)");
    let [one, other] = [one, other].map(|text| Case::new(&text, 12, 0.2, |_| vec![0.523]));
    let ((one_rows, _), (other_rows, _)) = (one.plain(), other.plain());
    for (a, b) in one_rows.iter().zip(&other_rows) {
        assert!((a[0] - b[0]).abs() < 1e-9, "{a:?} {b:?}");
    }
    one.check_derivatives(1e-5);
}
