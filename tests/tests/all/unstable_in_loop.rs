//! An exothermic reactor at an unstable operating point, which only its controller holds: the model does not follow the records on the measured
//! inputs.

#![allow(clippy::unwrap_used)]

use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::{Channel, Record, excitation, noise};
use effect_search::{Diagnosis, Error, Options, Problem, ProblemBuilder, Verdict, diagnose};
use greybox::LoopController;
use plants::controller::Controller;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Interval of the rows \[min\].
const INTERVAL: f64 = 0.02;
/// Heat transfer and heat of reaction of the records; the believed ones are 15 % and 10 % larger.
const TRUE: [f64; 2] = [2.09, 209.0];

/// `coolant`: its temperature at the jacket; `lag`: the equation of a further state.
fn reactor(coolant: &str, lag: &str) -> ModelSpec {
    let (state, equation) = match lag {
        "" => ("", ""),
        lag => ("Real q(unit=\"K\", start=302);", lag),
    };
    let text = format!(
        "model Reactor
           parameter Real h(unit=\"1/min\", min=0) = 2.4;
           parameter Real g(unit=\"K.m3/kmol\", min=0) = 230;
           final parameter Real k0(unit=\"1/min\") = 7.2e10;
           final parameter Real E(unit=\"K\") = 8750;
           input Real Tc(unit=\"K\");
           output Real T(unit=\"K\", start=350);
           Real c(unit=\"kmol/m3\", start=0.5, min=0);
           {state}
         equation
           der(c) = 1 - c - k0*exp(-E/T)*c;
           der(T) = 350 - T + g*k0*exp(-E/T)*c - h*(T - {coolant});
           {equation}
         end Reactor;"
    );
    ModelSpec::parse(&text).unwrap()
}

fn believed() -> ModelSpec {
    reactor("Tc", "")
}

/// Proportional and integral.
fn controller() -> LoopController {
    let controller = Controller::sampled(&[9.0, -8.85], &[1.0, -1.0], (270.0, 340.0)).unwrap();
    LoopController {
        controller,
        input: 0,
        reference: Some(0),
    }
}

fn record(plant: ModelSpec, rows: usize, seed: u64) -> Record {
    let model = Model::new(plant);
    let parameters = [TRUE[0], TRUE[1], 7.2e10, 8750.0];
    let mut simulation = Simulation::new(&model, &parameters, &model.starts(&parameters), 0.0);
    let mut regulator = controller().controller.start(&[302.0]);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = noise::ar1(rows, 0.08, 0.0, &mut rng);
    let steps = excitation::steps(rows, 80..=200, 344.0, 356.0, &mut rng).unwrap();
    let (mut u, mut y, mut reference) = (Vec::new(), Vec::new(), Vec::new());
    let mut wanted = 350.0;
    for (k, noise) in noise.iter().enumerate() {
        wanted += 0.05 * (steps[k] - wanted);
        let mut read = [0.0];
        simulation.read(&[302.0], &mut read);
        let measured = read[0] + noise;
        let command = regulator.command(wanted, measured, INTERVAL);
        let until = INTERVAL * (k + 1) as f64;
        simulation.advance(&[command], &[command], until).unwrap();
        u.push(command);
        y.push(measured);
        reference.push(wanted);
    }
    Record {
        name: "reactor".to_string(),
        time: (0..rows).map(|k| 60.0 * INTERVAL * k as f64).collect(),
        inputs: vec![Channel::new("Tc", "K", u)],
        outputs: vec![Channel::new("T", "K", y)],
        references: vec![Channel::new("r", "K", reference)],
        ..Record::default()
    }
}

fn problem(record: Record) -> ProblemBuilder {
    Problem::builder(believed(), [record]).time_unit(60.0, "min")
}

fn diagnosis(problem: ProblemBuilder) -> Diagnosis {
    let problem = problem.controller(controller()).build().unwrap();
    diagnose(&problem, &Options::default(), &|_| {}).unwrap()
}

fn estimate(found: &Diagnosis, name: &str) -> (f64, f64) {
    let last = found.steps.last().unwrap();
    let of = last.parameters.iter().find(|p| p.name == name).unwrap();
    (of.value, of.std_error.unwrap())
}

/// Without the controller the first fit ends far from the record.
#[test]
fn a_model_without_an_error_is_adequate_in_its_loop() {
    let problem_of = || problem(record(believed(), 1000, 1));
    let found = diagnosis(problem_of().test([record(believed(), 600, 2)]));
    assert_eq!(found.verdict, Verdict::Adequate, "{:?}", found.groups);
    let control_loop = found.control_loop.clone().unwrap();
    assert!(control_loop.simulated && control_loop.needed);
    for (name, value) in ["h", "g"].iter().zip(TRUE) {
        let (found, error) = estimate(&found, name);
        assert!(
            (found - value).abs() < 4.0 * error,
            "{name}: {found} ± {error}"
        );
        assert!(error < 0.01 * value, "{name}: {error}");
    }
    // The held-out record is simulated in its own loop.
    let step = &found.steps[0];
    assert!(step.rmse_per_output["T"] < 0.15, "{step:?}");
    assert!(step.rmse_test_per_output.as_ref().unwrap()["T"] < 0.15);

    let measured = problem_of().build().unwrap();
    match diagnose(&measured, &Options::default(), &|_| {}) {
        Err(Error::Unstable { .. }) => {}
        Ok(found) => assert!(found.steps[0].rmse_per_output["T"] > 1.0),
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn an_actuator_that_lags_is_found() {
    let plant = reactor("q", "der(q) = (Tc - q)/0.06;");
    let found = diagnosis(problem(record(plant, 1000, 3)));
    assert!(
        found.groups[0].contains(&"lag(Tc)".to_string()),
        "{:?}",
        found.groups
    );
    assert_eq!(found.groups.len(), 1);
    let name = found.effects[0].replace(['(', ')'], "_") + "tau";
    let (value, error) = estimate(&found, &name);
    assert!((value - 0.06).abs() < 4.0 * error, "{value} ± {error}");
}
