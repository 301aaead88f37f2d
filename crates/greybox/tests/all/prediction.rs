//! The band of a simulation on other inputs: its exact slopes compared with differences of whole predictions, initial states fitted again,
//! and the coverage of the output without noise.

mod bands;

use std::collections::BTreeMap;

use ct_model::{Model, ModelSpec};
use ct_signals::{ArModel, Channel, Record, excitation, noise};
use greybox::{
    FitUncertainty, InitialStates, ModelSetup, Noise, Stopping, output_errors, steady_state,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::support::Rig;

const LEVEL: f64 = 0.95;
const TIGHT: Stopping = Stopping {
    evaluations: 200,
    cost: 1e-14,
};

/// A heated block with a lagging sensor: no output measures the block directly. The sensor's initial value is a parameter.
const BLOCK: &str = "model Block
  parameter Real C(min=0) = 55;
  parameter Real k(min=0) = 0.9;
  parameter Real T0 = 21;
  parameter Real lag(min=0) = 4;
  input Real u;
  output Real y = S;
  output Real loss = k*(T - 20);
  Real T(start=T0);
  Real S(start=T0);
equation
  C*der(T) = u - k*(T - 20);
  lag*der(S) = T - S;
end Block;";

/// A tank with an outlet by a square root.
const TANK: &str = "model Tank
  parameter Real a(min=0) = 0.9;
  parameter Real g(min=0) = 0.6;
  input Real u;
  output Real y = H;
  Real H(start=4, min=0);
equation
  5*der(H) = g*u - a*sqrt(H);
end Tank;";

fn model(text: &str) -> Model {
    Model::new(ModelSpec::parse(text).unwrap())
}

/// Without noise: with noise the slopes of a fit have a second-order part, the residual times the curvature.
fn inputs(rows: usize, step: f64, outputs: usize, seed: u64) -> Record {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let u = excitation::steps(rows, 10..=30, 2.0, 8.0, &mut rng).unwrap();
    let none = || Channel::new("y", "", vec![f64::NAN; rows]);
    Record {
        name: "inputs".into(),
        time: (0..rows).map(|k| step * k as f64).collect(),
        inputs: vec![Channel::new("u", "", u)],
        outputs: (0..outputs).map(|_| none()).collect(),
        ..Record::default()
    }
}

fn setup<'a>(model: &'a Model, records: &'a [Record]) -> ModelSetup<'a> {
    ModelSetup::new(model, records, &BTreeMap::new(), 1.0).unwrap()
}

/// The record with the outputs that the model gives there, and noise: standard deviation and correlation of each output.
fn measured(
    model: &Model,
    record: &Record,
    x: &[f64],
    of_noise: &[(f64, f64)],
    seed: u64,
) -> Record {
    let records = [record.clone()];
    let outputs = setup(model, &records).simulate(x).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let [mut record] = records;
    for ((channel, clean), (sigma, rho)) in record.outputs.iter_mut().zip(outputs).zip(of_noise) {
        let noise = noise::ar1(clean.len(), *sigma, *rho, &mut rng);
        channel.values = clean.iter().zip(noise).map(|(y, v)| y + v).collect();
    }
    record
}

/// The first rows of a record.
fn first(record: &Record, rows: usize) -> [Record; 1] {
    [record.rows(0..rows)]
}

/// Fitted initial states and the standard errors of all outputs.
fn predicted(
    setup: &ModelSetup,
    parameters: &[f64],
    known: &FitUncertainty,
    rows: usize,
    record: &Record,
) -> (Vec<f64>, Vec<Vec<f64>>) {
    let begun = first(record, rows);
    let frozen = setup.held_out(&begun, parameters).unwrap();
    let free = setup.with_records(&begun).unwrap();
    let count = parameters.len();
    let x = [parameters, &frozen.start()[count..]].concat();
    let states = InitialStates::of_readings(&frozen, &free, &x, count, known, TIGHT);
    let states = states.unwrap().unwrap();
    let x = [parameters, &states.values].concat();
    let errors = output_errors(setup, &x, count, known, &states).unwrap();
    (x, errors)
}

/// Covariance with a single uncertain parameter.
fn of_one(entry: usize, error: f64, outputs: &[f64]) -> FitUncertainty {
    let white = outputs.iter().map(|sigma| ArModel::white(*sigma));
    FitUncertainty {
        entries: vec![entry],
        covariance: vec![vec![error * error]],
        freedom: 1e9,
        noise: Noise::of(white.collect()),
        reading: outputs.to_vec(),
    }
}

#[test]
fn slopes_are_those_of_predictions_with_initial_states_fitted_anew() {
    let model = model(BLOCK);
    let truth = [50.0, 1.0, 22.0, 5.0, 24.0, 22.5];
    let record = inputs(120, 2.0, 2, 3);
    // Without noise: the slopes of a fit to noise have a part of second order, its residual times the curvature.
    let record = measured(&model, &record, &truth, &[(0.0, 0.0), (0.0, 0.0)], 4);
    let records = [record.clone()];
    let setup = setup(&model, &records);
    let parameters = &truth[..4];
    for entry in 0..4 {
        // Such a small noise that the contribution of the readings' errors is negligible.
        let known = of_one(entry, 1.0, &[2e-9, 1e-9]);
        let (x, errors) = predicted(&setup, parameters, &known, 12, &record);
        let h = 1e-5 * truth[entry];
        let moved = |sign: f64| {
            let mut moved = parameters.to_vec();
            moved[entry] += sign * h;
            let (x, _) = predicted(&setup, &moved, &known, 12, &record);
            setup.simulate(&x).unwrap()
        };
        let (above, below) = (moved(1.0), moved(-1.0));
        let at = setup.simulate(&x).unwrap();
        let size = errors.iter().flatten().fold(0.0, |m: f64, e| m.max(*e));
        for (o, errors) in errors.iter().enumerate() {
            for (k, error) in errors.iter().enumerate() {
                let slope = (above[o][k] - below[o][k]) / (2.0 * h);
                let (error, slope) = (*error, slope.abs());
                assert!(
                    (error - slope).abs() <= 1e-4 * size + 1e-9 * at[o][k].abs() / h,
                    "parameter {entry}, output {o}, row {k}: {error} {slope}"
                );
            }
        }
    }
}

#[test]
fn initial_states_of_the_text_move_with_its_parameters() {
    let model = model(BLOCK);
    let records = [inputs(60, 2.0, 2, 5)];
    let setup = setup(&model, &records);
    let parameters = [50.0, 1.0, 22.0, 5.0];
    for entry in 0..4 {
        let known = of_one(entry, 1.0, &[1.0, 1.0]);
        let states = InitialStates::of_text(&model, &parameters, &known.entries);
        assert_eq!(states.values, [22.0, 22.0]);
        let x = [&parameters[..], &states.values].concat();
        let errors = output_errors(&setup, &x, 4, &known, &states).unwrap();
        let h = 1e-5 * parameters[entry];
        let moved = |sign: f64| {
            let mut moved = parameters.to_vec();
            moved[entry] += sign * h;
            let states = InitialStates::of_text(&model, &moved, &[]);
            setup.simulate(&[moved, states.values].concat()).unwrap()
        };
        let (above, below) = (moved(1.0), moved(-1.0));
        for o in 0..2 {
            for k in 0..60 {
                let slope = ((above[o][k] - below[o][k]) / (2.0 * h)).abs();
                assert!(
                    (errors[o][k] - slope).abs() < 1e-6 * (1.0 + slope),
                    "{entry} {o} {k}"
                );
            }
        }
    }
}

#[test]
fn a_plant_rests_where_its_equations_say() {
    for rig in [
        Rig::single_tank(),
        Rig::cascaded_tanks(),
        Rig::linear_tank(),
    ] {
        let mut records = [rig.record(1)];
        records[0].outputs[0].values.fill(f64::NAN);
        let fitted = [rig.record(2)];
        let setup = rig.setup(&fitted);
        let setup = setup.with_records(&records).unwrap();
        let u = records[0].inputs[0].values[0];
        let levels = steady_state(&setup, &rig.theta).unwrap();
        let expected: Vec<f64> = match rig.theta[..] {
            [g, a] => vec![(g * u / a).powi(2)],
            [k, _, offset] if rig.levels.len() == 1 => vec![k * u + offset],
            [g, upper, lower] => vec![(g * u / upper).powi(2), (g * u / lower).powi(2)],
            _ => unreachable!(),
        };
        for (level, expected) in levels.iter().zip(&expected) {
            assert!(
                (level - expected).abs() < 1e-9 * expected.abs(),
                "{level} {expected}"
            );
        }
        assert_eq!(levels.len(), expected.len());
    }
}
