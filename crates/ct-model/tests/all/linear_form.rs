//! Matrices and transfer functions of linear models against closed forms and against the simulation.

use approx::assert_relative_eq;
use ct_model::{Model, ModelSpec, Simulation};

fn model(text: &str) -> Model {
    Model::new(ModelSpec::parse(text).unwrap_or_else(|error| panic!("{error}")))
}

/// A mass on a spring: the derivative of a state is another state alone.
const SPRING: &str = "model Spring
  parameter Real m = 2;
  parameter Real d = 0.5;
  parameter Real k = 3;
  input Real F;
  output Real y = 10*s + 1;
  output Real a = (F - d*v - k*s)/m;
  Real s(start=0);
  Real v(start=0);
equation
  der(s) = v;
  m*der(v) = F - d*v - k*s;
end Spring;";

/// Two inputs, offsets, a branch on parameters, a direct path.
const ROOMS: &str = "model Rooms
  parameter Real c = 4;
  parameter Real k = 0.5;
  input Real q;
  input Real Ta;
  output Real y = T1 + 0.25*q - 3;
  output Real w = 2*T2;
  Real T1(start=20);
  Real T2(start=15);
  Real between = (if k > 0.1 then k else 0.1)*(T1 - T2);
equation
  c*der(T1) = q - between - k*(T1 - Ta) + 0.5;
  2*c*der(T2) = between - min(k, 0.2)*(T2 - Ta);
end Rooms;";

#[test]
fn a_spring_has_the_transfer_function_of_the_book() {
    let model = model(SPRING);
    let (m, d, k) = (1.5, 0.7, 4.0);
    let linear = model.linear(&[m, d, k]).unwrap();
    assert_eq!(linear.a, [vec![0.0, 1.0], vec![-k / m, -d / m]]);
    assert_eq!(linear.b, [[0.0], [1.0 / m]]);
    assert_eq!(linear.output_offset, [1.0, 0.0]);
    let position = linear.transfer_function(0, 0);
    let expected = [10.0 / m, 0.0, 0.0];
    for (own, expected) in position.numerator.iter().zip(expected) {
        assert_relative_eq!(*own, expected, epsilon = 1e-12);
    }
    for (own, expected) in position.denominator.iter().zip([k / m, d / m, 1.0]) {
        assert_relative_eq!(*own, expected, max_relative = 1e-12);
    }
    // The acceleration has a direct part: s^2/(m s^2 + d s + k).
    let acceleration = linear.transfer_function(0, 1);
    for (own, expected) in acceleration.numerator.iter().zip([0.0, 0.0, 1.0 / m]) {
        assert_relative_eq!(*own, expected, epsilon = 1e-12);
    }
}

#[test]
fn the_matrices_give_the_slopes_and_outputs_of_the_simulation() {
    for text in [SPRING, ROOMS] {
        let model = model(text);
        let parameters = model.parameters();
        let linear = model.linear(&parameters).unwrap();
        let x = [1.7, -0.6];
        let u = [2.3, -1.1];
        let u = &u[..model.spec().inputs.len()];
        let times = |row: &[f64], v: &[f64]| row.iter().zip(v).map(|(a, b)| a * b).sum::<f64>();
        let slope = |i: usize, x: &[f64]| {
            times(&linear.a[i], x) + times(&linear.b[i], u) + linear.state_offset[i]
        };
        let mut simulation = Simulation::new(&model, &parameters, &x, 0.0);
        let mut outputs = vec![0.0; model.spec().outputs.len()];
        simulation.read(u, &mut outputs);
        for (o, y) in outputs.iter().enumerate() {
            let own = times(&linear.c[o], &x) + times(&linear.d[o], u) + linear.output_offset[o];
            assert_relative_eq!(own, *y, max_relative = 1e-12);
        }
        // A fine Euler run of the matrices against the simulation.
        let (end, steps) = (0.1, 100_000);
        simulation.advance(u, u, end).unwrap();
        let mut own = x.to_vec();
        for _ in 0..steps {
            let slopes: Vec<f64> = (0..2).map(|i| slope(i, &own)).collect();
            let h = end / f64::from(steps);
            own.iter_mut().zip(slopes).for_each(|(x, dx)| *x += h * dx);
        }
        for (own, x) in own.iter().zip(simulation.state()) {
            assert_relative_eq!(*own, *x, max_relative = 1e-5);
        }
        // At rest the transfer functions give what the equations say.
        if text == ROOMS {
            let gain = |input, output| {
                let found = linear.transfer_function(input, output);
                found.numerator[0] / found.denominator[0]
            };
            // q - k (T1 - T2) - k T1 = 0, k (T1 - T2) = 0.2 T2.
            let (k, g) = (0.5, 0.2);
            let t1 = 1.0 / (2.0 * k - k * k / (k + g));
            assert_relative_eq!(gain(0, 0), t1 + 0.25, max_relative = 1e-12);
            assert_relative_eq!(gain(0, 1), 2.0 * t1 * k / (k + g), max_relative = 1e-12);
            // Warmer air warms both rooms as much.
            assert_relative_eq!(gain(1, 0), 1.0, max_relative = 1e-12);
            assert_relative_eq!(gain(1, 1), 2.0, max_relative = 1e-12);
        }
    }
}

#[test]
fn what_is_not_linear_or_delayed_has_no_matrices() {
    let parameters = model(SPRING).parameters();
    for (from, to) in [
        ("F - d*v - k*s;", "F - d*v - k*s*s;"),
        ("F - d*v - k*s;", "delay(F, 2) - d*v - k*s;"),
        ("F - d*v - k*s;", "F - d*v - k*s + time;"),
    ] {
        let changed = SPRING.replace(from, to);
        assert!(
            changed != SPRING && model(&changed).linear(&parameters).is_none(),
            "{to}"
        );
    }
}
