//! Steps a structure from sample to sample.

use crate::{
    Error, Outlet, Place, Scalar, Structure,
    actuator::Actuator,
    effects,
    sensor::Sensor,
    structure::MAX_VESSELS,
    term,
    vessels::{Stretch, Vessels},
};

/// The command over one sampling interval \[input unit\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// At its beginning.
    pub from: f64,
    /// At its end, where it runs in a straight line; `None`: it is held.
    pub to: Option<f64>,
}

impl Command {
    /// A command that is held.
    #[must_use]
    pub fn held(u: f64) -> Self {
        Self { from: u, to: None }
    }
    /// A command that runs in a straight line.
    #[must_use]
    pub fn ramp(from: f64, to: f64) -> Self {
        Self { from, to: Some(to) }
    }
}

/// A simulation in progress. Read first, then advance: `y[k]` is read before `u[k]` acts.
///
/// Linear plants without effects in their vessels are propagated exactly (matrix exponential); others by
/// Runge-Kutta of order four in [`Simulator::set_substeps`] equal parts of the sampling interval, cut where the
/// input jumps behind a dead time, where a level meets its rim and where a law jumps. Parts that are longer than a vessel's
/// time constant are exponential Runge-Kutta steps (see the [front page](crate#steps-that-are-longer-than-a-time-constant)). Nothing is allocated per step,
/// but for the first step of a new length of a linear plant, and the queue behind a dead time while it fills.
pub struct Simulator<T: Scalar> {
    actuator: Actuator<T>,
    vessels: Vessels<T>,
    sensor: Sensor<T>,
    pump_gain: T,
    last: usize,
    time: f64,
    substeps: usize,
}

impl<T: Scalar> Simulator<T> {
    /// `theta` in the order of [`Structure::parameters`], `initial` the level of each vessel when the record begins
    /// and, where the lags had not settled by then, an excess for each of [`Structure::lags`]; `at_rest` the command
    /// before the record began.
    ///
    /// # Errors
    /// Where the number of parameters or initial values is not the structure's.
    pub fn new(
        structure: &Structure,
        theta: &[T],
        initial: &[T],
        at_rest: f64,
    ) -> Result<Self, Error> {
        let plant = structure.plant;
        let n = plant.vessels();
        let (levels, before) = initial.split_at(n.min(initial.len()));
        let lags = structure.lags();
        if levels.len() != n || !(before.is_empty() || before.len() == lags.len()) {
            return Err(Error::Count {
                what: "initial levels, and an excess for each lag",
                given: initial.len(),
                needed: n + lags.len(),
            });
        }
        let own = plant.parameters(&structure.scales).len();
        let counts: Vec<usize> = structure
            .effects()
            .iter()
            .map(|&placed| structure.effect_parameters(placed).len())
            .collect();
        let term_counts: Vec<usize> = structure
            .terms()
            .iter()
            .map(|term| term.parameters(&structure.scales).len())
            .collect();
        let needed = own + counts.iter().chain(&term_counts).sum::<usize>();
        if theta.len() != needed {
            return Err(Error::Count {
                what: "parameters",
                given: theta.len(),
                needed,
            });
        }
        let area = |i: usize| T::constant(structure.scales.area[i]);
        let zero = T::constant(0.0);
        let (pump_gain, parts) = match plant {
            crate::Plant::SingleTank => (theta[0], vec![(area(0), Outlet::Torricelli, theta[1])]),
            crate::Plant::CascadedTanks => (
                theta[0],
                vec![
                    (area(0), Outlet::Torricelli, theta[1]),
                    (area(1), Outlet::Torricelli, theta[2]),
                ],
            ),
            crate::Plant::SingleTankLinear => {
                (theta[0], vec![(theta[1], Outlet::Linear, theta[2])])
            }
            crate::Plant::CascadedTanksLinear => (
                theta[0],
                vec![
                    (theta[1], Outlet::Linear, zero),
                    (theta[2], Outlet::Linear, theta[3]),
                ],
            ),
            crate::Plant::FirstOrder => (theta[0], vec![(theta[1], Outlet::Linear, zero)]),
        };
        let (mut actuator, mut vessels, mut sensor) = (Vec::new(), Vec::new(), Vec::new());
        let mut at = own;
        for (&placed, count) in structure.effects().iter().zip(counts) {
            let site = structure.site(placed);
            if let Some(law) = effects::bind(placed.effect, &site, &theta[at..at + count]) {
                match placed.effect.place {
                    Place::Actuator => actuator.push(law),
                    Place::Vessel => vessels.push((placed.vessel, law)),
                    Place::Sensor => sensor.push(law),
                }
            }
            at += count;
        }
        for (term, count) in structure.terms().iter().zip(term_counts) {
            let law = term::bind(term, &theta[at..at + count]);
            match term.place {
                Place::Actuator => actuator.push(law),
                Place::Vessel => vessels.push((term.vessel, law)),
                Place::Sensor => sensor.push(law),
            }
            at += count;
        }
        let mut actuator = Actuator::new(actuator, at_rest, 0.0);
        let mut sensor = Sensor::new(sensor);
        let sample = structure.scales.sample_interval;
        for (lag, &before) in lags.iter().zip(before) {
            match lag.effect.place {
                Place::Actuator => actuator.unsettle(before, sample),
                _ => sensor.unsettle(before, sample),
            }
        }
        Ok(Self {
            actuator,
            vessels: Vessels::new(parts, vessels, levels),
            sensor,
            pump_gain,
            last: n - 1,
            time: 0.0,
            substeps: 1,
        })
    }

    /// Cuts every sampling interval into `n` equal parts (at least one).
    pub fn set_substeps(&mut self, n: usize) {
        self.substeps = n.max(1);
    }

    /// The sensor's reading now. Sensors may have memory, so it is called once for each sample, in order.
    pub fn read(&mut self) -> T {
        self.sensor.read(self.vessels.levels[self.last], self.time)
    }

    /// The level of each vessel now; only the first [`crate::Plant::vessels`] entries are used.
    pub fn levels(&self) -> [T; MAX_VESSELS] {
        self.vessels.levels
    }

    /// Time since the record began \[s\].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Moves on by one sampling interval of length `h` \[s\].
    pub fn advance(&mut self, command: Command, h: f64) {
        self.step(T::constant(command.from), command.to, h);
    }

    /// The same under a held command that has derivatives, as a controller gives it.
    pub fn advance_held(&mut self, command: T, h: f64) {
        self.step(command, None, h);
    }

    fn step(&mut self, from: T, to: Option<f64>, h: f64) {
        let Self {
            actuator,
            vessels,
            sensor,
            pump_gain,
            time,
            substeps,
            ..
        } = self;
        let gain = *pump_gain;
        let mut now = T::constant(*time);
        actuator.pieces(from, to, *time, h, |actuator, length, signal| {
            // A short piece needs no more parts than its share of the interval.
            let parts = *substeps as f64 * length.value() / h;
            let parts = ((parts - 1e-9).ceil() as usize).max(1);
            let part = if parts == 1 {
                length
            } else {
                length * (1.0 / parts as f64)
            };
            for i in 0..parts {
                let signal = signal.from(part * i as f64);
                let inflow = actuator.inflow(part, signal, gain, now);
                if sensor.has_lag() {
                    let mut follow = |stretch: &Stretch<T>| sensor.follow(stretch);
                    vessels.step(part, &inflow, now, &mut Some(&mut follow));
                } else {
                    vessels.step(part, &inflow, now, &mut None);
                }
                now = now + part;
            }
        });
        *time += h;
    }
}
