//! Simulations against closed forms, against an adaptive solver that no one here wrote, and derivatives against central differences.

use ct_model::{Dual, Method, Model, Scalar, Simulation};

use crate::support::{Case, check_outside, model};

const BLOCK: &str = r#"
model Block
  parameter Real C(min=0) = 50;
  parameter Real k(min=0) = 0.7;
  parameter Real g(min=0) = 2;
  input Real u;
  input Real Ta;
  output Real y = T;
  output Real loss = k*(T - Ta);
  Real T(start=20);
equation
  C*der(T) = g*u - loss;
end Block;"#;

const TANKS: &str = r#"
model Tanks "two tanks in series, the lower one with a rim"
  parameter Real k(min=0) = 3;
  parameter Real a1(min=0) = 6;
  parameter Real a2(min=0) = 5;
  parameter Real rim = 11;
  final parameter Real A = 30;
  input Real u;
  output Real y1 = h1;
  output Real y2 = h2;
  Real h1(start=4);
  Real h2(start=6);
  Real q = a1*sqrt(max(h1, 0));
equation
  A*der(h1) = k*u - q;
  A*der(h2) = q - a2*sqrt(max(h2, 0)) - (if h2 > rim then 20*(h2 - rim) else 0);
end Tanks;"#;

const CUT_OUT: &str = r#"
model CutOut "a heater that a limit switches off, with a bend in the loss"
  parameter Real g = 1.5;
  parameter Real k = 0.05;
  parameter Real limit = 30;
  parameter Real d = 4;
  input Real u;
  input Real Ta;
  output Real y = T;
  Real T(start=20);
  Real box(start=21);
equation
  der(T) = (if T < limit then g*u else 0.3*g*u) - k*(T - box) - 0.02*abs(T - Ta - d);
  der(box) = 0.1*(T - box) - 0.04*min(box - Ta, 15);
end CutOut;"#;

const LATE: &str = r#"
model Late
  parameter Real K = 2;
  parameter Real tau = 7;
  parameter Real d(min=0) = 3.3;
  parameter Real e(min=0) = 2.1;
  input Real u;
  output Real y = x2;
  Real x(start=1);
  Real x2(start=1);
equation
  tau*der(x) = K*delay(u, d) - x;
  4*der(x2) = delay(x, e) - x2 - 0.1*x2^2;
end Late;"#;

const STIFF: &str = r#"
model Stiff "van der Pol's slow side, with a fast store"
  parameter Real fast = 1e3;
  parameter Real slow = 1e-3;
  parameter Real b = 0.3;
  input Real u;
  output Real y = x;
  output Real z = w;
  Real x(start=1);
  Real w(start=0.2);
equation
  der(x) = -fast*(x - w - b*w^3 - u);
  der(w) = -slow*(w*w*w + x - 2*u);
end Stiff;"#;

const PENDULUM: &str = r#"
model Pendulum
  parameter Real w2 = 1;
  parameter Real c = 0.05;
  parameter Real b = 0.6;
  input Real u;
  output Real y = phi;
  Real phi(start=0.5);
  Real v(start=0);
equation
  der(phi) = v;
  der(v) = -w2*sin(phi) - c*v - 0.02*v*abs(v) + b*u;
end Pendulum;"#;

/// A linear model in which the derivative of one state is another state.
const SPRING: &str = r#"model Spring
  parameter Real g = 0.8;
  parameter Real c = 0.4;
  parameter Real k = 48;
  final parameter Real m = 1.1;
  input Real u;
  output Real y = s;
  Real s(start=0.1);
  Real v(start=-0.5);
equation
  der(s) = v;
  m*der(v) = g*u - c*v - k*s;
end Spring;"#;

pub fn steps(k: usize) -> f64 {
    // A sequence of levels that looks random and is the same for all.
    let level = (k / 10 * 7919) % 13;
    level as f64
}

fn block(lines: bool) -> Case {
    let mut case = Case::new(BLOCK, 200, 2.0, |k| {
        vec![steps(k), 15.0 + (0.05 * k as f64).sin()]
    });
    case.lines = lines;
    case
}

fn tanks() -> Case {
    Case::new(TANKS, 300, 1.5, |k| vec![steps(k)])
}

fn cut_out() -> Case {
    Case::new(CUT_OUT, 400, 1.0, |k| {
        vec![0.4 * steps(k), 12.0 + 4.0 * (0.03 * k as f64).sin()]
    })
}

fn late() -> Case {
    Case::new(LATE, 300, 1.0, |k| vec![steps(k)])
}

fn stiff() -> Case {
    Case::new(STIFF, 200, 20.0, |k| vec![0.1 * steps(k)])
}

fn pendulum() -> Case {
    // A tenth of the Nyquist frequency: twenty samples in a period.
    Case::new(PENDULUM, 400, std::f64::consts::PI / 10.0, |k| {
        vec![0.05 * (steps(k) - 6.0)]
    })
}

