//! States that slide along a switching surface: friction that holds, relays.

use ct_model::Method;

use crate::support::Case;

/// An arm that is driven to and fro, with friction that holds it for a while in each period.
const ARM: &str = r#"
model Arm
  parameter Real f = 0.5;
  parameter Real k = 0.8;
  parameter Real j = 0.7;
  input Real u;
  output Real y = x;
  output Real z = w;
  output Real force = hold;
  Real x(start=0.2);
  Real w(start=0.3);
  Real hold = f*sign(w);
equation
  der(x) = w;
  j*der(w) = u - k*x - hold;
end Arm;"#;

fn drive(k: usize) -> f64 {
    0.9 * (0.11 * k as f64).sin() + if k % 40 < 20 { 0.4 } else { 0.0 }
}

/// The arm between its turning points, where it oscillates about the equilibrium of one side.
fn arm_reference(inputs: &[f64], step: f64) -> Vec<[f64; 2]> {
    let (f, k, j) = (0.5, 0.8, 0.7);
    let omega = f64::sqrt(k / j);
    let (mut x, mut w) = (0.2, 0.3_f64);
    let mut read = vec![[x, w]];
    for u in &inputs[..inputs.len() - 1] {
        let mut left = step;
        while left > 0.0 {
            let force = u - k * x;
            if w == 0.0 && force.abs() <= f {
                break;
            }
            let side = if w == 0.0 { force } else { w }.signum();
            let from = x - (u - side * f) / k;
            let mut turn = w.atan2(omega * from) / omega;
            if turn <= 0.0 || w == 0.0 {
                turn += std::f64::consts::PI / omega;
            }
            if w == 0.0 {
                turn = std::f64::consts::PI / omega;
            }
            let time = turn.min(left);
            let (sin, cos) = (omega * time).sin_cos();
            x += from * (cos - 1.0) + w / omega * sin;
            w = if turn < left {
                0.0
            } else {
                w * cos - omega * from * sin
            };
            left -= time;
        }
        read.push([x, w]);
    }
    read
}

#[test]
fn an_arm_that_friction_holds() {
    let mut case = Case::new(ARM, 120, 0.37, |k| vec![drive(k)]);
    let (rows, _) = case.plain();
    let reference = arm_reference(&case.inputs.iter().map(|u| u[0]).collect::<Vec<_>>(), 0.37);
    let held = reference.iter().filter(|row| row[1] == 0.0).count();
    assert!((30..90).contains(&held), "{held} rows");
    for (k, (row, reference)) in rows.iter().zip(&reference).enumerate() {
        for (own, reference) in row.iter().zip(reference) {
            assert!(
                (own - reference).abs() < 1e-8,
                "row {k}: {row:?}, {reference:?}"
            );
        }
    }
    case.check_derivatives(1e-5);
    case.lines = true;
    case.check_derivatives(1e-5);
}

/// Sliding modes along guards of any kind: at rest from the start, along an input that changes, along a curve, after a delay, on two guards
/// at once.
#[test]
fn states_that_slide() {
    let frame = |more: &str, equations: &str, outputs: &str| {
        format!(
            "model M parameter Real f = 0.5; parameter Real k = 0.8; parameter Real c = 0.3; input Real u; input Real r; {outputs} \
             Real x(start=0.1); {more} equation {equations} end M;"
        )
    };
    let plain =
        "output Real y = x; output Real z = w; output Real all = x + 0.1*(f + k + c + u + r);";
    for (name, more, equations) in [
        (
            "at rest",
            "Real w(start=0);",
            "der(x) = w; der(w) = u - k*x - c*w - f*sign(w);",
        ),
        (
            "a moving level",
            "Real w(start=0.05);",
            "der(x) = 2*f*sign(r - x) - 0.1*x; der(w) = k*x - c*w;",
        ),
        (
            "a level of a parameter's",
            "Real w(start=0.05);",
            "der(x) = (if x > c*(2 + sin(time)) then -f else 2*f) - 0.1*k*x; der(w) = k*x - c*w + 0.1*u;",
        ),
        (
            "a curve",
            "Real w(start=0.05);",
            "der(x) = 0.3*u - c*x; der(w) = k - 3*f*sign(w^2 + w + 0.3*x - 0.4 - 0.2*r) - 0.2*w;",
        ),
        (
            "behind a delay",
            "Real w(start=0.05);",
            "der(x) = 0.5*u - c*x; der(w) = -3*f*sign(w - delay(x, k));",
        ),
        (
            "two masses",
            "Real w(start=0.05); Real a(start=0.3); Real v(start=-0.2); output Real ya = a; output Real za = v;",
            "der(x) = w; der(w) = u - k*(x - a) - c*w - f*sign(w); der(a) = v; der(v) = k*(x - a) - 0.5*a + 0.3*r - 0.6*f*sign(v);",
        ),
        (
            "a fast sensor",
            "Real w(start=0.05); Real q(start=0.1); output Real fast = q;",
            "der(x) = w; der(w) = u - k*x - c*w - f*sign(w); 1e-4*der(q) = x + 0.2*r - q;",
        ),
        (
            "one against another",
            "Real w(start=0.05); Real a(start=0.3); Real v(start=-0.2); output Real ya = a; output Real za = v;",
            "der(x) = w; der(w) = u - k*x - f*sign(w - v); der(a) = v; der(v) = f*sign(w - v) - c*v - 0.5*a + 0.3*r;",
        ),
    ] {
        println!("{name}");
        // With differences of a longer step if the model is stiff.
        let share = if name == "a fast sensor" { 2e-4 } else { 1e-5 };
        let text = frame(more, equations, plain);
        for lines in [false, true] {
            let mut case = Case::new(&text, 90, 0.31, |k| {
                vec![drive(k), 0.5 + 0.4 * (0.05 * k as f64).cos()]
            });
            case.lines = lines;
            assert_eq!(case.plain().1 == Method::Implicit, name == "a fast sensor");
            case.check_derivatives_by(share, 1e-5);
        }
    }
}
