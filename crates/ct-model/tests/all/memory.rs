//! Backlash, rounding, and states whose initial value follows from the first row.

use ct_model::{Dual, Method, Model, ModelSpec, Scalar, Simulation, SimulationNumber};

fn model(text: &str) -> Model {
    Model::new(ModelSpec::parse(text).unwrap_or_else(|error| panic!("{error}")))
}

/// The only output at every row.
fn run<T: SimulationNumber>(
    model: &Model,
    parameters: &[T],
    u: &[f64],
    lines: bool,
) -> (Vec<T>, Method) {
    let initial = model.starts(parameters);
    let mut simulation = Simulation::new(model, parameters, &initial, 0.0);
    let mut y = [T::constant(0.0)];
    let mut rows = Vec::new();
    for (k, now) in u.iter().enumerate() {
        simulation.read(&[*now], &mut y);
        rows.push(y[0]);
        if let Some(next) = u.get(k + 1) {
            let to = if lines { *next } else { *now };
            simulation.advance(&[*now], &[to], (k + 1) as f64).unwrap();
        }
    }
    (rows, simulation.method())
}

#[test]
fn a_play_follows_at_a_distance() {
    let play = model(
        "model Play
           parameter Real b = 1;
           input Real u;
           output Real y = play(u, b);
         end Play;",
    );
    let u = [2.0, 2.5, 4.0, 3.0, 2.0, 1.5, 6.0];
    let (y, _) = run(&play, &[1.0], &u, false);
    assert_eq!(y, [2.0, 2.0, 3.0, 3.0, 3.0, 2.5, 5.0]);
    // With width zero the backlash is absent, ...
    assert_eq!(run(&play, &[0.0], &u, false).0, u);
    // ... and the derivative shows the side of contact.
    let (y, _) = run(&play, &[Dual::<2>::variable(1.0, 0)], &u, false);
    let slopes: Vec<f64> = y.iter().map(|y| y.eps[0]).collect();
    assert_eq!(slopes, [0.0, 0.0, -1.0, -1.0, -1.0, 1.0, -1.0]);
}

const STICK_SLIP: &str = "model Slip
  parameter Real b = 0.5;
  final parameter Real j = 1;
  input Real u;
  output Real y = stick_slip(u, b, j, 0);
end Slip;";
const PLAY: &str = "model Play
  parameter Real b = 0.5;
  input Real u;
  output Real y = play(u, b);
end Play;";

#[test]
fn stiction_moves_by_jumps() {
    let u = [2.0, 2.9, 3.1, 2.2, 2.0, 5.0, 4.5];
    let (y, _) = run(&model(STICK_SLIP), &[0.5, 1.0], &u, false);
    assert_eq!(y, [2.0, 2.0, 3.1, 3.1, 2.0, 5.0, 5.0]);
    // Without the jump it is a play, with half of it a part of the play remains, ...
    assert_eq!(
        run(&model(STICK_SLIP), &[0.5, 0.0], &u, false).0,
        run(&model(PLAY), &[0.5], &u, false).0
    );
    let (y, _) = run(&model(STICK_SLIP), &[0.5, 0.5], &u, false);
    assert_eq!(y, [2.0, 2.65, 2.65, 2.65, 2.65, 4.75, 4.75]);
    // ... and with width zero it is absent.
    assert_eq!(run(&model(STICK_SLIP), &[0.0, 1.0], &u, false).0, u);
}

/// It begins anywhere within its band, and up to its first move this shows.
#[test]
fn stiction_and_play_begin_within_their_band() {
    let model = model(
        "model Begins
  parameter Real b = 0.5;
  final parameter Real j = 1;
  parameter Real s = 0;
  input Real u;
  output Real y = stick_slip(u, b, j, s);
end Begins;",
    );
    let u = [2.0, 2.25, 3.125, 2.25];
    // At the lower end of its band a rise moves it at once, at the upper end it stays.
    let of = |j: f64, s: f64| run(&model, &[0.5, j, s], &u, false).0;
    assert_eq!(of(1.0, -1.0), [1.0, 2.25, 2.25, 2.25]);
    assert_eq!(of(1.0, 1.0), [3.0, 3.0, 3.0, 3.0]);
    assert_eq!(of(0.0, -1.0), [1.5, 1.75, 2.625, 2.625]);
    assert_eq!(of(0.0, 0.5), [2.25, 2.25, 2.625, 2.625]);
    for (j, band) in [(0.0, 0.5), (1.0, 1.0)] {
        let parameters = [
            Dual::constant(0.5),
            Dual::constant(j),
            Dual::<2>::variable(0.5, 0),
        ];
        let (y, _) = run(&model, &parameters, &u, false);
        let slopes: Vec<f64> = y.iter().map(|y| y.eps[0]).collect();
        // A play moves at the third row, stiction not at all.
        let later = if j == 0.0 { 0.0 } else { band };
        assert_eq!(slopes, [band, band, later, later]);
    }
}

