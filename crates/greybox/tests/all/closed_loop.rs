//! The simulated loop: derivatives, a fine reference, replay, and the effect of coloured noise with and without the loop.

mod disturbance;
mod models;
mod unstable;

use crate::support::Rig;
use ct_signals::{Channel, Record, excitation, noise};
use greybox::{Error, replay};
use plants::controller::Controller;
use plants::{Command, Scales, Simulator, Structure};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const LIMITS: (f64, f64) = (0.0, 10.0);

fn pi() -> Controller {
    Controller::pi(0.6, 60.0, LIMITS).unwrap()
}

/// A PI with a filter on the error, as R/S, and one without an integral, which needs an operating point.
fn others() -> [Controller; 2] {
    [
        Controller::continuous(&[18.0, 0.3], &[120.0, 60.0, 0.0], 4.0, LIMITS).unwrap(),
        Controller::sampled(&[0.9, -0.5], &[1.0, -0.4], LIMITS).unwrap(),
    ]
}

/// Runs the rig in a loop; the controller's command begins at 5 V.
fn in_loop(rig: &Rig, controller: &Controller, r: &[f64], noise: &[f64]) -> Record {
    let scales = Scales::from_ranges(
        LIMITS,
        (5.0, 25.0),
        rig.interval,
        rig.interval * r.len() as f64,
    );
    let mut structure = Structure::new(rig.plant, rig.known(), scales);
    for placed in rig.placed() {
        structure = structure.with(placed).unwrap();
    }
    let mut simulator = Simulator::new(&structure, &rig.truth(0), &rig.levels, 5.0).unwrap();
    let linear = controller.linear(rig.interval);
    // The last state that the command sees: the integral, or the operating point.
    let mut states = vec![0.0; controller.states()];
    let seen = linear.c.iter().rposition(|c| *c != 0.0).unwrap();
    states[seen] = 5.0;
    let mut regulator = controller.start(&states);
    let (mut u, mut y) = (Vec::new(), Vec::new());
    for k in 0..r.len() {
        let reading = simulator.read(0) + noise[k];
        let command = regulator.command(r[k], reading, rig.interval);
        simulator.advance(Command::held(command), rig.interval);
        y.push(reading);
        u.push(command);
    }
    Record {
        name: "loop.csv".into(),
        time: (0..r.len()).map(|k| k as f64 * rig.interval).collect(),
        inputs: vec![Channel::new("u", "V", u)],
        outputs: vec![Channel::new("y", "cm", y)],
        references: vec![Channel::new("r", "cm", r.to_vec())],
        ..Record::default()
    }
}

/// Steps of the set point around the level at which the rig begins, and noise.
fn record(
    rig: &Rig,
    controller: &Controller,
    sigma: f64,
    rho: f64,
    seed: u64,
) -> (Record, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let level = *rig.levels.last().unwrap();
    let r = excitation::steps(rig.samples, 20..=60, 0.9 * level, 1.15 * level, &mut rng).unwrap();
    let e = if rho > 0.0 {
        noise::ar1(rig.samples, sigma, rho, &mut rng)
    } else {
        noise::white(rig.samples, sigma, &mut rng)
    };
    (in_loop(rig, controller, &r, &e), e)
}

/// The filtered rows against central differences of the disturbance, for every plant and controller, the controller's
/// initial states among them.
#[test]
fn derivatives_in_the_loop_agree_with_central_differences() {
    for rig in Rig::all() {
        for effects in [
            vec![],
            vec![("pump_deadzone", 0, vec![0.5]), ("pump_lag", 0, vec![6.0])],
            vec![("sensor_lag", 0, vec![5.0])],
        ] {
            let rig = Rig {
                effects,
                ..rig.clone()
            };
            for controller in [pi()].into_iter().chain(others()) {
                let (record, _) = record(&rig, &controller, 0.05, 0.0, 1);
                let records = [record];
                let setup = rig.setup(&records);
                let (setup, x) = setup.in_loop(&controller, &rig.truth(1)).unwrap();
                let setup = setup.with_unknown_controller_states().unwrap();
                assert_eq!(setup.free().len(), x.len());
                let rows = setup.rows(&x).unwrap();
                let residual = &setup.disturbance(&x).unwrap()[0];
                let scale = |j: usize| {
                    let column = rows.values.iter().skip(j).step_by(rows.columns);
                    column.fold(0.0, |most: f64, value| most.max(value.abs()))
                };
                for (j, &i) in setup.free().iter().enumerate() {
                    let h = 1e-6 * x[i].abs().max(1.0);
                    let at = |by: f64| {
                        let mut x = x.clone();
                        x[i] += by;
                        setup.disturbance(&x).unwrap().remove(0)
                    };
                    let (above, below) = (at(h), at(-h));
                    for k in 0..residual.len() {
                        let exact = rows.values[k * rows.columns + j];
                        let difference = -(above[k] - below[k]) / (2.0 * h);
                        assert!(
                            (exact - difference).abs() < 2e-5 * scale(j) + 1e-8,
                            "{} {:?} {}, sample {k}: {exact} {difference}",
                            rig.plant.id(),
                            rig.effects,
                            setup.names()[i]
                        );
                    }
                }
                let last = rows
                    .values
                    .iter()
                    .skip(rows.columns - 1)
                    .step_by(rows.columns);
                assert!(last.zip(residual).all(|(a, b)| (a - b).abs() < 1e-10));
            }
        }
    }
}

