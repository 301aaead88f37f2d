//! Three tanks of 154 cm^2 that are joined by valves, two pumps, the level of T3 measured.

use ct_signals::{Channel, Record, excitation, noise};
use plants::{Command, EffectInfo, Known, Placed, Plant, Scales, Simulator, Structure};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const INTERVAL: f64 = 4.0;
const COMMAND: (f64, f64) = (0.5, 5.5);

/// Known constants of the tanks.
#[must_use]
pub fn known() -> Known {
    Known {
        area: [Some(154.0); 3],
        measured: vec![1],
        orifice: Some(0.5 * (2.0 * 981.0_f64).sqrt()),
        ..Known::default()
    }
}

/// A record with an effect hidden in a tank.
///
/// # Panics
/// Where the effect is none of these tanks: it is a constant of a test.
#[must_use]
#[allow(clippy::expect_used)]
pub fn record(hidden: Option<(&str, usize, &[f64])>, samples: usize, seed: u64) -> Record {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut steps = || {
        let (low, high) = COMMAND;
        excitation::steps(samples, 15..=50, low, high, &mut rng).expect("an excitation")
    };
    let (u, v) = (steps(), steps());
    let e = noise::white(samples, 0.05, &mut rng);
    let duration = INTERVAL * samples as f64;
    let mut scales = Scales::from_ranges(COMMAND, (5.0, 25.0), INTERVAL, duration);
    scales.input_2 = Some(COMMAND);
    let mut structure = Structure::new(Plant::ThreeTank, known(), scales);
    let mut theta = vec![9.0, 8.5, 0.5, 0.54, 0.72];
    if let Some((id, vessel, parameters)) = hidden {
        let effect = EffectInfo::find(id).expect("an effect of the catalogue");
        structure = structure
            .with(Placed { effect, vessel })
            .expect("an effect of this plant");
        theta.extend(parameters);
    }
    let levels = [14.0, 12.0, 9.0];
    let mut simulator =
        Simulator::<f64>::with_inputs(&structure, &theta, &levels, [u[0], v[0]]).expect("a run");
    simulator.set_substeps(2);
    let y = (0..samples)
        .map(|k| {
            let reading = simulator.read(0) + e[k];
            simulator.advance_both([u[k], v[k]].map(Command::held), INTERVAL);
            reading
        })
        .collect();
    Record {
        name: "three tanks".into(),
        time: (0..samples).map(|k| k as f64 * INTERVAL).collect(),
        inputs: vec![Channel::new("u1", "V", u), Channel::new("u2", "V", v)],
        outputs: vec![Channel::new("h3", "cm", y)],
        ..Record::default()
    }
}