#[test]
fn the_slope_of_stiction_is_a_finite_difference() {
    let u: Vec<f64> = (0..300)
        .map(|k| 3.0 * (0.11 * f64::from(k)).sin() + (0.37 * f64::from(k)).cos())
        .collect();
    for (b, j) in [(0.5, 1.0), (0.8, 0.3)] {
        let parameters = [Dual::<2>::variable(b, 0), Dual::constant(j)];
        let (y, _) = run(&model(STICK_SLIP), &parameters, &u, false);
        let at = |b: f64| run(&model(STICK_SLIP), &[b, j], &u, false).0;
        let reach = 0.05 * b;
        let (below, above) = (at(b - reach), at(b + reach));
        for ((y, below), above) in y.iter().zip(below).zip(above) {
            let slope = (above - below) / (2.0 * reach);
            assert!((y.eps[0] - slope).abs() < 1e-9, "{} {slope}", y.eps[0]);
        }
        assert!(y.iter().any(|y| y.eps[0] != 0.0));
    }
    // Without a jump, and with a half-width of zero, the slope is that of a play.
    for b in [0.8, 0.0] {
        let parameters = [Dual::<2>::variable(b, 0), Dual::constant(0.0)];
        let slopes = |text: &str, parameters: &[Dual<2>]| -> Vec<f64> {
            let (y, _) = run(&model(text), parameters, &u, false);
            y.iter().map(|y| y.eps[0]).collect()
        };
        assert_eq!(
            slopes(STICK_SLIP, &parameters),
            slopes(PLAY, &parameters[..1])
        );
    }
}

/// Between rows it is compared with its output at the last row: it moves once, and then follows.
#[test]
fn stiction_moves_within_an_interval() {
    let text = "model Slip
      parameter Real b = 1;
      final parameter Real j = 1;
      input Real u;
      output Real x(start=0);
    equation
      der(x) = stick_slip(u, b, j, 0) + 0*x^2;
    end Slip;";
    // From 0 to 5 in a straight line: it jumps at u = 2, after two fifths of the interval.
    let (x, _) = run(&model(text), &[1.0, 1.0], &[0.0, 5.0, 5.0], true);
    let first = 0.6 * (2.0 + 5.0) / 2.0;
    for (x, expected) in x.iter().zip([0.0, first, first + 5.0]) {
        assert!((x - expected).abs() < 1e-9, "{x} {expected}");
    }
}

#[test]
fn a_play_meets_its_contact_within_an_interval() {
    let text = "model Wheel
      parameter Real b = 1;
      input Real u;
      output Real x(start=0);
    equation
      der(x) = play(u, b) + 0*x^2;
    end Wheel;";
    // From 0 to 3 in a straight line: contact at u = 1, after a third of the interval; back to 0: contact at u = 1 again.
    let u = [0.0, 3.0, 0.0];
    let (x, method) = run(&model(text), &[1.0], &u, true);
    assert_eq!(method, Method::Explicit);
    let expected = [
        0.0,
        2.0 / 3.0 * 2.0 / 2.0,
        2.0 / 3.0 + 2.0 * 2.0 / 3.0 + (2.0 + 1.0) / 2.0 / 3.0,
    ];
    for (x, expected) in x.iter().zip(expected) {
        assert!((x - expected).abs() < 1e-9, "{x} {expected}");
    }
}

#[test]
fn rounding_goes_to_the_nearest_multiple() {
    let text = "model Round
      parameter Real d = 0.5;
      input Real u;
      output Real y = quantise(u, d);
    end Round;";
    let u = [0.2, 0.3, -0.8, 1.0];
    assert_eq!(
        run(&model(text), &[0.5], &u, false).0,
        [0.0, 0.5, -1.0, 1.0]
    );
    assert_eq!(run(&model(text), &[0.0], &u, false).0, u);
}

