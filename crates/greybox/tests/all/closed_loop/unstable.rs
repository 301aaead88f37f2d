//! A model that does not follow its records on the measured inputs: a pendulum that its controller keeps upright.

use std::collections::BTreeMap;
use std::sync::Arc;

use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::{Channel, Record, excitation, noise};
use estimation::{residuals, rows};
use greybox::{FitOptions, LoopController, ModelSetup, SimulatedLoop};
use plants::controller::Controller;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

const INTERVAL: f64 = 0.01;
/// J, mgl and b of the records.
const TRUE: [f64; 3] = [0.03, 1.3, 0.02];
/// Unstable eigenvalue of the pendulum for small angles \[1/s\].
const RATE: f64 = 6.257_907;

/// A pendulum; `torque`: of its weight, by the angle.
fn pendulum(torque: &str) -> Model {
    let text = format!(
        "model Pendulum
           parameter Real J(unit=\"kg.m2\", min=0.001) = 0.04;
           parameter Real mgl(unit=\"N.m\", min=0) = 1.0;
           parameter Real b(unit=\"N.m.s\", min=0) = 0.03;
           input Real i(unit=\"A\");
           output Real theta(unit=\"rad\", start=0);
           Real w(unit=\"rad/s\", start=0);
         equation
           der(theta) = w;
           J*der(w) = mgl*{torque} - b*w + 0.4*i;
         end Pendulum;"
    );
    Model::new(ModelSpec::parse(&text).unwrap())
}

fn controller() -> LoopController {
    let controller = Controller::sampled(&[118.0, -100.0], &[1.0, -0.5], (-20.0, 20.0)).unwrap();
    LoopController {
        controller,
        input: 0,
        reference: Some(0),
    }
}

/// A record of the loop from rest, with white noise at the reading.
fn record(model: &Model, n: usize, sigma: f64, seed: u64) -> Record {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let reference = excitation::steps(n, 40..=140, -0.25, 0.25, &mut rng).unwrap();
    let e = noise::ar1(n, sigma, 0.0, &mut rng);
    let mut simulation = Simulation::<f64>::new(model, &TRUE, &[0.0, 0.0], 0.0);
    let mut running = controller().controller.start(&[]);
    let (mut i, mut theta) = (Vec::new(), Vec::new());
    for k in 0..n {
        let mut read = [0.0];
        simulation.read(&[0.0], &mut read);
        theta.push(read[0] + e[k]);
        let command = running.command(reference[k], theta[k], INTERVAL);
        i.push(command);
        let until = INTERVAL * (k + 1) as f64;
        simulation.advance(&[command], &[command], until).unwrap();
    }
    let channel = |values: Vec<f64>| Channel::new("x", "", values);
    let mut record = Record::sampled("loop", INTERVAL, vec![channel(i)], vec![channel(theta)]);
    record.references = vec![channel(reference)];
    record
}

fn setup<'a>(model: &'a Model, records: &'a [Record]) -> ModelSetup<'a> {
    ModelSetup::new(model, records, &BTreeMap::new(), 1.0).unwrap()
}

/// In the loop that the model needs, from the start values of its text.
fn in_loop<'a>(model: &'a Model, records: &'a [Record]) -> ModelSetup<'a> {
    let setup = setup(model, records);
    let needed = SimulatedLoop::needed(&setup, setup.start(), &[controller()]).unwrap();
    setup.in_loop(Arc::new(needed))
}

fn truth() -> Vec<f64> {
    [&TRUE[..], &[0.0, 0.0]].concat()
}

#[test]
fn a_model_follows_its_inputs_if_it_does_not_grow_far() {
    let model = pendulum("sin(theta)");
    let long = [record(&model, 400, 0.0004, 1)];
    let short = [long[0].rows(0..100)];
    assert!(!setup(&model, &long).follows_inputs(&truth()));
    assert!(setup(&model, &short).follows_inputs(&truth()));
    let hanging = pendulum("(-theta)");
    assert!(setup(&hanging, &long).follows_inputs(&truth()));
}

/// The response follows the residual: rows and their derivatives stay bounded, and agree with central differences.
#[test]
fn derivatives_agree_with_central_differences() {
    let model = pendulum("sin(theta)");
    let mut record = record(&model, 300, 0.0004, 2);
    for k in 100..110 {
        record.outputs[0].values[k] = f64::NAN;
    }
    let records = [record];
    let setup = in_loop(&model, &records);
    let x: Vec<f64> = setup.start().iter().map(|value| value + 1e-3).collect();
    let found = rows(&setup, &x).unwrap();
    for (j, &i) in setup.free().iter().enumerate() {
        let h = 1e-6 * x[i].abs();
        let at = |by: f64| {
            let mut x = x.clone();
            x[i] += by;
            residuals(&setup, &x).unwrap().remove(0)
        };
        let (above, below) = (at(h), at(-h));
        let column = found.values.iter().skip(j).step_by(found.columns);
        let scale = column.fold(0.0, |most: f64, value| most.max(value.abs()));
        for k in (0..300).filter(|k| !(100..110).contains(k)) {
            let exact = found.values[k * found.columns + j];
            let difference = -(above[k] - below[k]) / (2.0 * h);
            assert!(
                (exact - difference).abs() < 1e-4 * scale,
                "{}, row {k}: {exact} {difference}",
                setup.names()[i]
            );
        }
    }
}

/// At the true parameters of a linear plant the residual is the noise through an all-pass filter: white, and larger than the noise by the
/// unstable eigenvalue of a sampling interval.
#[test]
fn the_residual_at_the_truth_is_white() {
    let (model, sigma, n) = (pendulum("theta"), 0.0004, 4000);
    let records = [record(&model, n, sigma, 3)];
    let measured = setup(&model, &records);
    let needed = SimulatedLoop::needed(&measured, &truth(), &[controller()]).unwrap();
    let found = residuals(&measured.in_loop(Arc::new(needed)), &truth()).unwrap();
    // Without the beginning, in which the filter settles.
    let e = &found[0][200..];
    let power = e.iter().map(|e| e * e).sum::<f64>();
    let ratio = (power / e.len() as f64).sqrt() / sigma;
    let expected = (RATE * INTERVAL).exp();
    assert!((ratio / expected - 1.0).abs() < 0.03, "{ratio} {expected}");
    for lag in 1..5 {
        let product: f64 = e.windows(lag + 1).map(|e| e[0] * e[lag]).sum();
        assert!(
            (product / power).abs() < 4.0 / (e.len() as f64).sqrt(),
            "{lag}"
        );
    }
}

/// The 95 % intervals of fits from the wrong values of the text.
#[test]
fn intervals_contain_the_truth() {
    let model = pendulum("sin(theta)");
    let options = FitOptions {
        starts: 2,
        ..FitOptions::default()
    };
    let hits: Vec<[bool; 3]> = (0..60)
        .into_par_iter()
        .map(|seed| {
            let records = [record(&model, 400, 0.0004, 100 + seed)];
            let setup = in_loop(&model, &records);
            let fit = setup.fit(&options).unwrap();
            let errors = setup.robust(&fit, 3).unwrap().std_errors;
            std::array::from_fn(|i| (fit.x[i] - TRUE[i]).abs() < 1.96 * errors[i].unwrap())
        })
        .collect();
    for i in 0..3 {
        let hits = hits.iter().filter(|hits| hits[i]).count();
        // 57 on average; fewer than 52 with a probability of 0.003.
        assert!(hits >= 52, "{}: {hits} of 60", ["J", "mgl", "b"][i]);
    }
}

/// Held-out records run in their own loop, and the outputs of a simulation are those of the states.
#[test]
fn simulations_run_in_the_loop() {
    let model = pendulum("sin(theta)");
    let records = [record(&model, 400, 0.0004, 4)];
    let others = [record(&model, 500, 0.0004, 5)];
    let setup = in_loop(&model, &records);
    let rms = |simulated: &[f64], record: &Record| {
        let pairs = simulated.iter().zip(&record.outputs[0].values);
        (pairs.map(|(m, y)| (y - m).powi(2)).sum::<f64>() / simulated.len() as f64).sqrt()
    };
    let simulated = setup.simulate(&truth()).unwrap();
    assert_eq!(simulated[0], setup.simulate_states(&truth()).unwrap()[0]);
    assert!(rms(&simulated[0], &records[0]) < 0.002);
    let held_out = setup.held_out(&others, &truth()).unwrap();
    assert!(rms(&held_out.simulate(&truth()).unwrap()[0], &others[0]) < 0.002);
    // Slightly wrong parameters: the loop hardly notices, the model on the measured inputs falls.
    let near: Vec<f64> = truth().iter().map(|value| 1.01 * value).collect();
    assert!(rms(&setup.simulate(&near).unwrap()[0], &records[0]) < 0.005);
    let measured = self::setup(&model, &records);
    assert!(rms(&measured.simulate(&near).unwrap()[0], &records[0]) > 0.1);
}
