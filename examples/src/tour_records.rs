//! The records of the tour: a tank whose level runs against its rim now and then, which the model
//! file that goes with them does not know.
//!
//! They are made by the project's own simulator from a fixed seed, so that anybody can make the
//! same bytes again: `cargo run -p ctid-examples --bin make_records`.

use std::fmt::Write;

use ct_signals::{excitation, noise};
use plants::{Command, EffectInfo, Known, Placed, Plant, Scales, Simulator, Structure};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

/// An error can occur only if the settings below are changed.
pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const SEED: u64 = 5;
/// Sampling interval \[s\].
const INTERVAL: f64 = 2.0;
const FITTED: usize = 900;
const HELD_OUT: usize = 500;

/// Cross-section \[cm^2\]: known.
const AREA: f64 = 154.0;
/// Inflow for a volt \[cm^3/(V s)\], outflow coefficient \[cm^2.5/s\]: to be found.
const PUMP_GAIN: f64 = 9.0;
const ALPHA: f64 = 11.0;
/// Height of the rim \[cm\]: what the model does not know of.
const RIM: f64 = 20.0;
/// Standard deviation of the level sensor's noise \[cm\].
const NOISE: f64 = 0.05;
/// Range of the command \[V\]: the level would rest between 4 and 30 cm.
const COMMAND: (f64, f64) = (2.5, 6.7);

/// The fitted and the held-out record as CSV, in this order.
///
/// # Errors
/// Never, with the settings of this file.
pub fn make() -> Result<[String; 2]> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    Ok([
        record(FITTED, 9.0, &mut rng)?,
        record(HELD_OUT, 14.0, &mut rng)?,
    ])
}

fn record(samples: usize, initial_level: f64, rng: &mut ChaCha8Rng) -> Result<String> {
    // The simulator gets the command as the file will have it.
    let input: Vec<f64> = excitation::steps(samples, 25..=75, COMMAND.0, COMMAND.1, rng)?
        .iter()
        .map(|u| (u * 100.0).round() / 100.0)
        .collect();
    let noise = noise::white(samples, NOISE, rng);
    let duration = samples as f64 * INTERVAL;
    let scales = Scales::from_ranges(COMMAND, (0.0, RIM), INTERVAL, duration);
    let known = Known {
        area: [Some(AREA), None, None],
        ..Known::default()
    };
    let overflow = EffectInfo::find("overflow").ok_or("the catalogue has no overflow")?;
    let tank = Structure::new(Plant::SingleTank, known, scales).with(Placed {
        effect: overflow,
        vessel: 0,
    })?;
    let theta = [PUMP_GAIN, ALPHA, RIM];
    let mut tank = Simulator::<f64>::new(&tank, &theta, &[initial_level], input[0])?;
    tank.set_substeps(4);

    let mut csv = String::from("t [s],u [V],y [cm]\n");
    for (k, (u, noise)) in input.iter().zip(noise).enumerate() {
        let time = k as f64 * INTERVAL;
        writeln!(csv, "{time:.4},{u:.4},{:.4}", tank.read(0) + noise)?;
        tank.advance(Command::held(*u), INTERVAL);
    }
    Ok(csv)
}
