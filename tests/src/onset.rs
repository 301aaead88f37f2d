//! Loops in which an effect begins half-way, for the monitor: the plant changes at a row, and its levels go on.

use std::collections::BTreeMap;

use ct_signals::{Channel, Record, excitation, noise};
use greybox::{Setup, Stopping, fit_from};
use monitor::{Alarm, Model, Monitor, Row, Settings, Units};
use plants::{Command, EffectInfo, Known, Placed, Plant, Scales, Simulator, Structure};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StudentT;

use crate::{Drive, Rig, draw};

/// The effects that begin.
pub const EFFECTS: [&str; 5] = [
    "const_leak",
    "valve_step",
    "pump_gain_drift",
    "sensor_drift",
    "pump_deadzone",
];
/// Structural error over noise is met within this part.
const MET: f64 = 0.02;

/// Readings that are lost, the commands of their rows are not.
#[derive(Debug, Clone, Copy)]
pub struct Lost {
    /// Share of the readings.
    pub share: f64,
    /// In bursts that begin where the set point steps, or the command of an open loop; else at random.
    pub at_steps: bool,
}

/// A loop in which an effect begins.
#[derive(Debug, Clone)]
pub struct Onset {
    /// The loop before.
    pub rig: Rig,
    /// The effect that begins; `None`: no effect.
    pub effect: Option<(Placed, Vec<f64>)>,
    /// The row at which it begins.
    pub row: usize,
    /// Degrees of freedom of the noise, above two; `None`: it is Gaussian.
    pub tails: Option<f64>,
    /// Readings that the monitor does not get.
    pub lost: Option<Lost>,
}

