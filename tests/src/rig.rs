//! Rigs: a plant with or without a hidden effect, in open or closed loop, under white or coloured noise.

use ct_signals::{Channel, Error, Record, excitation, noise};
use missing_effect::Problem;
use plants::controller::{Controller, Regulator};
use plants::{Command, EffectInfo, Known, Placed, Plant, Scales, Simulator, Structure, Term};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Samples in which a rig comes to rest.
const SETTLING: usize = 1500;

/// Generation of the command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Random steps of the command.
    Open,
    /// Random steps of the set point, a PI controller that reads the noisy sensor.
    Closed,
}

/// A rig.
#[derive(Debug, Clone)]
pub struct Rig {
    /// The plant.
    pub plant: Plant,
    /// Hidden effects with their parameters, in any order.
    pub hidden: Vec<(&'static str, usize, Vec<f64>)>,
    /// Hidden terms that no effect of the catalogue describes.
    pub terms: Vec<Term>,
    /// The plant's own parameters.
    pub theta: Vec<f64>,
    /// Level at rest of each vessel under the middle command \[cm\].
    pub levels: Vec<f64>,
    /// The vessels whose levels are measured, each with noise of its own; none: the last one alone.
    pub measured: Vec<usize>,
    /// Range of the command \[V\].
    pub command: (f64, f64),
    /// Standard deviation of the noise \[cm\].
    pub noise: f64,
    /// Correlation of the noise from sample to sample; zero is white.
    pub colour: f64,
    /// Standard deviation of a random walk beside the noise at the end of the record \[cm\]; zero: there is none.
    pub walk: f64,
    /// The step of the converter after the sensor, which rounds the reading with its noise \[cm\]; zero: it does not round.
    pub converter: f64,
    /// How the command comes about.
    pub drive: Drive,
    /// Fewest and most samples for which a step lasts.
    pub hold: (usize, usize),
    /// Gain \[V/cm\] and integral time \[s\] of the controller of [`Drive::Closed`].
    pub pi: (f64, f64),
    /// Samples.
    pub samples: usize,
    /// Sampling interval \[s\].
    pub interval: f64,
    /// Samples are taken up to this part of the interval before or after their time, and stamped when they are taken.
    pub jitter: f64,
    /// Unmodelled disturbances: at a time \[s\], the addition to the command \[V\], and the addition to the reading \[cm\].
    pub outside: fn(f64) -> (f64, f64),
}

impl Rig {
    /// A single tank of 154 cm^2 whose level stands near 16 cm.
    #[must_use]
    pub fn single_tank() -> Self {
        Self {
            plant: Plant::SingleTank,
            hidden: Vec::new(),
            terms: Vec::new(),
            theta: vec![10.0, 12.5],
            levels: vec![16.0],
            measured: Vec::new(),
            command: (3.5, 6.5),
            noise: 0.05,
            colour: 0.0,
            walk: 0.0,
            converter: 0.0,
            drive: Drive::Open,
            hold: (20, 90),
            pi: (0.4, 120.0),
            samples: 1000,
            interval: 2.0,
            jitter: 0.0,
            outside: |_| (0.0, 0.0),
        }
    }

    /// Two tanks of 154 cm^2 in series, the lower level near 16 cm, the upper one near 20 cm.
    #[must_use]
    pub fn cascaded_tanks() -> Self {
        Self {
            plant: Plant::CascadedTanks,
            theta: vec![10.0, 11.2, 12.5],
            levels: vec![20.0, 16.0],
            ..Self::single_tank()
        }
    }

    /// A first-order lag with offset.
    #[must_use]
    pub fn linear_tank() -> Self {
        Self {
            plant: Plant::SingleTankLinear,
            theta: vec![6.4, 100.0, -16.0],
            levels: vec![16.0],
            ..Self::single_tank()
        }
    }

    /// Known constants.
    #[must_use]
    pub fn known(&self) -> Known {
        let area = match self.plant {
            Plant::SingleTank => [Some(154.0), None, None],
            Plant::CascadedTanks => [Some(154.0), Some(154.0), None],
            _ => [None; 3],
        };
        Known {
            area,
            measured: self.measured.clone(),
            tank_height: Some(60.0),
            input_range: Some(10.0),
            ..Known::default()
        }
    }

    /// Number of measured levels.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.measured.len().max(1)
    }

