//! The band of a simulation on other inputs: its exact slopes against differences of whole predictions, initial states fitted anew, and how
//! often it covers the output without noise.

use std::collections::BTreeMap;

use ct_model::{Model, ModelSpec};
use ct_signals::{ArModel, Channel, Record, excitation, noise};
use greybox::{
    FitOptions, FitUncertainty, InitialStates, ModelSetup, Noise, Setup, Stopping, coloured, fit,
    levels_from_readings, output_errors, steady_state,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::support::Rig;

const LEVEL: f64 = 0.95;
const TIGHT: Stopping = Stopping {
    evaluations: 200,
    cost: 1e-14,
};

/// A heated block whose sensor lags: the block is in no reading. The sensor begins where a parameter says.
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

/// A record of steps of the input; `outputs` in it are NaN.
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

/// Knowledge of one parameter alone.
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
        // Noise so small that the readings' own part of the error is nothing.
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

/// Fits of the tests; `RECORDS=200` takes so many.
const RECORDS: u64 = 60;

fn records() -> u64 {
    std::env::var("RECORDS").map_or(RECORDS, |records| records.parse().unwrap())
}

/// The pooled share of covered rows is near 95 %: in 93 to 97 % for 200 fits or more, for fewer as much wider as the mean of fewer scatters.
fn check(name: &str, shares: &[f64]) {
    let n = shares.len() as f64;
    let mean = shares.iter().sum::<f64>() / n;
    let wide = 0.02 * (200.0 / n).sqrt().max(1.0);
    println!("{name}: {mean:.4} of {n} fits");
    assert!((mean - LEVEL).abs() <= wide, "{name}: {mean} of {n} fits");
}

/// The share of rows of an output in which the band covers the output without noise.
fn covered(mean: &[f64], errors: &[f64], clean: &[f64], quantile: f64) -> f64 {
    let rows = mean.iter().zip(errors).zip(clean);
    let inside = rows.filter(|((mean, error), clean)| (*mean - *clean).abs() <= quantile * *error);
    inside.count() as f64 / mean.len() as f64
}

/// Fits a record of a text's model, predicts on other inputs; the share of covered rows by output. `first_rows`: to which initial states are
/// fitted; none where they are those of the text.
fn share(
    text: &str,
    truth: &[f64],
    of_noise: &[(f64, f64)],
    first_rows: Option<usize>,
    seed: u64,
) -> Vec<f64> {
    let model = model(text);
    let count = model.parameters().len();
    let outputs = model.spec().outputs.len();
    let options = FitOptions {
        starts: 4,
        ..FitOptions::default()
    };
    let fitted = measured(
        &model,
        &inputs(300, 2.0, outputs, 2 * seed),
        truth,
        of_noise,
        seed,
    );
    let fitted = [fitted];
    let own = setup(&model, &fitted);
    let fit = own.fit(&options).unwrap();
    let known = FitUncertainty::of(&own, &fit, count, 6).unwrap().unwrap();
    let other = inputs(150, 2.0, outputs, 2 * seed + 1);
    let states = first_rows.map_or_else(
        || model.starts(&truth[..count]),
        |_| truth[count..].to_vec(),
    );
    let true_x = [&truth[..count], &states].concat();
    let others = [other.clone()];
    let clean = setup(&model, &others).simulate(&true_x).unwrap();
    let other = match first_rows {
        None => other,
        Some(_) => measured(&model, &other, &true_x, of_noise, seed + 10_000),
    };
    let others = [other.clone()];
    let on_others = own.with_records(&others).unwrap();
    let parameters = &fit.x[..count];
    let (x, errors) = match first_rows {
        Some(rows) => predicted(&on_others, parameters, &known, rows, &other),
        None => {
            let states = InitialStates::of_text(&model, parameters, &known.entries);
            let x = [parameters, &states.values].concat();
            let errors = output_errors(&on_others, &x, count, &known, &states).unwrap();
            (x, errors)
        }
    };
    let mean = on_others.simulate(&x).unwrap();
    let each = mean.iter().zip(&errors).zip(&clean);
    let q = known.quantile(LEVEL);
    // Where a known state begins nothing is uncertain.
    let from = usize::from(first_rows.is_none());
    each.map(|((m, e), c)| covered(&m[from..], &e[from..], &c[from..], q))
        .collect()
}

#[test]
fn the_band_covers_the_output_without_noise() {
    let tank = [1.0, 0.5, 4.0];
    let block = [50.0, 1.0, 22.0, 5.0, 24.0, 22.5];
    type Setting<'s> = (&'s str, &'s str, &'s [f64], &'s [(f64, f64)], Option<usize>);
    let settings: [Setting; 3] = [
        (
            "tank, white noise, start of the text",
            TANK,
            &tank,
            &[(0.05, 0.0)],
            None,
        ),
        (
            "tank, coloured noise, first readings",
            TANK,
            &tank,
            &[(0.05, 0.7)],
            Some(5),
        ),
        (
            "block, two outputs, first readings",
            BLOCK,
            &block,
            &[(0.05, 0.0), (0.1, 0.5)],
            Some(5),
        ),
    ];
    for (name, text, truth, of_noise, rows) in settings {
        let shares: Vec<Vec<f64>> = (0..records())
            .into_par_iter()
            .map(|seed| share(text, truth, of_noise, rows, seed))
            .collect();
        for o in 0..of_noise.len() {
            let own: Vec<f64> = shares.iter().map(|share| share[o]).collect();
            check(&format!("{name}, output {o}"), &own);
        }
    }
}

/// A plant at rest under the first inputs, and from readings.
fn share_of_plant(rig: &Rig, readings: bool, seed: u64) -> f64 {
    let records = [rig.record(seed)];
    let own = rig.setup(&records);
    let options = FitOptions::default();
    let fit = fit(&own, &options).unwrap();
    let fit = coloured(&own, fit, 6, options.stopping).unwrap();
    let count = own.parameter_count();
    let known = FitUncertainty::of(&own, &fit, count, 6).unwrap().unwrap();
    let mut other = rig.record(seed + 10_000);
    if !readings {
        other.outputs[0].values.fill(f64::NAN);
    }
    let others = [other.clone()];
    let on_others = own.with_records(&others).unwrap();
    let truth = rig.truth(1);
    let parameters = &fit.x[..count];
    let rest = |p: &[f64]| steady_state(&on_others, p);
    let (states, true_states) = if readings {
        let begun = first(&other, 5);
        let free = own.with_records(&begun).unwrap();
        let mut frozen = free.clone();
        frozen.freeze_parameters();
        let x = [parameters, &levels_from_readings(&free, parameters)].concat();
        let states = InitialStates::of_readings(&frozen, &free, &x, count, &known, TIGHT);
        (states.unwrap().unwrap(), truth[count..].to_vec())
    } else {
        let states = InitialStates::of_parameters(rest, parameters, Some(&known)).unwrap();
        (states, rest(&truth[..count]).unwrap())
    };
    let simulate = |setup: &Setup, p: &[f64], states: &[f64]| {
        setup
            .simulate(&[p, states].concat())
            .unwrap()
            .output
            .swap_remove(0)
    };
    let clean = simulate(&on_others, &truth[..count], &true_states);
    let mean = simulate(&on_others, parameters, &states.values);
    let x = [parameters, &states.values].concat();
    let errors = output_errors(&on_others, &x, count, &known, &states).unwrap();
    covered(&mean, &errors[0], &clean, known.quantile(LEVEL))
}

#[test]
fn the_band_of_a_plant_covers_the_output_without_noise() {
    for (readings, rho) in [(true, 0.0), (true, 0.6), (false, 0.6)] {
        let rig = Rig {
            rho,
            ..Rig::cascaded_tanks()
        };
        let shares: Vec<f64> = (0..records())
            .into_par_iter()
            .map(|seed| share_of_plant(&rig, readings, seed))
            .collect();
        check(
            &format!("two tanks, readings {readings}, rho {rho}"),
            &shares,
        );
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