impl Onset {
    /// A loop drawn at random in which nothing begins; `colour` is the noise's correlation from row to row.
    #[must_use]
    pub fn nothing(samples: usize, colour: f64, number: u64) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(7_000_000 + number);
        let plant = draw::PLANTS[number as usize % draw::PLANTS.len()];
        Self {
            rig: draw::rig(plant, Drive::Closed, colour, samples, rng),
            effect: None,
            row: samples,
            tails: None,
            lost: None,
        }
    }

    /// A loop drawn at random in which an effect begins half-way, with a structural error of `ratio` times the noise: the root
    /// mean square of what the believed model, refitted to the whole record without noise, cannot follow. `None` where the effect
    /// cannot have that size.
    #[must_use]
    pub fn drawn(number: u64, samples: usize, ratio: f64, colour: f64) -> Option<Self> {
        let id = EFFECTS[number as usize % EFFECTS.len()];
        let effect = EffectInfo::find(id)?;
        (0..12).find_map(|attempt| {
            let rng = &mut ChaCha8Rng::seed_from_u64(8_000_000 + 100 * number + attempt);
            let plants: Vec<Plant> = draw::PLANTS.to_vec();
            let plant = plants[rng.random_range(0..plants.len())];
            let vessels: Vec<usize> = effect.sites(plant, &Known::default()).collect();
            let vessel = vessels[rng.random_range(0..vessels.len())];
            let rig = draw::rig(plant, Drive::Closed, colour, samples, rng);
            let sign = if rng.random() { 1.0 } else { -1.0 };
            let share: f64 = rng.random_range(0.2..2.0);
            let placed = Placed { effect, vessel };
            Self::sized(rig, placed, sign, share, ratio)
        })
    }

    fn sized(rig: Rig, placed: Placed, sign: f64, share: f64, ratio: f64) -> Option<Self> {
        let row = rig.samples / 2;
        let at = |size: f64| Self {
            effect: Some((placed, values(&rig, placed, sign * size, share))),
            rig: rig.clone(),
            row,
            tails: None,
            lost: None,
        };
        let reached = |size: f64| Some(at(size).misfit()? / rig.noise);
        let (mut low, mut high) = (1e-6_f64, 1e-4_f64);
        while reached(high)? < ratio {
            if high > 0.5 {
                return None;
            }
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..30 {
            let middle = (low * high).sqrt();
            let found = reached(middle)?;
            if (found / ratio - 1.0).abs() < MET {
                return Some(at(middle));
            }
            if found < ratio {
                low = middle;
            } else {
                high = middle;
            }
        }
        None
    }

    /// Root mean square residual of the believed model, refitted to the record without noise.
    fn misfit(&self) -> Option<f64> {
        let records = [self.run(false, 1)?];
        let level = *self.rig.levels.last()?;
        let sound = |y: &f64| y.is_finite() && (0.1 * level..3.0 * level).contains(y);
        if !records[0].outputs[0].values.iter().all(sound) {
            return None;
        }
        let setup = Setup::from_records(
            self.rig.plant,
            self.rig.known(),
            &[],
            &records,
            BTreeMap::new(),
        )
        .ok()?;
        let truth = [self.rig.theta.as_slice(), &self.rig.levels].concat();
        let stopping = Stopping {
            evaluations: 60,
            cost: 1e-9,
        };
        Some(
            fit_from(&setup, &[truth], &setup.white_noise(), stopping)
                .ok()?
                .rmse[0],
        )
    }

    /// The slowest time constant \[s\].
    #[must_use]
    pub fn time_constant(&self) -> f64 {
        let rig = &self.rig;
        let middle = 0.5 * (rig.command.0 + rig.command.1);
        match rig.plant {
            Plant::SingleTankLinear => rig.theta[1],
            Plant::CascadedTanksLinear => rig.theta[1].max(rig.theta[2]),
            // Torricelli: 2 S H/Q.
            _ => rig
                .levels
                .iter()
                .map(|level| 2.0 * 154.0 * level / (rig.theta[0] * middle))
                .fold(0.0, f64::max),
        }
    }

    /// Runs it; `None` where the rig is not possible. The set point moves by random steps, or, where the loop is open, the command.
    #[must_use]
    pub fn run(&self, noisy: bool, seed: u64) -> Option<Record> {
        let rig = &self.rig;
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let middle = 0.5 * (rig.command.0 + rig.command.1);
        let level = *rig.levels.last()?;
        let wanted = excitation::steps(
            rig.samples,
            rig.hold.0..=rig.hold.1,
            0.8 * level,
            1.2 * level,
            rng,
        )
        .ok()?;
        let open = matches!(rig.drive, Drive::Open);
        let (low, high) = rig.command;
        let commands = open
            .then(|| excitation::steps(rig.samples, rig.hold.0..=rig.hold.1, low, high, rng))
            .transpose()
            .ok()?;
        let e = match (noisy, self.tails) {
            (false, _) => vec![0.0; rig.samples],
            (true, Some(degrees)) => heavy(rig, degrees, rng)?,
            (true, None) if rig.colour > 0.0 => noise::ar1(rig.samples, rig.noise, rig.colour, rng),
            (true, None) => noise::white(rig.samples, rig.noise, rng),
        };
        let mut controller = rig.controller().start(&[middle]);
        let structure = self.structure();
        let mut simulator = Simulator::new(&structure, &rig.theta, &rig.levels, middle).ok()?;
        let (mut u, mut y) = (Vec::new(), Vec::new());
        let mut before = middle;
        for k in 0..rig.samples {
            if k == self.row
                && let Some((placed, values)) = &self.effect
            {
                // With only one effect, its parameters are the last ones.
                let theta = [rig.theta.as_slice(), values].concat();
                let levels = simulator.levels()[..rig.plant.vessels()].to_vec();
                let with = structure.with(*placed).ok()?;
                simulator = Simulator::new(&with, &theta, &levels, before).ok()?;
            }
            let reading = simulator.read(0) + e[k];
            let command = match &commands {
                Some(commands) => commands[k],
                None => controller.command(wanted[k], reading, rig.interval),
            };
            simulator.advance(Command::held(command), rig.interval);
            before = command;
            y.push(reading);
            u.push(command);
        }
        Some(Record {
            name: "loop".to_string(),
            time: (0..rig.samples).map(|k| k as f64 * rig.interval).collect(),
            inputs: vec![Channel::new("u", "V", u)],
            outputs: vec![Channel::new("y", "cm", y)],
            references: commands
                .is_none()
                .then(|| Channel::new("r", "cm", wanted))
                .into_iter()
                .collect(),
            ..Record::default()
        })
    }

    /// All alarms of a monitor on this loop with noise; the monitor's model lacks the effect.
    #[must_use]
    pub fn watched(&self, settings: Settings, seed: u64) -> Option<Vec<Alarm>> {
        let record = self.run(true, seed)?;
        let model = Model {
            hold: record.hold(),
            ..Model::new(self.rig.plant, self.rig.known())
        };
        let units = Units {
            output: record.outputs[0].unit.clone(),
            input: record.inputs[0].unit.clone(),
        };
        let mut monitor = Monitor::new(model, settings, units).ok()?;
        let mut alarms = Vec::new();
        for (k, lost) in self.lost_rows(&record, seed).into_iter().enumerate() {
            let reading = if lost {
                f64::NAN
            } else {
                record.outputs[0].values[k]
            };
            let row = Row::new(record.time[k], record.inputs[0].values[k], &[reading]);
            alarms.extend(monitor.update(&row).ok()?.alarm);
        }
        Some(alarms)
    }

    /// Rows of its record with missing readings.
    fn lost_rows(&self, record: &Record, seed: u64) -> Vec<bool> {
        let mut rows = vec![false; record.len()];
        let Some(lost) = self.lost else { return rows };
        let rng = &mut ChaCha8Rng::seed_from_u64(9_000_000 + seed);
        if !lost.at_steps {
            rows.fill_with(|| rng.random_bool(lost.share));
            return rows;
        }
        let steps = record.references.first().unwrap_or(&record.inputs[0]);
        let between = 0.5 * (self.rig.hold.0 + self.rig.hold.1) as f64;
        let burst = ((lost.share * between).round() as usize).max(1);
        for k in 1..rows.len() {
            if steps.values[k] != steps.values[k - 1] {
                let end = (k + burst).min(rows.len());
                rows[k..end].fill(true);
            }
        }
        rows
    }

    /// The first row at which what began shows in the reading by as much as the noise: without noise, the reading beside that of the plant
    /// without it, on the same command.
    #[must_use]
    pub fn visible_from(&self) -> Option<usize> {
        let record = self.run(false, 1)?;
        let rig = &self.rig;
        let middle = 0.5 * (rig.command.0 + rig.command.1);
        let mut plain = Simulator::new(&self.structure(), &rig.theta, &rig.levels, middle).ok()?;
        for k in 0..rig.samples {
            if (record.outputs[0].values[k] - plain.read(0)).abs() >= rig.noise {
                return Some(k);
            }
            plain.advance(Command::held(record.inputs[0].values[k]), rig.interval);
        }
        None
    }

    fn structure(&self) -> Structure {
        let rig = &self.rig;
        // A drift's clock runs from the onset to the end.
        let duration = rig.interval * (rig.samples - self.row).max(1) as f64;
        let mut scales = Scales::from_ranges((0.0, 10.0), (5.0, 30.0), rig.interval, duration);
        scales.input_range = 10.0;
        Structure::new(rig.plant, rig.known(), scales)
    }
}