    /// The controller of [`Drive::Closed`]; of several levels it reads the last.
    ///
    /// # Panics
    /// Where its settings cannot work: they are constants of a test, or drawn from what can.
    #[must_use]
    #[allow(clippy::expect_used)]
    pub fn controller(&self) -> Controller {
        let (gain, integral_time) = self.pi;
        let controller = Controller::pi(gain, integral_time, (0.0, 10.0));
        let controller = controller.expect("a controller");
        controller.at_output(self.outputs() - 1)
    }

    /// The plant without what is hidden, beside one record; the controller is not told.
    ///
    /// # Panics
    /// Where the record has other outputs than the plant.
    #[allow(clippy::expect_used)]
    pub fn problem(&self, record: Record) -> Problem {
        let problem = Problem::builder(self.plant, self.known(), [record]).build();
        problem.expect("a record of the plant")
    }

    /// Runs it.
    ///
    /// # Panics
    /// Where the rig is not possible: its settings are constants of a test.
    #[allow(clippy::expect_used)]
    pub fn run(&self, rng: &mut ChaCha8Rng) -> Record {
        let middle = 0.5 * (self.command.0 + self.command.1);
        let e = self.noises(self.samples, rng);
        let (low, high) = match self.drive {
            Drive::Open => self.command,
            Drive::Closed => (
                0.7 * self.levels[self.levels.len() - 1],
                1.3 * self.levels[self.levels.len() - 1],
            ),
        };
        let wanted: Result<Vec<f64>, Error> =
            excitation::steps(self.samples, self.hold.0..=self.hold.1, low, high, rng);
        let wanted = wanted.expect("an excitation");
        let controller = self.controller().start(&[middle]);
        let time = self.stamps(self.samples, rng);
        let e = self.with_others(e, rng);
        self.from(&self.levels, middle, controller, wanted, (&time, &e))
    }

    /// Runs it on a given command, or in the loop on a given set point, from rest at its first value.
    ///
    /// # Panics
    /// Where the rig is not possible, or nothing is given.
    #[allow(clippy::expect_used)]
    pub fn play(&self, wanted: Vec<f64>, rng: &mut ChaCha8Rng) -> Record {
        let first = *wanted.first().expect("a value");
        // Functions of time begin with the record.
        let settling = Self {
            hidden: self
                .hidden
                .iter()
                .filter(|(id, ..)| EffectInfo::find(id).is_some_and(|effect| !effect.by_clock))
                .cloned()
                .collect(),
            ..self.clone()
        };
        let (structure, theta) = settling.built();
        let middle = 0.5 * (self.command.0 + self.command.1);
        let mut simulator =
            Simulator::new(&structure, &theta, &self.levels, middle).expect("a simulation");
        let mut controller = self.controller().start(&[middle]);
        let mut command = first;
        for _ in 0..SETTLING {
            if self.drive == Drive::Closed {
                let reading = simulator.read(self.outputs() - 1);
                command = controller.command(first, reading, self.interval);
            }
            simulator.advance(Command::held(command), self.interval);
        }
        let levels = simulator.levels()[..self.plant.vessels()].to_vec();
        let e = self.noises(wanted.len(), rng);
        let time = self.stamps(wanted.len(), rng);
        let e = self.with_others(e, rng);
        self.from(&levels, command, controller, wanted, (&time, &e))
    }

    /// All hidden effects of the catalogue, including the converter's rounding.
    #[must_use]
    pub fn missing(&self) -> Vec<(&'static str, usize, Vec<f64>)> {
        let mut all = self.hidden.clone();
        if self.converter > 0.0 {
            let last = self.outputs() - 1;
            all.push((
                "coarse_quantisation",
                last,
                vec![self.converter, self.noise],
            ));
        }
        all
    }

    fn noises(&self, n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let mut e = if self.colour > 0.0 {
            noise::ar1(n, self.noise, self.colour, rng)
        } else {
            noise::white(n, self.noise, rng)
        };
        if self.walk > 0.0 {
            let mut walk = 0.0;
            let steps = noise::white(n, self.walk / (n as f64).sqrt(), rng);
            for (e, step) in e.iter_mut().zip(steps) {
                walk += step;
                *e += walk;
            }
        }
        e
    }

    /// The noise of the last output, and noise of the other ones: the last is the same whether others are measured too or not.
    fn with_others(&self, last: Vec<f64>, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let n = last.len();
        let mut all: Vec<Vec<f64>> = (1..self.outputs()).map(|_| self.noises(n, rng)).collect();
        all.push(last);
        all
    }