fn spring(lines: bool) -> Case {
    let mut case = Case::new(SPRING, 400, 0.04, |k| vec![steps(k) - 6.0]);
    case.lines = lines;
    case
}

#[test]
fn a_root_or_a_power_above_a_limit_that_is_crossed_goes_on() {
    for term in [
        "sqrt(max(x - 1, 0))",
        "max(x - 1, 0)^1.5",
        "(if x > 1 then (x - 1)^0.5 else 0)",
    ] {
        let text = format!(
            "model Hole
               parameter Real a = 0.3;
               input Real u;
               output Real x(start=1.5);
             equation
               der(x) = u - 0.4*x - a*{term};
             end Hole;"
        );
        // The signal crosses the limit from above and from below repeatedly.
        let case = Case::new(&text, 60, 0.7, |k| vec![[0.2, 0.9][k / 6 % 2]]);
        let (rows, _) = case.plain();
        let low = rows.iter().map(|y| y[0]).fold(f64::INFINITY, f64::min);
        assert!(low < 0.8 && low > 0.0, "{term}: {low}");
        // The step size depends on the error of the values; the slope of a root is infinite at its end.
        case.check_derivatives(if term.contains("1.5") { 1e-6 } else { 1e-3 });
    }
}

#[test]
fn functions_of_held_inputs_and_readings_of_any_kind_are_exact() {
    let text = "model Curves
      parameter Real k = 0.4;
      parameter Real b = 0.3;
      parameter Real top = 2.1;
      input Real u;
      output Real y;
      Real x(start=0.2);
    equation
      der(x) = play(max(u, 0)^1.5 + b*u^2, 0.5) - k*x;
      y = min(x, top) + 0.1*x^2;
    end Curves;";
    let input = |k: usize| vec![[1.0, 1.4, -0.7, 0.2][k / 5 % 4]];
    let mut case = Case::new(text, 40, 0.5, input);
    let (exact, method) = case.plain();
    assert_eq!(method, Method::Exact);
    case.check_derivatives(1e-6);
    // The same with held inputs, and an additional nonlinear state without influence.
    let steps = text.replace(
        "equation",
        "Real z(start=0.1); equation der(z) = -z^2 - k*z; ",
    );
    let (rows, method) = Case::new(&steps, 40, 0.5, input).plain();
    assert_eq!(method, Method::Explicit);
    for (own, other) in exact.iter().zip(&rows) {
        assert!((own[0] - other[0]).abs() < 1e-8, "{own:?} {other:?}");
    }
    // With linear inputs they are not exact, and the simulation takes steps.
    case.lines = true;
    let (_, method) = case.plain();
    assert_eq!(method, Method::Explicit);
    let (held, lines) = (case.inputs.clone(), case.plain().0);
    let mut in_lines = Case::new(&steps, 40, 0.5, |k| held[k].clone());
    in_lines.lines = true;
    for (own, other) in lines.iter().zip(&in_lines.plain().0) {
        assert!((own[0] - other[0]).abs() < 1e-8, "{own:?} {other:?}");
    }
}

#[test]
fn a_position_whose_derivative_is_the_speed_itself_is_simulated_exactly() {
    let text = "model Free
      parameter Real f = 0.3;
      output Real s(start=0.1);
      Real v(start=0.2);
    equation
      der(s) = v;
      der(v) = f;
    end Free;";
    let case = Case::new(text, 20, 0.5, |_| Vec::new());
    let (rows, method) = case.plain();
    assert_eq!(method, Method::Exact);
    for (row, t) in rows.iter().zip(&case.time) {
        assert!(
            (row[0] - (0.1 + 0.2 * t + 0.15 * t * t)).abs() < 1e-12,
            "{row:?}"
        );
    }
}

#[test]
fn a_linear_model_is_simulated_exactly() {
    let case = block(false);
    let (rows, method) = case.plain();
    assert_eq!(method, Method::Exact);
    let (capacity, k, g) = (50.0, 0.7, 2.0);
    let mut t = 20.0;
    for (row, u) in rows.iter().zip(&case.inputs) {
        assert!((row[0] - t).abs() < 1e-11 && (row[1] - k * (t - u[1])).abs() < 1e-11);
        let rest = u[1] + g * u[0] / k;
        t = rest + (t - rest) * f64::exp(-k / capacity * 2.0);
    }
    check_outside(&block(true), 1e-9);
}

#[test]
fn intervals_that_differ_by_rounding_are_exact_too() {
    let mut case = block(true);
    for (k, time) in case.time.iter_mut().enumerate() {
        // Written with few digits, and once with a gap.
        *time = (*time / 3.0 * 1e6).round() / 1e6 + if k > 50 { 7.0 } else { 0.0 };
    }
    check_outside(&case, 1e-9);
    case.check_derivatives(1e-6);
}

