//! A record of a linear tank for the tests of single steps of the search.

#![allow(clippy::unwrap_used)]

use ct_signals::{Hold, Record, Signal, excitation, noise};
use plants::{Command, Known, Plant, Scales, Simulator, Structure};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::Problem;

/// Standard deviation of the noise.
pub(crate) const NOISE: f64 = 0.05;
const SAMPLES: usize = 600;
const INTERVAL: f64 = 2.0;

/// Levels of 12 to 20; what the pump makes of the command, what the sensor reads at a time and a level, and the noise's
/// correlation from sample to sample.
pub(crate) fn problem(
    pump: impl Fn(f64) -> f64,
    sensor: impl Fn(f64, f64) -> f64,
    colour: f64,
    seed: u64,
) -> Problem {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let plant = Plant::SingleTankLinear;
    let scales = Scales::from_ranges((3.0, 5.0), (5.0, 20.0), INTERVAL, 1200.0);
    let structure = Structure::new(plant, Known::default(), scales);
    let u = excitation::steps(SAMPLES, 20..=60, 3.0, 5.0, &mut rng).unwrap();
    let time: Vec<f64> = (0..SAMPLES).map(|k| INTERVAL * k as f64).collect();
    let mut y = noise::ar1(SAMPLES, NOISE, colour, &mut rng);
    let mut simulator =
        Simulator::<f64>::new(&structure, &[4.0, 90.0, 0.0], &[16.0], u[0]).unwrap();
    for (y, (u, t)) in y.iter_mut().zip(u.iter().zip(&time)) {
        *y += sensor(*t, simulator.read());
        simulator.advance(Command::held(pump(*u)), INTERVAL);
    }
    Problem {
        plant,
        known: Known::default(),
        effects: Vec::new(),
        terms: Vec::new(),
        start: Default::default(),
        fixed: Vec::new(),
        records: vec![Record {
            name: "rig".to_string(),
            time,
            input: Signal::new("u", "V", u),
            output: Signal::new("y", "cm", y),
            reference: None,
            hold: Hold::Zero,
        }],
        controller: None,
        test: Vec::new(),
    }
}
