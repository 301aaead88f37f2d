//! Loops around models as text: derivatives, agreement with the built-in plants, several controllers, and coloured noise.

use std::collections::BTreeMap;
use std::sync::Arc;

use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::{Channel, Record, excitation, noise};
use estimation::{Noise, fit_from, residuals, rows};
use greybox::{Error, FitOptions, LoopController, ModelSetup, SimulatedLoop};
use plants::controller::Controller;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{pi, record};
use crate::support::Rig;

const HEATER: &str = "model Heater
  parameter Real C(unit=\"J/K\", min=0) = 60;
  parameter Real k(unit=\"W/K\", min=0) = 0.9;
  parameter Real tau(unit=\"s\", min=0) = 7;
  input Real u(unit=\"W\");
  input Real Ta(unit=\"degC\");
  output Real y(unit=\"degC\") = T;
  Real T(unit=\"degC\", start=20);
equation
  C*der(T) = delay(max(u - 2, 0), tau) - k*(T - Ta);
end Heater;";

/// Two coupled heaters; each has a controller.
const HEATERS: &str = "model Heaters
  parameter Real C(unit=\"J/K\", min=0) = 60;
  parameter Real k(unit=\"W/K\", min=0) = 0.9;
  parameter Real h(unit=\"W/K\", min=0) = 0.5;
  parameter Real e(unit=\"W/K2\", min=0) = 0.004;
  input Real u1(unit=\"W\");
  input Real u2(unit=\"W\");
  output Real y1(unit=\"degC\") = T1;
  output Real y2(unit=\"degC\") = T2;
  Real T1(unit=\"degC\", start=20);
  Real T2(unit=\"degC\", start=20);
equation
  C*der(T1) = u1 - k*(T1 - 20) - e*(T1 - 20)^2 - h*(T1 - T2);
  C*der(T2) = u2 - k*(T2 - 20) - h*(T2 - T1);
end Heaters;";

const INTERVAL: f64 = 3.0;

/// A model with controllers, each with a command of this height at the beginning.
struct Loop {
    model: Model,
    controllers: Vec<LoopController>,
    begin: f64,
}

impl Loop {
    fn new(text: &str, controllers: &[Controller], begin: f64) -> Self {
        let of = |(i, controller): (usize, &Controller)| LoopController {
            controller: controller.clone().at_output(i),
            input: i,
            reference: Some(i),
        };
        Self {
            model: Model::new(ModelSpec::parse(text).unwrap()),
            controllers: controllers.iter().enumerate().map(of).collect(),
            begin,
        }
    }

    /// A record of the loop with autocorrelated noise at its outputs, and this noise.
    fn record(&self, n: usize, sigma: f64, rho: f64, seed: u64) -> (Record, Vec<Vec<f64>>) {
        let spec = self.model.spec();
        let (inputs, outputs) = (spec.inputs.len(), spec.outputs.len());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let references: Vec<Vec<f64>> = (0..self.controllers.len())
            .map(|_| excitation::steps(n, 20..=60, 30.0, 45.0, &mut rng).unwrap())
            .collect();
        let e: Vec<Vec<f64>> = (0..outputs)
            .map(|_| noise::ar1(n, sigma, rho, &mut rng))
            .collect();
        let parameters = self.model.parameters();
        let starts = vec![30.0; spec.states.len()];
        let mut simulation = Simulation::<f64>::new(&self.model, &parameters, &starts, 0.0);
        let mut running: Vec<_> = self
            .controllers
            .iter()
            .map(|of| {
                // The last state that the command sees: the integral, or the operating point.
                let seen = of.controller.linear(INTERVAL).c;
                let seen = seen.iter().rposition(|c| *c != 0.0).unwrap();
                let mut states = vec![0.0; of.controller.states()];
                states[seen] = self.begin;
                of.controller.start(&states)
            })
            .collect();
        let (mut u, mut y) = (vec![Vec::new(); inputs], vec![Vec::new(); outputs]);
        let (mut row, mut read) = (vec![20.0; inputs], vec![0.0; outputs]);
        for k in 0..n {
            for (of, running) in self.controllers.iter().zip(&running) {
                // The command of a controller that depends on earlier readings only.
                if of.controller.linear(INTERVAL).d == 0.0 {
                    row[of.input] = running.clone().command(0.0, 0.0, INTERVAL);
                }
            }
            simulation.read(&row, &mut read);
            for o in 0..outputs {
                read[o] += e[o][k];
                y[o].push(read[o]);
            }
            for (i, (of, running)) in self.controllers.iter().zip(&mut running).enumerate() {
                let reading = read[of.controller.output()];
                row[of.input] = running.command(references[i][k], reading, INTERVAL);
            }
            for (u, value) in u.iter_mut().zip(&row) {
                u.push(*value);
            }
            simulation
                .advance(&row, &row, INTERVAL * (k + 1) as f64)
                .unwrap();
        }
        let channel = |values: Vec<f64>| Channel::new("x", "", values);
        let mut record = Record::sampled(
            "loop",
            INTERVAL,
            u.into_iter().map(channel).collect(),
            y.into_iter().map(channel).collect(),
        );
        record.references = references.into_iter().map(channel).collect();
        (record, e)
    }

    fn setup<'a>(&'a self, records: &'a [Record]) -> ModelSetup<'a> {
        ModelSetup::new(&self.model, records, &BTreeMap::new(), 1.0).unwrap()
    }

    /// The true parameters and initial states of one record.
    fn truth(&self) -> Vec<f64> {
        let mut x = self.model.parameters();
        x.extend(vec![30.0; self.model.spec().states.len()]);
        x
    }

    fn closed<'a>(&'a self, records: &'a [Record]) -> ModelSetup<'a> {
        let setup = self.setup(records);
        let simulated = SimulatedLoop::new(&setup, &self.truth(), &self.controllers).unwrap();
        setup.in_loop(Arc::new(simulated))
    }
}

fn direct() -> String {
    HEATER.replace("= T;\n", "= T + 0.1*u;\n")
}

fn loops() -> Vec<Loop> {
    let limits = (0.0, 30.0);
    let pi = Controller::pi(3.0, 40.0, limits).unwrap();
    // With a filter on the error, and without an integral.
    let filtered = Controller::continuous(&[90.0, 3.0], &[120.0, 30.0, 0.0], INTERVAL, limits);
    let sampled = Controller::sampled(&[2.0, -1.2], &[1.0, -0.4], limits).unwrap();
    vec![
        Loop::new(HEATER, std::slice::from_ref(&pi), 11.0),
        Loop::new(HEATER, std::slice::from_ref(&sampled), 11.0),
        Loop::new(HEATERS, &[pi, filtered.unwrap()], 9.0),
        // The command depends on earlier readings only, and changes its own reading at once.
        Loop::new(
            &direct(),
            &[Controller::sampled(&[0.0, 2.0, -1.9], &[1.0, -1.0], limits).unwrap()],
            11.0,
        ),
    ]
}

/// The filtered rows against central differences of the disturbance, through limits of the command, a dead zone and a dead time.
#[test]
fn derivatives_agree_with_central_differences() {
    for own in loops() {
        let records = [own.record(150, 0.3, 0.8, 4).0];
        let setup = own.closed(&records);
        let mut x = own.truth();
        for (i, value) in x.iter_mut().enumerate() {
            *value *= 1.0 + 0.03 * (i as f64 + 1.0).sin();
        }
        let found = rows(&setup, &x).unwrap();
        let residual = residuals(&setup, &x).unwrap();
        let outputs = residual.len();
        for (j, &i) in setup.free().iter().enumerate() {
            let h = 1e-6 * x[i].abs();
            let at = |by: f64| {
                let mut x = x.clone();
                x[i] += by;
                residuals(&setup, &x).unwrap()
            };
            let (above, below) = (at(h), at(-h));
            let column = found.values.iter().skip(j).step_by(found.columns);
            let scale = column.fold(0.0, |most: f64, value| most.max(value.abs()));
            for k in 0..records[0].len() {
                for o in 0..outputs {
                    let exact = found.values[(o * records[0].len() + k) * found.columns + j];
                    let difference = -(above[o][k] - below[o][k]) / (2.0 * h);
                    assert!(
                        (exact - difference).abs() < 1e-5 * scale,
                        "{}, {}, row {k}, output {o}: {exact} {difference}",
                        own.model.spec().name,
                        setup.names()[i]
                    );
                }
            }
        }
    }
}

/// In a linear loop without limits the disturbance at the true parameters is the noise itself; on the measured inputs too, and the bare
/// difference of the loop's output is not.
#[test]
fn the_disturbance_of_a_linear_loop_is_the_noise() {
    let text = HEATERS.replace("- e*(T1 - 20)^2", "- e*(T1 - 20)");
    let controllers = [
        Controller::pi(3.0, 40.0, (-1e3, 1e3)).unwrap(),
        Controller::pi(2.0, 70.0, (-1e3, 1e3)).unwrap(),
    ];
    let own = Loop::new(&text, &controllers, 9.0);
    let (record, e) = own.record(300, 0.3, 0.9, 5);
    let records = [record];
    let found = residuals(&own.closed(&records), &own.truth()).unwrap();
    for (found, e) in found.iter().zip(&e) {
        let most = found.iter().zip(e).map(|(a, b)| (a - b).abs());
        let most = most.fold(0.0, f64::max);
        assert!(most < 1e-8, "{most}");
    }
}

/// A tank as text and as a kernel: the same rows, in the loop too.
#[test]
fn a_built_in_plant_as_text_has_the_same_rows() {
    let rig = Rig::linear_tank();
    let (mut own, _) = record(&rig, &pi(), 0.3, 0.8, 7);
    let records = [own.clone()];
    let (kernel, x) = rig.setup(&records).in_loop(&pi(), &rig.truth(1)).unwrap();
    let kernel = kernel.rows(&x).unwrap();
    let model = Model::new(rig.plant.spec_of(&rig.known(), &mut own).unwrap());
    let text = [own];
    let setup = ModelSetup::new(&model, &text, &BTreeMap::new(), 1.0).unwrap();
    let controllers = [LoopController {
        controller: pi(),
        input: 0,
        reference: Some(0),
    }];
    let truth = rig.truth(1);
    let simulated = SimulatedLoop::new(&setup, &truth, &controllers).unwrap();
    let as_text = rows(&setup.in_loop(Arc::new(simulated)), &truth).unwrap();
    assert_eq!(kernel.columns, as_text.columns);
    let size = kernel.values.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    for (a, b) in kernel.values.iter().zip(&as_text.values) {
        assert!((a - b).abs() < 1e-8 * size, "{a} {b}");
    }
}

/// White-noise fits to loops with coloured noise: on the measured command the estimates are biased, in the simulated loop they are not.
#[test]
fn coloured_noise_in_a_loop_biases_only_fits_on_the_measured_command() {
    const RECORDS: u64 = 60;
    let text = HEATER
        .replace("delay(max(u - 2, 0), tau)", "u")
        .replace("  parameter Real tau(unit=\"s\", min=0) = 7;\n", "");
    let own = Loop::new(
        &text,
        &[Controller::pi(3.0, 40.0, (0.0, 60.0)).unwrap()],
        9.0,
    );
    let truth = own.truth();
    let estimates: Vec<[Vec<f64>; 2]> = (0..RECORDS)
        .into_par_iter()
        .map(|seed| {
            let records = [own.record(400, 1.0, 0.9, 50 + seed).0];
            let stopping = FitOptions::default().stopping;
            let fit = |setup: &ModelSetup| {
                let white = Noise::white(1);
                fit_from(setup, vec![truth.clone().into()], &white, stopping)
                    .unwrap()
                    .x
            };
            [fit(&own.setup(&records)), fit(&own.closed(&records))]
        })
        .collect();
    // Bias in standard errors of the mean over all records, of the heat capacity and the loss.
    let bias = |way: usize, i: usize| {
        let all = estimates.iter().map(|estimates| estimates[way][i]);
        let n = estimates.len() as f64;
        let mean = all.clone().sum::<f64>() / n;
        let variance = all.map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean - truth[i]) / (variance / n).sqrt()
    };
    for i in 0..2 {
        println!("{:.1} {:.1}", bias(0, i), bias(1, i));
        assert!(bias(1, i).abs() < 3.0, "{i}: {}", bias(1, i));
    }
    assert!((0..2).any(|i| bias(0, i).abs() > 6.0));
}

/// A PI controller may update its integral before or after its command: the records tell. Its first rows may be under manual control.
#[test]
fn the_order_of_the_integral_and_a_beginning_by_hand_are_found() {
    let given = Controller::pi(3.0, 40.0, (0.0, 60.0)).unwrap();
    for truth in [given.clone(), given.with_integral_first().unwrap()] {
        let own = Loop::new(HEATER, std::slice::from_ref(&truth), 11.0);
        let (mut record, _) = own.record(300, 0.3, 0.8, 4);
        record.inputs[0].values[0] += 20.0;
        let records = [record];
        let as_given = Loop::new(HEATER, std::slice::from_ref(&given), 11.0);
        let setup = as_given.setup(&records);
        let found = SimulatedLoop::new(&setup, &own.truth(), &as_given.controllers).unwrap();
        let replay = &found.replays()[0][0];
        assert_eq!(found.controllers()[0].controller, truth);
        assert!(
            replay.rms > 1.0 && replay.usual < 0.1,
            "{} {}",
            replay.rms,
            replay.usual
        );
    }
}

/// The readings that a record lacks follow from the commands, so that a replay agrees with all of them.
#[test]
fn a_replay_needs_no_whole_record() {
    let limits = (0.0, 60.0);
    let pi = Controller::pi(3.0, 40.0, limits).unwrap();
    let own = Loop::new(HEATER, std::slice::from_ref(&pi), 11.0);
    let (mut record, _) = own.record(300, 0.3, 0.8, 4);
    for k in (5..300).step_by(7) {
        record.outputs[0].values[k] = f64::NAN;
    }
    let records = [record];
    let setup = own.setup(&records);
    let found = SimulatedLoop::new(&setup, &own.truth(), &own.controllers).unwrap();
    let replay = &found.replays()[0][0];
    assert!(replay.rms < 1e-9, "{}", replay.rms);
}

#[test]
fn a_loop_that_cannot_be_simulated_says_why() {
    let own = Loop::new(
        &direct(),
        &[Controller::pi(0.1, 40.0, (0.0, 30.0)).unwrap()],
        11.0,
    );
    let records = [own.record(50, 0.1, 0.0, 1).0];
    let closed = |own: &Loop, records: &[Record]| {
        SimulatedLoop::new(&own.setup(records), &own.truth(), &own.controllers).unwrap_err()
    };
    let error = closed(&own, &records);
    assert!(matches!(error, Error::DirectTerm { .. }));
    assert!(error.to_string().contains("y depends on u"), "{error}");
    let own = &loops()[0];
    let (mut record, _) = own.record(50, 0.1, 0.0, 1);
    record.references.clear();
    assert!(matches!(closed(own, &[record]), Error::NoReference { .. }));
}
