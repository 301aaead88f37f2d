//! A simulation that shares its model and one that borrows it have equal outputs and states, bit by bit.

use std::sync::Arc;

use ct_model::{Dual, Model, ModelSpec, Scalar, SharedSimulation, Simulation, SimulationNumber};

/// A model of one state with this equation.
fn text(equation: &str) -> String {
    format!(
        "model Lag
  parameter Real k = 0.4;
  parameter Real d = 1.5;
  input Real u;
  output Real y = x;
  Real x(start=0.5);
equation
  {equation};
end Lag;
"
    )
}

/// A nonlinear balance with a dead time: simulated in steps with error control and events.
const NONLINEAR: &str = "der(x) = k*(delay(u, d) - (if x > 1 then 2*x else x))";

/// A first-order lag: simulated exactly.
const LINEAR: &str = "d*der(x) = k*u - x";

fn bits<T: Scalar>(values: &[T]) -> Vec<u64> {
    let all = values
        .iter()
        .flat_map(|value| [&[value.value()], value.slopes()].concat());
    all.map(f64::to_bits).collect()
}

fn the_same<T: SimulationNumber>(text: &str) {
    let model = Model::new(ModelSpec::parse_to_simulate(text).unwrap());
    let parameters = [T::variable(0.4, 0), T::variable(1.5, 1)];
    let initial = [T::variable(0.5, 2)];
    let mut borrowing = Simulation::new(&model, &parameters, &initial, 0.0);
    let shared = Arc::new(model.clone());
    let mut owning = SharedSimulation::new(Arc::clone(&shared), &parameters, &initial, 0.0);
    assert_eq!(Arc::strong_count(&shared), 2);
    let (mut expected, mut found) = ([T::constant(0.0)], [T::constant(0.0)]);
    for k in 0..60 {
        let (from, to) = ([f64::from(k / 20)], [f64::from((k + 1) / 20)]);
        borrowing.read(&from, &mut expected);
        owning.read(&from, &mut found);
        assert_eq!(bits(&found), bits(&expected), "{k}");
        let until = 0.5 * f64::from(k + 1);
        borrowing.advance(&from, &to, until).unwrap();
        owning.advance(&from, &to, until).unwrap();
        assert_eq!(bits(owning.state()), bits(borrowing.state()), "{k}");
    }
    drop(owning);
    assert_eq!(Arc::strong_count(&shared), 1);
}

#[test]
fn a_shared_simulation_gives_the_same_to_the_bit() {
    for equation in [NONLINEAR, LINEAR] {
        let text = text(equation);
        the_same::<f64>(&text);
        the_same::<Dual<4>>(&text);
    }
}
