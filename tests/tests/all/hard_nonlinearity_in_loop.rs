//! Actuators with a hard nonlinearity in a control loop with coloured noise.

#![allow(clippy::unwrap_used)]

use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::{Channel, Record, noise};
use effect_search::{Diagnosis, NotSimulated, Options, Problem, diagnose};
use greybox::LoopController;
use plants::controller::Controller;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const ROWS: usize = 900;
/// Interval of the rows \[s\].
const INTERVAL: f64 = 5.0;

fn oven(heat: &str) -> ModelSpec {
    let text = format!(
        "model Oven
           final parameter Real C(unit=\"J/K\") = 50;
           parameter Real k(unit=\"W/K\", min=0) = 0.8;
           parameter Real g(unit=\"W/%\", min=0) = 1.6;
           input Real u(unit=\"%\");
           output Real y(unit=\"degC\") = T;
           Real T(unit=\"degC\", start=60);
         equation
           C*der(T) = g*{heat} - k*(T - 20);
         end Oven;"
    );
    ModelSpec::parse(&text).unwrap()
}

fn controller() -> LoopController {
    // Proportional and integral, with the reading of the row before.
    let (gain, rows) = (2.0, 8.0);
    let r = [0.0, gain, gain * (1.0 / rows - 1.0)];
    let controller = Controller::sampled(&r, &[1.0, -1.0], (0.0, 100.0)).unwrap();
    LoopController {
        controller,
        input: 0,
        reference: Some(0),
    }
}

/// A record of a loop whose set point changes.
fn record(plant: ModelSpec, seed: u64) -> Record {
    let model = Model::new(plant);
    let parameters = model.parameters();
    let mut simulation = Simulation::new(&model, &parameters, &model.starts(&parameters), 0.0);
    let mut regulator = controller().controller.start(&[20.0]);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = noise::ar1(ROWS, 0.4, 0.7, &mut rng);
    let (mut u, mut y, mut reference) = (Vec::new(), Vec::new(), Vec::new());
    for (k, noise) in noise.iter().enumerate() {
        let asked = regulator.clone().command(0.0, 0.0, 1.0);
        let mut read = [0.0];
        simulation.read(&[asked], &mut read);
        let measured = read[0] + noise;
        let wanted = 50.0 + 6.0 * ((k / 60) * 7919 % 13) as f64;
        regulator.command(wanted, measured, 1.0);
        simulation
            .advance(&[asked], &[asked], INTERVAL * (k + 1) as f64)
            .unwrap();
        u.push(asked);
        y.push(measured);
        reference.push(wanted);
    }
    Record {
        name: "oven".to_string(),
        time: (0..ROWS).map(|k| INTERVAL * k as f64).collect(),
        inputs: vec![Channel::new("u", "%", u)],
        outputs: vec![Channel::new("y", "degC", y)],
        references: vec![Channel::new("r", "degC", reference)],
        ..Record::default()
    }
}

fn diagnosis(believed: &str, true_heat: &str, seed: u64) -> Diagnosis {
    let problem: Problem = Problem::builder(oven(believed), [record(oven(true_heat), seed)])
        .controller(controller())
        .build()
        .unwrap();
    diagnose(&problem, &Options::default(), &|_| {}).unwrap()
}

fn runs_on_measured_inputs(found: &Diagnosis) -> bool {
    let control_loop = found.control_loop.as_ref().unwrap();
    let hard = NotSimulated::HardNonlinearity {
        of: "u".to_string(),
    };
    control_loop.not_simulated == Some(hard)
}

/// In a simulated loop the sizes were biased by many standard errors, and a second effect made up for that.
#[test]
fn it_is_named_alone_with_its_size() {
    for (effect, heat, parameter, size) in [
        ("backlash(u)", "play(u, 3)", "backlash_u_half_width", 3.0),
        ("saturation(u)", "min(u, 55)", "saturation_u_limit", 55.0),
    ] {
        for seed in [1, 2] {
            let found = diagnosis("u", heat, seed);
            assert_eq!(found.effects, [effect], "seed {seed}");
            assert!(runs_on_measured_inputs(&found));
            let last = found.steps.last().unwrap();
            let of = last.parameters.iter().find(|p| p.name == parameter);
            let (value, error) = (of.unwrap().value, of.unwrap().std_error.unwrap());
            assert!(
                (value - size).abs() < 4.0 * error && error < 0.05 * size,
                "{effect}, seed {seed}: {value} ± {error}"
            );
        }
    }
}

#[test]
fn a_text_that_contains_it_is_adequate() {
    let found = diagnosis("play(u, 3)", "play(u, 3)", 4);
    assert!(found.effects.is_empty(), "{:?}", found.effects);
    assert!(runs_on_measured_inputs(&found));
    for (name, value) in [("k", 0.8), ("g", 1.6)] {
        let of = found.steps[0].parameters.iter().find(|p| p.name == name);
        let of = of.unwrap();
        assert!(
            (of.value - value).abs() < 4.0 * of.std_error.unwrap(),
            "{name} {of:?}"
        );
    }
}

/// A limit that the record does not reach leaves the loop simulated.
#[test]
fn a_limit_that_does_not_act_changes_nothing() {
    let found = diagnosis("min(u, 1000)", "u", 5);
    assert!(found.effects.is_empty(), "{:?}", found.effects);
    assert!(found.control_loop.unwrap().simulated);
}
