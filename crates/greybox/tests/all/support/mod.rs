//! Simulated rigs with a known truth.
#![allow(dead_code, clippy::unwrap_used)]

use std::collections::BTreeMap;

use ct_signals::{Channel, Hold, Record, excitation, noise};
use greybox::{Setup, Stopping};
use plants::{Command, EffectInfo, Known, Placed, Plant, Scales, Simulator, Structure};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Known constants of a plant: tanks of 154 cm^2, a pump with a range to 10 V.
pub fn known(plant: Plant) -> Known {
    let area = match plant {
        Plant::SingleTank => [Some(154.0), None, None],
        Plant::CascadedTanks => [Some(154.0), Some(154.0), None],
        Plant::ThreeTank => [Some(154.0); 3],
        _ => [None; 3],
    };
    Known {
        area,
        input_range: Some(10.0),
        measured: plant.joined().then_some(1).into_iter().collect(),
        ..Known::default()
    }
}

/// A plant, what is built into it, and the noise on its sensor.
#[derive(Debug, Clone)]
pub struct Rig {
    pub plant: Plant,
    pub effects: Vec<(&'static str, usize, Vec<f64>)>,
    pub theta: Vec<f64>,
    /// Initial level of each vessel.
    pub levels: Vec<f64>,
    pub command: (f64, f64),
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Correlation of the noise from sample to sample; zero is white.
    pub rho: f64,
    pub samples: usize,
    pub interval: f64,
    pub hold: Hold,
}

impl Rig {
    /// A tank of 154 cm^2 whose level stands near 16 cm; time constant about 100 s.
    pub fn single_tank() -> Self {
        Self {
            plant: Plant::SingleTank,
            effects: Vec::new(),
            theta: vec![10.0, 12.5],
            levels: vec![14.0],
            command: (3.5, 6.5),
            noise: 0.05,
            rho: 0.0,
            samples: 400,
            interval: 4.0,
            hold: Hold::Zero,
        }
    }

    /// Two tanks in series, the lower one measured: time constants of about 50 s and 100 s, commands so wide that
    /// the two cannot be mistaken for each other.
    pub fn cascaded_tanks() -> Self {
        Self {
            plant: Plant::CascadedTanks,
            theta: vec![10.0, 18.0, 12.5],
            levels: vec![7.0, 14.0],
            command: (2.0, 8.0),
            samples: 500,
            ..Self::single_tank()
        }
    }

    /// Three tanks of 154 cm^2 joined by valves, T3 measured, a pump into T1 and one into T2. The commands are so wide that water
    /// flows either way.
    pub fn three_tank() -> Self {
        Self {
            plant: Plant::ThreeTank,
            theta: vec![9.0, 8.5, 11.0, 12.0, 16.0],
            levels: vec![14.0, 12.0, 9.0],
            command: (0.5, 5.5),
            samples: 600,
            ..Self::single_tank()
        }
    }

    /// A lag of 100 s with an offset.
    pub fn linear_tank() -> Self {
        Self {
            plant: Plant::SingleTankLinear,
            theta: vec![6.4, 100.0, -16.0],
            ..Self::single_tank()
        }
    }

    /// A rig for every plant.
    pub fn all() -> Vec<Self> {
        vec![
            Self::single_tank(),
            Self::cascaded_tanks(),
            Self::linear_tank(),
            Self {
                plant: Plant::CascadedTanksLinear,
                theta: vec![6.4, 60.0, 100.0, -16.0],
                levels: vec![30.0, 14.0],
                ..Self::single_tank()
            },
            Self {
                plant: Plant::FirstOrder,
                theta: vec![3.2, 100.0],
                ..Self::single_tank()
            },
        ]
    }

    pub fn known(&self) -> Known {
        Known {
            tank_height: Some(60.0),
            ..known(self.plant)
        }
    }

    pub fn placed(&self) -> Vec<Placed> {
        self.effects
            .iter()
            .map(|&(id, vessel, _)| Placed {
                effect: EffectInfo::find(id).unwrap(),
                vessel,
            })
            .collect()
    }

    /// The parameters of plant and effects, then for each of `records` records the initial levels and lags at rest.
    pub fn truth(&self, records: usize) -> Vec<f64> {
        let mut truth = self.theta.clone();
        for (_, _, parameters) in &self.effects {
            truth.extend(parameters);
        }
        let lags = self.effects.iter().filter(|(id, ..)| id.ends_with("_lag"));
        for _ in 0..records {
            truth.extend(&self.levels);
            truth.extend(lags.clone().map(|_| 0.0));
        }
        truth
    }

    /// Runs the rig under random steps; effects have to be listed in chain order.
    pub fn record(&self, seed: u64) -> Record {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (low, high) = self.command;
        let u = excitation::steps(self.samples, 10..=40, low, high, &mut rng).unwrap();
        let e = if self.rho == 0.0 {
            noise::white(self.samples, self.noise, &mut rng)
        } else {
            noise::ar1(self.samples, self.noise, self.rho, &mut rng)
        };
        self.run(&u, &e)
    }

    /// Runs the rig under a given command and noise.
    pub fn run(&self, u: &[f64], noise: &[f64]) -> Record {
        // Command of the second pump of joined tanks: another course of the same kind.
        let second = self.plant.joined().then(|| {
            let n = u.len();
            let mirror = |k| self.command.0 + self.command.1 - u[(k + n / 3) % n];
            (0..n).map(mirror).collect::<Vec<f64>>()
        });
        let mut scales = Scales::from_ranges(
            self.command,
            (5.0, 25.0),
            self.interval,
            self.interval * self.samples as f64,
        );
        scales.input_2 = second.as_ref().map(|_| self.command);
        let mut structure = Structure::new(self.plant, self.known(), scales);
        for placed in self.placed() {
            structure = structure.with(placed).unwrap();
        }
        let theta = &self.truth(0);
        let told = |k: usize| second.as_ref().map_or(0.0, |u| u[k]);
        let at_rest = [u[0], told(0)];
        let mut simulator =
            Simulator::with_inputs(&structure, theta, &self.levels, at_rest).unwrap();
        let y = (0..u.len())
            .map(|k| {
                let reading = simulator.read(0) + noise[k];
                if k + 1 < u.len() {
                    let command = match self.hold {
                        Hold::Zero => Command::held(u[k]),
                        Hold::First => Command::ramp(u[k], u[k + 1]),
                    };
                    let second = match self.hold {
                        Hold::Zero => Command::held(told(k)),
                        Hold::First => Command::ramp(told(k), told(k + 1)),
                    };
                    simulator.advance_both([command, second], self.interval);
                }
                reading
            })
            .collect();
        Record {
            name: "rig".into(),
            time: (0..u.len()).map(|k| k as f64 * self.interval).collect(),
            inputs: [
                Some(Channel::new("u", "V", u.to_vec())),
                second.map(|values| Channel::new("u2", "V", values)),
            ]
            .into_iter()
            .flatten()
            .map(|input| input.with_hold(self.hold))
            .collect(),
            outputs: vec![Channel::new("y", "cm", y)],
            ..Record::default()
        }
    }

    pub fn setup<'a>(&self, records: &'a [Record]) -> Setup<'a> {
        Setup::from_records(
            self.plant,
            self.known(),
            &self.placed(),
            records,
            BTreeMap::new(),
        )
        .unwrap()
    }
}

/// Far beyond what a record can tell.
pub const PRECISE: Stopping = Stopping {
    evaluations: 300,
    cost: 1e-14,
};
