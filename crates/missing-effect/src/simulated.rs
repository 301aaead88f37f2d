//! Simulated records for the tests of this crate.
#![allow(clippy::unwrap_used)]

use ct_signals::{Channel, Record, excitation, noise};
use plants::{Command, Known, Plant, Scales, Simulator, Structure};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::Problem;

/// Standard deviation of the noise on the reading \[cm\].
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
    through(
        structure,
        theta,
        command,
        samples,
        |u| u,
        |_, level| level,
        0.0,
        rng,
    )
}

/// Record of a linear tank at levels of 12 to 20 cm, and a believed model with one tank. The arguments give the actuator's characteristic,
/// the sensor's reading as a function of time and level, and the noise's correlation from sample to sample.
pub(crate) fn tank(
    pump: impl Fn(f64) -> f64,
    sensor: impl Fn(f64, f64) -> f64,
    colour: f64,
    seed: u64,
) -> Problem {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (plant, range, samples) = (Plant::SingleTankLinear, (3.0, 5.0), 600);
    let scales = Scales::from_ranges(range, (5.0, 20.0), INTERVAL, INTERVAL * samples as f64);
    let structure = Structure::new(plant, Known::default(), scales);
    let theta = [4.0, 90.0, 0.0];
    let record = through(
        &structure, &theta, range, samples, pump, sensor, colour, &mut rng,
    );
    problem(plant, Known::default(), vec![record])
}

/// Record of both levels of two linear tanks; the upper reading has four times the noise of the lower one.
pub(crate) fn two_levels(seed: u64) -> Problem {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (plant, range, samples) = (Plant::CascadedTanksLinear, (3.0, 5.0), 600);
    let known = Known {
        measured: vec![0, 1],
        ..Known::default()
    };
    let scales = Scales::from_ranges(range, (5.0, 20.0), INTERVAL, INTERVAL * samples as f64);
    let structure = Structure::new(plant, known.clone(), scales);
    let u = excitation::steps(samples, 20..=60, range.0, range.1, &mut rng).unwrap();
    let mut levels = [4.0, 1.0].map(|times| noise::white(samples, times * NOISE, &mut rng));
    let theta = [4.0, 40.0, 90.0, 0.0];
    let mut simulator = Simulator::<f64>::new(&structure, &theta, &[16.0; 2], u[0]).unwrap();
    for k in 0..samples {
        for (output, readings) in levels.iter_mut().enumerate() {
            readings[k] += simulator.read(output);
        }
        simulator.advance(Command::held(u[k]), INTERVAL);
    }
    let [upper, lower] = levels;
    let levels = vec![
        Channel::new("upper", "cm", upper),
        Channel::new("lower", "cm", lower),
    ];
    let record = Record::sampled(
        "simulated",
        INTERVAL,
        vec![Channel::new("u", "V", u)],
        levels,
    );
    problem(plant, known, vec![record])
}

#[allow(clippy::too_many_arguments)]
fn through(
    structure: &Structure,
    theta: &[f64],
    command: (f64, f64),
    samples: usize,
    pump: impl Fn(f64) -> f64,
    sensor: impl Fn(f64, f64) -> f64,
    colour: f64,
    rng: &mut ChaCha8Rng,
) -> Record {
    let u = excitation::steps(samples, 20..=60, command.0, command.1, rng).unwrap();
    let time: Vec<f64> = (0..samples).map(|k| k as f64 * INTERVAL).collect();
    let mut y = noise::ar1(samples, NOISE, colour, rng);
    let mut simulator = Simulator::<f64>::new(structure, theta, &[16.0], u[0]).unwrap();
    for (y, (u, t)) in y.iter_mut().zip(u.iter().zip(&time)) {
        *y += sensor(*t, simulator.read(0));
        simulator.advance(Command::held(pump(*u)), INTERVAL);
    }
    Record {
        name: "simulated".to_string(),
        time,
        inputs: vec![Channel::new("u", "V", u)],
        outputs: vec![Channel::new("y", "cm", y)],
        ..Record::default()
    }
}

/// A believed plant without effects for the records.
pub(crate) fn problem(plant: Plant, known: Known, records: Vec<Record>) -> Problem {
    Problem::builder(plant, known, records).build().unwrap()
}