    /// Times of the samples \[s\].
    fn stamps(&self, n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let jitter = self.jitter;
        let mut stamp = |k: usize| {
            let off = if jitter > 0.0 && k > 0 {
                rng.random_range(-jitter..=jitter)
            } else {
                0.0
            };
            (k as f64 + off) * self.interval
        };
        (0..n).map(&mut stamp).collect()
    }

    /// The plant with what is hidden in it, and its parameters.
    #[allow(clippy::expect_used)]
    fn built(&self) -> (Structure, Vec<f64>) {
        let mut scales = Scales::from_ranges(
            (0.0, 10.0),
            (5.0, 30.0),
            self.interval,
            self.interval * self.samples as f64,
        );
        for (operating, level) in scales.operating_level.iter_mut().zip(&self.levels) {
            *operating = *level;
        }
        scales.input_range = 10.0;
        // With another measured level, the scale of a reading is not arbitrary: a nonlinearity refers to the visited range.
        if self.outputs() > 1 {
            let middle = 0.5 * (self.command.0 + self.command.1);
            let power = match self.plant.outlet() {
                plants::Outlet::Torricelli => 2,
                plants::Outlet::Linear => 1,
            };
            for (range, level) in scales.level.iter_mut().zip(&self.levels) {
                let at = |command: f64| level * (command / middle).powi(power);
                *range = (at(self.command.0), at(self.command.1));
            }
        }
        let mut structure = Structure::new(self.plant, self.known(), scales);
        let mut theta = self.theta.clone();
        for (id, vessel, _) in &self.hidden {
            let effect = EffectInfo::find(id).expect("an effect of the catalogue");
            structure = structure
                .with(Placed {
                    effect,
                    vessel: *vessel,
                })
                .expect("an effect of this plant");
        }
        // A structure has its effects in the order of the chain, in whatever order they were hidden.
        for placed in structure.effects() {
            let own = self
                .hidden
                .iter()
                .find(|(id, vessel, _)| *id == placed.effect.id && *vessel == placed.vessel);
            let (.., parameters) = own.expect("what was hidden");
            theta.extend(parameters);
        }
        for term in &self.terms {
            structure = structure
                .with_term(term.clone())
                .expect("a term of this plant");
            theta.push(1.0);
        }
        (structure, theta)
    }

    #[allow(clippy::expect_used)]
    fn from(
        &self,
        levels: &[f64],
        before: f64,
        mut controller: Regulator<f64>,
        wanted: Vec<f64>,
        (time, e): (&[f64], &[Vec<f64>]),
    ) -> Record {
        let (structure, theta) = self.built();
        let mut simulator =
            Simulator::new(&structure, &theta, levels, before).expect("a simulation");
        let mut u = Vec::with_capacity(wanted.len());
        let last = self.outputs() - 1;
        let mut outputs = vec![Vec::with_capacity(wanted.len()); last + 1];
        for k in 0..wanted.len() {
            let (unseen, misread) = (self.outside)(time[k]);
            for (o, output) in outputs.iter_mut().enumerate().take(last) {
                output.push(simulator.read(o) + e[o][k]);
            }
            let mut reading = simulator.read(last) + misread + e[last][k];
            if self.converter > 0.0 {
                reading = self.converter * (reading / self.converter).round();
            }
            // Stamps that do not jitter are whole multiples of the interval, their differences only nearly.
            let interval = match time.get(k + 1) {
                Some(next) if self.jitter > 0.0 => next - time[k],
                _ => self.interval,
            };
            let command = match self.drive {
                Drive::Open => wanted[k],
                Drive::Closed => controller.command(wanted[k], reading, self.interval),
            };
            simulator.advance(Command::held(command + unseen), interval);
            outputs[last].push(reading);
            u.push(command);
        }
        let named = |o: usize| match o {
            o if o == last => "y".to_string(),
            o => format!("y{o}"),
        };
        let outputs = outputs.into_iter().enumerate();
        let outputs = outputs.map(|(o, values)| Channel::new(named(o), "cm", values));
        Record {
            name: "rig".to_string(),
            time: time.to_vec(),
            inputs: vec![Channel::new("u", "V", u)],
            outputs: outputs.collect(),
            references: (self.drive == Drive::Closed)
                .then(|| Channel::new("r", "cm", wanted))
                .into_iter()
                .collect(),
            ..Record::default()
        }
    }
}

#[cfg(test)]
mod tests;
