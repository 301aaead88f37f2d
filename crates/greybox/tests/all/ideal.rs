//! What records without noise determine.

use std::collections::BTreeMap;

use approx::assert_relative_eq;
use ct_model::{Method, Model, ModelSpec};
use greybox::{IdealRecords, NotIdeal, ideal_records};

const BLOCK: &str = "model Block
  parameter Real C(unit=\"J/K\", min=0) = 50;
  parameter Real k(unit=\"W/K\", min=0) = 0.1;
  parameter Real g(unit=\"W\", min=0) = 0.2;
  input Real u(unit=\"%\", min=0, max=100);
  input Real Ta(unit=\"degC\", min=15, max=25);
  output Real T(unit=\"degC\", start=20);
equation
  C*der(T) = g*u - k*(T - Ta);
end Block;";

fn of(text: &str, known: &[(&str, f64)]) -> IdealRecords {
    let model = Model::new(ModelSpec::parse(text).unwrap());
    let known: BTreeMap<String, f64> = known.iter().map(|(n, v)| ((*n).into(), *v)).collect();
    ideal_records(&model, &known).unwrap()
}

#[test]
fn a_common_factor_of_a_balance_is_not_determined() {
    let found = of(BLOCK, &[]);
    assert_eq!(found.method, Method::Exact);
    assert_relative_eq!(found.time_constants[..], [500.0][..], max_relative = 1e-9);
    assert_eq!(found.not_determined, [["C", "k", "g"]]);
    assert!(of(BLOCK, &[("C", 40.0)]).not_determined.is_empty());
    // Without a second input, the level of the room cannot be told from a constant flow.
    let constant = BLOCK.replace("k*(T - Ta)", "k*T + c");
    let constant = constant.replace(
        "input Real Ta(unit=\"degC\", min=15, max=25)",
        "parameter Real c = 1",
    );
    assert!(of(&constant, &[("C", 40.0)]).not_determined.is_empty());
    let twice = constant
        .replace("k*T + c", "k*T + c*c2")
        .replace("Real c = 1", "Real c = 1;\n  parameter Real c2 = 2");
    assert_eq!(of(&twice, &[("C", 40.0)]).not_determined, [["c", "c2"]]);
}

#[test]
fn fast_and_slow_parts_are_excited() {
    let text = "model Stiff
  parameter Real fast = 1e-3;
  parameter Real slow = 1e3;
  parameter Real b = 0.1;
  parameter Real unused = 1;
  input Real u;
  output Real y = x + z;
  Real x(start=0.5);
  Real z(start=0.5);
equation
  fast*der(x) = u - x - b*x^3 + 0*unused*x;
  slow*der(z) = u - z - b*z^3;
end Stiff;";
    let found = of(text, &[]);
    assert_eq!(found.method, Method::Implicit);
    let constants = &found.time_constants;
    assert!(constants[0] < 1e-3 && constants[1] > 0.5e3, "{constants:?}");
    assert_eq!(found.not_determined, [["unused"]]);
}

#[test]
fn a_model_without_states_and_one_that_cannot_be_simulated() {
    let text = "model Gain
  parameter Real a = 2;
  parameter Real b = 3;
  input Real u;
  output Real y = a*u + b;
end Gain;";
    let found = of(text, &[]);
    assert!(found.time_constants.is_empty() && found.not_determined.is_empty());
    assert_eq!(found.assumed, [("u".to_string(), (0.0, 1.0))]);
    let text = text.replace("a*u + b", "a*log(-1 - u) + b");
    let of = |text: &str| {
        let model = Model::new(ModelSpec::parse(text).unwrap());
        ideal_records(&model, &BTreeMap::new())
    };
    assert_eq!(
        of(&text.replace("log(-1 - u)", "log(0.7 - u)")),
        Err(NotIdeal::Simulation)
    );
    assert_eq!(of(&text), Err(NotIdeal::Start));
    assert_eq!(
        of(&text.replace("log(-1 - u)", "delay(u, 2)")),
        Err(NotIdeal::Delay)
    );
}

#[test]
fn a_model_without_inputs_is_moved_by_its_initial_states() {
    let text = "model Pendulum
  parameter Real w(min=0) = 4;
  parameter Real d(min=0) = 0.1;
  parameter Real unused = 1;
  output Real y = x;
  Real x(start=0);
  Real v(start=0);
equation
  der(x) = v;
  der(v) = -w^2*sin(x) - d*v + 0*unused*x;
end Pendulum;";
    assert_eq!(of(text, &[]).not_determined, [["unused"]]);
    // At rest, with known initial states, no record tells anything.
    let at_rest = text.replace("start=0", "start=0, fixed=true");
    assert_eq!(of(&at_rest, &[]).not_determined, [["d"], ["unused"], ["w"]]);
}