#[test]
fn an_initial_equation_settles_a_state_at_the_first_row() {
    let text = "model Lag
  parameter Real g = 3;
  parameter Real tau = 2;
  input Real u;
  Real v;
  output Real x;
initial equation
  x = v;
equation
  v = g*u;
  tau*der(x) = v - x;
end Lag;
";
    let spec = ModelSpec::parse(text).unwrap();
    assert!(spec.states[0].fixed && spec.is_settled(0));
    assert_eq!(
        ModelSpec::parse(&spec.to_string()).unwrap().to_string(),
        spec.to_string()
    );
    let own = Model::new(spec);
    let (x, method) = run(&own, &[3.0, 2.0], &[5.0, 5.0, 5.0], false);
    assert_eq!(method, Method::Exact);
    for x in x {
        assert!((x - 15.0).abs() < 1e-12, "{x}");
    }
    // The contact depends on the parameters of its expression.
    let parameters = [Dual::<2>::variable(3.0, 0), Dual::constant(2.0)];
    let (x, _) = run(&own, &parameters, &[5.0, 5.0], false);
    assert!((x[0].eps[0] - 5.0).abs() < 1e-12 && (x[1].eps[0] - 5.0).abs() < 1e-12);
}

#[test]
fn initial_equations_are_of_states_alone() {
    for (line, wanted) in [
        ("q = 1;", "must be one state"),
        ("2*x = 1;", "must be one state"),
        ("x = 1; x = 2;", "two initial equations"),
        ("x = qq;", "`qq` is not declared"),
    ] {
        let text = format!(
            "model M\n output Real x;\n Real q = x;\ninitial equation\n {line}\nequation\n der(x) = q;\nend M;"
        );
        let error = ModelSpec::parse(&text).unwrap_err();
        assert!(error.what.contains(wanted), "{error}");
        assert_eq!(error.position.line, 5);
    }
    let text =
        "model M output Real x(start=2); initial equation x = 1; equation der(x) = 1; end M;";
    let error = ModelSpec::parse(text).unwrap_err().to_string();
    assert!(error.contains("a start and an initial equation"), "{error}");
}

#[test]
fn a_delay_of_nothing_is_there_at_once() {
    let text = "model D
      parameter Real d = 0;
      input Real u;
      output Real y = 2*delay(u, d);
    end D;";
    let u = [1.0, 3.0, 2.0];
    assert_eq!(run(&model(text), &[0.0], &u, false).0, [2.0, 6.0, 4.0]);
    assert_eq!(run(&model(text), &[0.5], &u, false).0, [2.0, 2.0, 6.0]);
}

#[test]
fn a_value_stays_between_two_others() {
    let text = "model Between
      parameter Real w = 1;
      input Real u;
      output Real y = stay_between(u, u + w);
    end Between;";
    let u = [2.0, 2.5, 4.0, 3.0, 2.0, 1.5, 6.0];
    let (y, _) = run(&model(text), &[1.0], &u, false);
    assert_eq!(y, [2.0, 2.5, 4.0, 4.0, 3.0, 2.5, 6.0]);
    // The slope is that of the side which moved the value.
    let (y, _) = run(&model(text), &[Dual::<2>::variable(1.0, 0)], &u, false);
    let slopes: Vec<f64> = y.iter().map(|y| y.eps[0]).collect();
    assert_eq!(slopes, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
    // A play is one whose two values are on both sides of its input.
    let both = "model Both
      parameter Real b = 0.5;
      input Real u;
      output Real y = play(u, b);
      output Real z = stay_between(u - b, u + b) + 0*y;
    end Both;";
    let both = model(both);
    let mut simulation = Simulation::new(&both, &[0.5], &[], 0.0);
    let mut y = [0.0; 2];
    let rows: Vec<[f64; 2]> = u
        .iter()
        .enumerate()
        .map(|(k, u)| {
            simulation.read(&[*u], &mut y);
            simulation.advance(&[*u], &[*u], (k + 1) as f64).unwrap();
            y
        })
        .collect();
    // It begins at the lower value instead of the middle.
    assert_eq!(rows[0], [2.0, 1.5]);
    assert!(rows[2..].iter().all(|[y, z]| y == z), "{rows:?}");
}