#[test]
fn models_of_all_kinds_agree_with_an_adaptive_solver() {
    for (case, tolerance) in [
        (tanks(), 1e-7),
        (cut_out(), 1e-7),
        (stiff(), 1e-7),
        (pendulum(), 1e-7),
        (spring(false), 1e-8),
        (spring(true), 1e-8),
    ] {
        check_outside(&case, tolerance);
    }
}

#[test]
fn derivatives_agree_with_central_differences() {
    for case in [
        block(false),
        block(true),
        tanks(),
        cut_out(),
        late(),
        pendulum(),
        spring(false),
    ] {
        case.check_derivatives(1e-5);
    }
    stiff().check_derivatives_by(1e-4, 1e-5);
}

#[test]
fn the_method_follows_from_the_model() {
    for (case, method) in [
        (tanks(), Method::Explicit),
        (pendulum(), Method::Explicit),
        (stiff(), Method::Implicit),
        (block(false), Method::Exact),
        (spring(false), Method::Exact),
    ] {
        assert_eq!(case.plain().1, method, "{}", case.model.spec().name);
    }
}

#[test]
fn a_delay_lets_jumps_through_when_they_are_due() {
    let text = "model Late parameter Real d = 2.5; input Real u; output Real y = x; Real x(start=0); equation der(x) = delay(u, d); end Late;";
    let case = Case::new(text, 40, 1.0, |k| vec![if k >= 10 { 1.0 } else { 0.0 }]);
    let (rows, _) = case.plain();
    for (k, row) in rows.iter().enumerate() {
        let expected = (k as f64 - 12.5).max(0.0);
        assert!((row[0] - expected).abs() < 1e-12, "row {k}: {}", row[0]);
    }
    // Later by d is less by d.
    let (rows, _) = case.run(&[Dual::<2>::variable(2.5, 0)], &[Dual::constant(0.0)]);
    for (k, row) in rows.iter().enumerate() {
        let expected = if k > 12 { -1.0 } else { 0.0 };
        assert!((row[0].eps[0] - expected).abs() < 1e-12, "row {k}");
    }
    // A delay of zero has the same derivative.
    let (rows, _) = case.run(&[Dual::<2>::variable(0.0, 0)], &[Dual::constant(0.0)]);
    assert!((rows[20][0].re - 10.0).abs() < 1e-12 && (rows[20][0].eps[0] + 1.0).abs() < 1e-12);
}

#[test]
fn a_limit_that_is_met_fifty_times() {
    let text = r#"
model Saw
  parameter Real limit = 0.8;
  parameter Real w = 1;
  input Real u;
  output Real y = x;
  Real x(start=0);
  Real s(start=0);
  Real c(start=1);
equation
  der(s) = w*c;
  der(c) = -w*s;
  der(x) = max(s - limit, 0) - 0.1*x + 0*u*x;
end Saw;"#;
    // Twenty-five periods of three samples each: both edges of the limit in each.
    let case = Case::new(text, 80, 2.0, |_| vec![0.0]);
    check_outside(&case, 1e-7);
    case.check_derivatives(1e-5);
}

#[test]
fn a_relay_holds_its_level() {
    let text = "model Relay parameter Real q = 2; input Real u; output Real y = x; Real x(start=0); equation der(x) = (if x > 1 then -q else q) + 0*u*x; end Relay;";
    let case = Case::new(text, 10, 1.0, |_| vec![0.0]);
    let (rows, _) = case.plain();
    for row in &rows[1..] {
        assert!((row[0] - 1.0).abs() < 1e-12, "{}", row[0]);
    }
}

#[test]
fn a_state_without_bound_ends_the_trial() {
    let text = "model Away parameter Real q = 2; input Real u; output Real y = x; Real x(start=1); equation der(x) = q*x^2 + u; end Away;";
    let model = model(text);
    let mut simulation = Simulation::new(&model, &[2.0], &[1.0], 0.0);
    let error = simulation.advance(&[0.0], &[0.0], 1.0).unwrap_err();
    assert!(error.time >= 0.0 && error.time < 1.0);
    let negative = model_of_root();
    let mut simulation = Simulation::new(&negative, &[], &[0.5], 0.0);
    assert!(simulation.advance(&[0.0], &[0.0], 10.0).is_err());
}

fn model_of_root() -> Model {
    model(
        "model Root input Real u; output Real y = x; Real x(start=1); equation der(x) = -1 - sqrt(x) + u; end Root;",
    )
}

#[test]
fn exact_and_small_steps_agree() {
    let mut bent = block(true);
    bent.model = model(&BLOCK.replace("g*u - loss", "g*u - loss + 0*T*T"));
    let (exact, small) = (block(true).plain(), bent.plain());
    assert_eq!((exact.1, small.1), (Method::Exact, Method::Explicit));
    let range = Case::range(&exact.0, 0);
    for (k, (exact, small)) in exact.0.iter().zip(&small.0).enumerate() {
        let off = (exact[0] - small[0]).abs() / range;
        assert!(off < 1e-10, "row {k}: {off:e}");
    }
}
