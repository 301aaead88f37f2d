//! Simulated records for the tests of this crate.
#![allow(clippy::unwrap_used)]

use ct_signals::{Hold, Record, Signal, excitation, noise};
use plants::{Command, Known, Plant, Simulator, Structure};
use rand_chacha::ChaCha8Rng;

use crate::Problem;

/// Standard deviation of the white noise on the reading \[cm\].
pub(crate) const NOISE: f64 = 0.05;
/// Sampling interval \[s\].
pub(crate) const INTERVAL: f64 = 2.0;

/// A tank whose level begins at 16 cm, under random steps of the command in a range.
pub(crate) fn record(
    structure: &Structure,
    theta: &[f64],
    command: (f64, f64),
    samples: usize,
    rng: &mut ChaCha8Rng,
) -> Record {
    let u = excitation::steps(samples, 20..=60, command.0, command.1, rng).unwrap();
    let mut y = noise::white(samples, NOISE, rng);
    let mut simulator = Simulator::<f64>::new(structure, theta, &[16.0], u[0]).unwrap();
    for (y, u) in y.iter_mut().zip(&u) {
        *y += simulator.read();
        simulator.advance(Command::held(*u), INTERVAL);
    }
    Record {
        name: "simulated".to_string(),
        time: (0..samples).map(|k| k as f64 * INTERVAL).collect(),
        input: Signal::new("u", "V", u),
        output: Signal::new("y", "cm", y),
        reference: None,
        hold: Hold::Zero,
    }
}

/// A plant without effects that is believed of the records.
pub(crate) fn problem(plant: Plant, known: Known, records: Vec<Record>) -> Problem {
    Problem {
        plant,
        known,
        effects: Vec::new(),
        terms: Vec::new(),
        start: Default::default(),
        fixed: Vec::new(),
        records,
        controller: None,
        test: Vec::new(),
    }
}
