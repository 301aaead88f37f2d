//! Stiff models with roots whose slope is infinite where a trajectory passes: the pressures of a hydraulic cylinder.

use ct_model::{Method, Simulation};

use crate::support::Case;

/// A fast sensor of the speed makes all steps implicit. The valve's flows follow the root of a pressure difference, which ends at zero (`$ROOT`)
/// or changes its sign with it.
const CYLINDER: &str = "model Cylinder
  final parameter Real A = 1.2e-3;
  final parameter Real m = 250;
  final parameter Real Vd = 4e-4;
  final parameter Real L = 0.5;
  final parameter Real ps = 100e5;
  parameter Real b = 1e4;
  parameter Real F = 540;
  parameter Real kv = 1.54e-6;
  parameter Real beta = 1.16e9;
  input Real u;
  output Real yA = pA;
  output Real yB = pB;
  output Real yx = x;
  Real x(start=0.24);
  Real v(start=0);
  Real pA(start=54.9e5);
  Real pB(start=45.1e5);
  Real z(start=0);
  Real dA = if u >= 0 then ps - pA else pA;
  Real dB = if u >= 0 then pB else ps - pB;
  Real qA = kv*u*$ROOT(dA);
  Real qB = -kv*u*$ROOT(dB);
equation
  der(x) = v;
  der(z) = 1e5*(v - z);
  m*der(v) = A*(pA - pB) - b*v - F;
  (Vd + A*x)/beta*der(pA) = qA - A*v;
  (Vd + A*(L - x))/beta*der(pB) = qB + A*v;
end Cylinder;";

/// The valve is moved at once, so that the pressures swing to zero and to the supply.
fn valve(k: usize) -> Vec<f64> {
    let levels = [
        60.0, -20.0, 60.0, -20.0, -60.0, 20.0, -60.0, 20.0, 0.0, 35.0,
    ];
    let long = [0, 1, 4, 5, 9].contains(&(k / 5 % 10));
    let of = if long { k / 25 } else { k / 5 };
    vec![levels[of % levels.len()]]
}

fn is_simulated(root: &str) {
    let text = CYLINDER
        .replace("$ROOT(dA)", &root.replace('d', "dA"))
        .replace("$ROOT(dB)", &root.replace('d', "dB"));
    let mut is_stiff = false;
    for k in 0..8 {
        let factor = |j: usize| 0.7 + 0.6 * ((k * (2 * j + 3)) % 8) as f64 / 8.0;
        let of = |tolerance: f64| {
            let case = Case {
                tolerance,
                ..Case::new(&text, 500, 0.01, valve)
            };
            let mut parameters = case.model.parameters();
            for (j, value) in parameters[5..].iter_mut().enumerate() {
                *value *= factor(j);
            }
            let initial = case.model.starts(&parameters);
            case.run(&parameters, &initial)
        };
        let ((rough, _), (fine, method)) = (of(1e-8), of(1e-10));
        is_stiff |= method == Method::Implicit;
        for (o, scale) in [1e7, 1e7, 0.5].into_iter().enumerate() {
            let same = |(a, b): (&Vec<f64>, &Vec<f64>)| (a[o] - b[o]).abs() < 1e-3 * scale;
            assert!(rough.iter().zip(&fine).all(same), "{k}: output {o} differs");
        }
    }
    assert!(is_stiff, "the implicit method was not needed");
}

#[test]
fn a_pressure_that_ends_at_zero_is_passed() {
    is_simulated("sqrt(max(d, 0)/1e5)");
}

#[test]
fn a_flow_that_changes_its_sign_with_a_pressure_difference_is_passed() {
    is_simulated("sign(d)*sqrt(abs(d)/1e5)");
}

/// The units of the states do not make a model stiff: pressures of 1e7 Pa beside speeds of 0.1 m/s.
#[test]
fn states_of_very_different_size_are_not_stiff() {
    let text = "model Column input Real u; output Real y = p; Real v(start=0); Real p(start=1e6);
equation
  250*der(v) = 1.2e-3*p - 500*v - 100*v^3;
  7e-4/1e9*der(p) = 1.5e-5*u - 1.2e-3*v;
end Column;";
    let case = Case {
        tolerance: 1e-8,
        ..Case::new(text, 10, 1.0, |_| vec![10.0])
    };
    assert_eq!(case.plain().1, Method::Explicit);
}

/// Explicit steps continue after a stiff part of a record.
#[test]
fn a_model_that_is_stiff_for_a_while_is_stiff_no_longer() {
    let text = "model Valve input Real u; output Real y = x; Real x(start=0); Real p(start=1); Real q(start=0);
equation
  der(x) = (1 + 1e5*u)*(0.5 + 0.1*p - x - x^3);
  der(p) = 30*q;
  der(q) = -30*sin(p);
end Valve;";
    let case = Case::new(text, 40, 0.1, |k| vec![if k < 10 { 1.0 } else { 0.0 }]);
    let parameters = case.model.parameters();
    let initial = case.model.starts(&parameters);
    let mut simulation = Simulation::new(&case.model, &parameters, &initial, 0.0);
    let mut methods = Vec::new();
    for (inputs, until) in case.inputs.iter().zip(&case.time[1..]) {
        simulation.advance(inputs, inputs, *until).unwrap();
        methods.push(simulation.method());
    }
    assert_eq!(methods[9], Method::Implicit);
    assert_eq!(methods[12..], [Method::Explicit; 27]);
}
