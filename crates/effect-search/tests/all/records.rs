//! Models, and records that they simulate.

use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::{Channel, Record, noise};
use effect_search::{Diagnosis, Options, Problem, Verdict, diagnose};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A block with a heater, in a room; what the user believes.
pub(crate) const BLOCK: &str = r#"model Block
  parameter Real k(unit="W/K", min=0) = 0.8;
  parameter Real g(unit="W/%", min=0) = 1.6;
  final parameter Real C(unit="J/K") = 50;
  input Real u(unit="%");
  input Real Ta(unit="degC");
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20);
equation
  C*der(T) = g*u - k*(T - Ta);
end Block;"#;

/// Two blocks side by side, both read.
pub(crate) const PAIR: &str = r#"model Pair
  parameter Real k1(unit="W/K", min=0) = 0.8;
  parameter Real k2(unit="W/K", min=0) = 0.5;
  parameter Real g(unit="W/%", min=0) = 1.6;
  final parameter Real C(unit="J/K") = 50;
  input Real u(unit="%");
  input Real w(unit="%");
  output Real y1(unit="degC") = T1;
  output Real y2(unit="degC") = T2;
  Real T1(unit="degC", start=20);
  Real T2(unit="degC", start=20);
equation
  C*der(T1) = g*u - k1*(T1 - 20);
  C*der(T2) = g*w - k2*(T2 - 20);
end Pair;"#;

pub(crate) const ROWS: usize = 500;
pub(crate) const STEP: f64 = 5.0;

/// Pseudo-random levels, the same in all tests.
pub(crate) fn level(k: usize, of: usize) -> f64 {
    ((k / (17 + 6 * of) + of) * 7919 % 13) as f64 * 3.0
}

/// A record of a model with its own parameters, the noise of each output of first order.
pub(crate) fn record(text: &str, correlation: f64, sigma: f64, seed: u64) -> Record {
    let input = |name: &str, i: usize, k: usize| match name {
        "Ta" => 15.0 + 4.0 * (0.013 * k as f64).sin(),
        _ => level(k, i),
    };
    record_with(text, input, (correlation, sigma), seed)
}

/// The same with other inputs, of their names, positions and rows.
pub(crate) fn record_with(
    text: &str,
    input: impl Fn(&str, usize, usize) -> f64,
    (correlation, sigma): (f64, f64),
    seed: u64,
) -> Record {
    let spec = ModelSpec::parse(text).unwrap();
    let model = Model::new(spec);
    let parameters = model.parameters();
    let mut simulation =
        Simulation::<f64>::new(&model, &parameters, &model.starts(&parameters), 0.0);
    let spec = model.spec();
    let inputs: Vec<Vec<f64>> = (0..spec.inputs.len())
        .map(|i| {
            let name = &spec.inputs[i].about.name;
            (0..ROWS).map(|k| input(name, i, k)).collect()
        })
        .collect();
    let mut outputs = vec![Vec::new(); spec.outputs.len()];
    let mut row = vec![0.0; outputs.len()];
    for k in 0..ROWS {
        let now: Vec<f64> = inputs.iter().map(|input| input[k]).collect();
        simulation.read(&now, &mut row);
        for (output, value) in outputs.iter_mut().zip(&row) {
            output.push(*value);
        }
        simulation
            .advance(&now, &now, STEP * (k + 1) as f64)
            .unwrap();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for output in &mut outputs {
        let noise = noise::ar1(ROWS, sigma, correlation, &mut rng);
        output.iter_mut().zip(noise).for_each(|(y, e)| *y += e);
    }
    let channel = |(about, values): (&ct_model::About, Vec<f64>)| {
        Channel::new(&about.name, &about.unit, values)
    };
    Record {
        name: "record".to_string(),
        time: (0..ROWS).map(|k| STEP * k as f64).collect(),
        inputs: spec
            .inputs
            .iter()
            .map(|i| &i.about)
            .zip(inputs)
            .map(channel)
            .collect(),
        outputs: spec
            .outputs
            .iter()
            .map(|o| spec.about(o.variable))
            .zip(outputs)
            .map(channel)
            .collect(),
        ..Record::default()
    }
}

/// The believed model with the record.
pub(crate) fn problem(believed: &str, record: Record) -> Problem {
    let spec = ModelSpec::parse(believed).unwrap();
    Problem::builder(spec, [record]).build().unwrap()
}

/// The diagnosis with the default options.
pub(crate) fn found(problem: &Problem) -> Diagnosis {
    diagnose(problem, &Options::default(), &|_| {}).unwrap()
}

/// Whether an effect is in a named group.
pub(crate) fn names(diagnosis: &Diagnosis, effect: &str) -> bool {
    let claims = matches!(
        diagnosis.verdict,
        Verdict::Effect | Verdict::Undecided | Verdict::Partial
    );
    claims && diagnosis.groups.iter().flatten().any(|id| id == effect)
}