/// The loop compared with an integration in a thousand parts of an interval, with an explicit PI controller, through a limit.
#[test]
fn the_loop_agrees_with_a_fine_reference() {
    let rig = Rig {
        samples: 200,
        ..Rig::single_tank()
    };
    let r: Vec<f64> = (0..rig.samples)
        .map(|k| if (k / 50) % 2 == 0 { 14.0 } else { 26.0 })
        .collect();
    let records = [in_loop(&rig, &pi(), &r, &vec![0.0; rig.samples])];
    let (setup, x) = rig.setup(&records).in_loop(&pi(), &rig.truth(1)).unwrap();
    let run = setup.simulate_loop(&x).unwrap().unwrap();
    let (mut level, mut integral, mut most) = (14.0_f64, 0.0, 0.0_f64);
    let mut at_limit = 0;
    for (k, r) in r.iter().enumerate() {
        let e = r - level;
        let wanted: f64 = 5.0 + 0.6 * (e + integral / 60.0);
        let u = wanted.clamp(0.0, 10.0);
        at_limit += usize::from(u != wanted);
        if (wanted - u) * e <= 0.0 {
            integral += 4.0 * e;
        }
        most = most
            .max((run.output[0][k] - level).abs())
            .max((run.command[0][k] - u).abs());
        for _ in 0..1000 {
            let rate = |h: f64| (10.0 * u - 12.5 * h.sqrt()) / 154.0;
            let half = level + 0.002 * rate(level);
            level += 0.004 * rate(half);
        }
    }
    assert!(at_limit > 5);
    assert!(most < 1e-6, "{most}");
}

#[test]
fn a_replay_finds_the_controller_states_and_what_is_not_the_controller() {
    let rig = Rig::single_tank();
    for controller in [pi()].into_iter().chain(others()) {
        let (mut record, _) = record(&rig, &controller, 0.1, 0.8, 3);
        let exact = replay(&controller, &record).unwrap();
        assert!(exact.rms < 1e-10 && exact.moves > 0.1, "{exact:?}");
        // A converter of 10 bits has no effect; a manual action of an operator is detected and estimated.
        for u in &mut record.inputs[0].values {
            *u = (*u * 102.3).round() / 102.3;
        }
        let rounded = replay(&controller, &record).unwrap();
        assert!(rounded.rms < 0.02 * rounded.moves, "{}", rounded.rms);
        for u in &mut record.inputs[0].values[100..200] {
            *u += 1.0;
        }
        let moved = replay(&controller, &record).unwrap();
        assert!(moved.rms > 0.3, "{}", moved.rms);
        let strong = Controller::pi(1.2, 60.0, LIMITS).unwrap();
        let other = replay(&strong, &record).unwrap();
        assert!(other.rms > 0.1 * other.moves, "{}", other.rms);
    }
}

#[test]
fn a_loop_that_cannot_be_simulated_says_why() {
    let rig = Rig::single_tank();
    let (good, _) = record(&rig, &pi(), 0.1, 0.0, 3);
    let said = |record: Record| -> Error {
        let records = [record];
        let error = rig
            .setup(&records)
            .in_loop(&pi(), &rig.truth(1))
            .unwrap_err();
        assert!(!error.to_string().contains('\n'));
        error
    };
    let error = said(Record {
        references: Vec::new(),
        ..good.clone()
    });
    assert!(matches!(error, Error::NoReference { .. }));
    assert!(
        error.to_string().contains("`Record::references`"),
        "{error}"
    );
    let constant = Channel::new("r", "cm", vec![14.0; good.len()]);
    let error = said(Record {
        references: vec![constant],
        ..good.clone()
    });
    assert!(matches!(
        error,
        Error::ConstantReference { value: 14.0, .. }
    ));
    let ramps = good.inputs[0].clone().with_hold(ct_signals::Hold::First);
    let error = said(Record {
        inputs: vec![ramps],
        ..good
    });
    assert!(matches!(error, Error::CommandNotHeld { .. }));
}