/// Noise of the rig's size and colour whose innovations have Student's distribution.
fn heavy(rig: &Rig, degrees: f64, rng: &mut ChaCha8Rng) -> Option<Vec<f64>> {
    let student = StudentT::new(degrees).ok()?;
    let unit = ((degrees - 2.0) / degrees).sqrt();
    let sigma = rig.noise * unit * (1.0 - rig.colour * rig.colour).sqrt();
    let mut v = 0.0;
    let follow = |_| {
        v = rig.colour * v + sigma * rng.sample(student);
        v
    };
    Some((0..rig.samples).map(follow).collect())
}

/// The parameters of an effect whose size is a share of what the plant has.
fn values(rig: &Rig, placed: Placed, size: f64, share: f64) -> Vec<f64> {
    let middle = 0.5 * (rig.command.0 + rig.command.1);
    // The flow of linear vessels is in units of the level.
    let flow = rig.theta[0] * middle;
    let level = rig.levels.last().copied().unwrap_or(1.0);
    let duration = rig.interval * (rig.samples / 2) as f64;
    match placed.effect.id {
        "const_leak" => vec![size.abs() * flow],
        "valve_step" => vec![size, 0.0],
        "pump_gain_drift" => vec![size, share * duration],
        "sensor_drift" => vec![size * level],
        _ => vec![size.abs() * middle],
    }
}
