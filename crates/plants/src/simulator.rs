//! Steps a structure from sample to sample.

use crate::{
    Error, Outlet, Place, Scalar, Structure,
    actuator::{Actuator, Signal},
    effects,
    inflow::{Feed, Inflow},
    sensor::Sensor,
    structure::{MAX_VESSELS, SERIES},
    term,
    vessels::{Stretch, Valves, Vessels},
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
/// Linear plants without effects in their vessels are propagated exactly, in closed form; others by
/// Runge-Kutta of order four in [`Simulator::set_substeps`] equal parts of the sampling interval, cut where the
/// input jumps behind a dead time, where a level meets its rim and where a law jumps. Parts that are longer than a vessel's
/// time constant are exponential Runge-Kutta steps (see the [front page](crate#steps-that-are-longer-than-a-time-constant)). Nothing is allocated per step,
/// but for the queue behind a dead time while it fills.
pub struct Simulator<T: Scalar> {
    actuator: Actuator<T>,
    layout: Layout<T>,
    /// Of each output, with the vessel whose level it reads.
    sensors: Vec<(usize, Sensor<T>)>,
    /// The output whose sensor lags.
    lagging: Option<usize>,
    pump_gain: T,
    disturbance: Option<Disturbance<T>>,
    time: f64,
    substeps: usize,
}

/// How the vessels stand to each other.
#[allow(
    clippy::large_enum_variant,
    reason = "vessels in series, which most simulations have, stay where the simulator is"
)]
enum Layout<T: Scalar> {
    Series(Vessels<T, SERIES>),
    Joined(Box<Joined<T>>),
}

struct Joined<T: Scalar> {
    vessels: Vessels<T, MAX_VESSELS>,
    second: Option<SecondPump<T>>,
}

/// A measured disturbance that flows into a vessel.
struct Disturbance<T> {
    /// Inflow for one unit.
    gain: T,
    /// It is the lower one of two: what flows into the upper one, or an only one, flows in with what the pump brings.
    into_lower: bool,
}

impl<T: Scalar> Disturbance<T> {
    /// What it brings over an interval of length `h`.
    fn over(&self, Command { from, to }: Command, time: f64, h: f64) -> Feed<T> {
        let rise = to.map_or(0.0, |to| to - from);
        let coefficients = [self.gain * from, self.gain * rise, T::constant(0.0)];
        Feed::new(T::constant(time), T::constant(h), coefficients)
    }
}

struct SecondPump<T: Scalar> {
    actuator: Actuator<T>,
    gain: T,
    /// Lengths and commands of its pieces in the present interval: scratch space.
    pieces: Vec<(T, Signal<T>)>,
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
        Self::with_inputs(structure, theta, initial, [at_rest, 0.0])
    }

    /// The same for a plant with two pumps: what either was told before the record began. A measured disturbance
    /// ([`crate::Known::disturbance`]) has no memory, and its value before is not used.
    ///
    /// # Errors
    /// As [`Simulator::new`].
    pub fn with_inputs(
        structure: &Structure,
        theta: &[T],
        initial: &[T],
        at_rest: [f64; 2],
    ) -> Result<Self, Error> {
        Self::starting_at(0.0, structure, theta, initial, at_rest)
    }

    /// The same for a record that begins at `start` \[s\] on the clock that drifts, steps and periods follow: a later part of an
    /// experiment.
    ///
    /// # Errors
    /// As [`Simulator::new`].
    pub fn starting_at(
        start: f64,
        structure: &Structure,
        theta: &[T],
        initial: &[T],
        at_rest: [f64; 2],
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
            crate::Plant::ThreeTank => {
                let valves = &theta[own - n..own];
                let orifice = structure.scales.orifice.unwrap_or(1.0);
                let part = |i: usize| (area(i), Outlet::Torricelli, valves[i] * orifice);
                (theta[0], (0..n).map(part).collect())
            }
        };
        let second_gain = structure.scales.input_2.map(|_| theta[1]);
        let second_gain = second_gain.filter(|_| plant.joined());
        let known = &structure.known;
        let disturbed = known
            .disturbed_vessel(plant)
            .filter(|_| structure.scales.input_2.is_some());
        let disturbance = disturbed.map(|vessel| Disturbance {
            gain: theta[own - 1],
            into_lower: vessel > 0,
        });
        let mut actuators = [Vec::new(), Vec::new()];
        let outputs = &structure.scales.outputs;
        let mut vessels = Vec::new();
        let mut sensors: Vec<Vec<_>> = outputs.iter().map(|_| Vec::new()).collect();
        // The laws of joined vessels once more without derivatives.
        let plain: Vec<f64> = theta.iter().map(|value| value.value()).collect();
        let mut values = Vec::new();
        let mut at = own;
        for (&placed, count) in structure.effects().iter().zip(counts) {
            let site = structure.site(placed);
            if plant.joined()
                && placed.effect.place == Place::Vessel
                && let Some(law) = effects::bind(placed.effect, &site, &plain[at..at + count])
            {
                values.push((placed.vessel, law));
            }
            if let Some(law) = effects::bind(placed.effect, &site, &theta[at..at + count]) {
                match placed.effect.place {
                    Place::Actuator => actuators[placed.vessel.min(1)].push(law),
                    Place::Vessel => vessels.push((placed.vessel, law)),
                    Place::Sensor => sensors[placed.vessel].push(law),
                }
            }
            at += count;
        }
        for (term, count) in structure.terms().iter().zip(term_counts) {
            if plant.joined() && term.place == Place::Vessel {
                values.push((term.vessel, term::bind(term, &plain[at..at + count])));
            }
            let law = term::bind(term, &theta[at..at + count]);
            match term.place {
                Place::Actuator => actuators[term.vessel.min(1)].push(law),
                Place::Vessel => vessels.push((term.vessel, law)),
                Place::Sensor => sensors[term.vessel].push(law),
            }
            at += count;
        }
        let [first, second] = actuators;
        let mut actuator = Actuator::new(first, at_rest[0], start);
        let mut second = second_gain.map(|gain| SecondPump {
            actuator: Actuator::new(second, at_rest[1], start),
            gain,
            pieces: Vec::new(),
        });
        let read = outputs.iter().map(|output| output.vessel.min(n - 1));
        let mut sensors: Vec<(usize, Sensor<T>)> =
            read.zip(sensors.into_iter().map(Sensor::new)).collect();
        // An effect is on once, so no more than one lags.
        let lagging = sensors.iter().position(|(_, sensor)| sensor.has_lag());
        let sample = structure.scales.sample_interval;
        for (lag, &before) in lags.iter().zip(before) {
            match lag.effect.place {
                Place::Actuator => match &mut second {
                    Some(second) if lag.vessel > 0 => second.actuator.unsettle(before, sample),
                    _ => actuator.unsettle(before, sample),
                },
                _ => sensors[lag.vessel].1.unsettle(before, sample),
            }
        }
        let watched = sensors[lagging.unwrap_or(0)].0;
        let layout = if plant.joined() {
            let levels_read = sensors.iter().map(|(vessel, _)| {
                let (low, high) = structure.scales.level[*vessel];
                low.abs().max(high.abs())
            });
            let valves = Valves::new(levels_read.fold(0.0, f64::max));
            let plain_parts = parts
                .iter()
                .map(|&(area, outlet, coefficient)| (area.value(), outlet, coefficient.value()));
            let plain_levels: Vec<f64> = levels.iter().map(|level| level.value()).collect();
            let seen = (watched, Some(valves));
            let values = Vessels::new(plain_parts.collect(), values, &plain_levels, seen);
            let mut vessels = Vessels::new(parts, vessels, levels, seen);
            vessels.cut_by(values);
            Layout::Joined(Box::new(Joined { vessels, second }))
        } else {
            let mut vessels = Vessels::new(parts, vessels, levels, (watched, None));
            if disturbance.as_ref().is_some_and(|d| d.into_lower) {
                vessels.feed_last();
            }
            Layout::Series(vessels)
        };
        Ok(Self {
            actuator,
            layout,
            sensors,
            lagging,
            pump_gain,
            disturbance,
            time: start,
            substeps: 1,
        })
    }

    /// Cuts every sampling interval into `n` equal parts (at least one).
    pub fn set_substeps(&mut self, n: usize) {
        self.substeps = n.max(1);
    }

    /// How many outputs there are.
    pub fn outputs(&self) -> usize {
        self.sensors.len()
    }

    /// The reading of an output now. Sensors may have memory, so it is called once for each output and sample, in order of time.
    pub fn read(&mut self, output: usize) -> T {
        let (vessel, sensor) = &mut self.sensors[output];
        let level = match &self.layout {
            Layout::Series(vessels) => vessels.levels[*vessel],
            Layout::Joined(joined) => joined.vessels.levels[*vessel],
        };
        sensor.read(level, self.time)
    }

    /// The level of each vessel now; only the first [`crate::Plant::vessels`] entries are used.
    pub fn levels(&self) -> [T; MAX_VESSELS] {
        match &self.layout {
            Layout::Series(vessels) => {
                let mut levels = [T::constant(0.0); MAX_VESSELS];
                levels[..SERIES].copy_from_slice(&vessels.levels);
                levels
            }
            Layout::Joined(joined) => joined.vessels.levels,
        }
    }

    /// Where what the command to the first pump moves stands now: at the latest command, but for play and stiction. A simulation that has it
    /// for `at_rest` goes on from there.
    pub fn stands(&self) -> f64 {
        self.actuator.stands()
    }

    /// Time since the clock of drifts, steps and periods began \[s\]: since the record began, unless that is a later part.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Moves on by one sampling interval of length `h` \[s\]; a second pump, or a measured disturbance, stands at zero.
    pub fn advance(&mut self, command: Command, h: f64) {
        self.advance_both([command, Command::held(0.0)], h);
    }

    /// The same under a command to either pump, or under one and a measured disturbance, each held or a ramp; the second one is not looked
    /// at where there is neither.
    pub fn advance_both(&mut self, [command, second]: [Command; 2], h: f64) {
        self.step(T::constant(command.from), command.to, second, h);
    }

    /// The same under a held command to the first pump that has derivatives, as a controller gives it.
    pub fn advance_held(&mut self, command: T, second: Command, h: f64) {
        self.step(command, None, second, h);
    }

    fn step(&mut self, from: T, to: Option<f64>, second: Command, h: f64) {
        let Self {
            actuator,
            layout,
            sensors,
            lagging,
            pump_gain,
            disturbance,
            time,
            substeps,
        } = self;
        let gain = *pump_gain;
        let mut lagging = lagging.map(|output| &mut sensors[output].1);
        let mut now = T::constant(*time);
        match layout {
            Layout::Series(vessels) => {
                let mut with_pump = None;
                if let Some(disturbance) = disturbance {
                    let feed = disturbance.over(second, *time, h);
                    if disturbance.into_lower {
                        vessels.disturb(feed);
                    } else {
                        with_pump = Some(feed);
                    }
                }
                actuator.pieces(from, to, *time, h, |actuator, length, signal| {
                    let (parts, part) = cut(length, h, *substeps);
                    for i in 0..parts {
                        let signal = signal.from(part * i as f64);
                        let mut inflow = actuator.inflow(part, signal, gain, now);
                        if let Some(feed) = &with_pump {
                            inflow = inflow.and(feed.over(now, part));
                        }
                        if let Some(sensor) = &mut lagging {
                            let mut follow = |stretch: &Stretch<T>| sensor.follow(stretch);
                            vessels.step(part, &inflow, now, &mut Some(&mut follow));
                        } else {
                            vessels.step(part, &inflow, now, &mut None);
                        }
                        now = now + part;
                    }
                });
            }
            Layout::Joined(joined) => {
                let Joined {
                    vessels,
                    second: pump,
                } = &mut **joined;
                if let Some(pump) = pump {
                    let from = T::constant(second.from);
                    pump.pieces.clear();
                    let pieces = &mut pump.pieces;
                    pump.actuator
                        .pieces(from, second.to, *time, h, |_, length, signal| {
                            pieces.push((length, signal));
                        });
                }
                // The pieces of the one are cut where those of the other end.
                let mut next = 0;
                let mut passed = T::constant(0.0);
                actuator.pieces(from, to, *time, h, |actuator, length, signal| {
                    let mut done = T::constant(0.0);
                    loop {
                        let left = length - done;
                        let other = pump.as_ref().and_then(|pump| pump.pieces.get(next));
                        let other = other.map(|&(whole, signal)| (whole - passed, signal));
                        // The last piece of the other ends with the interval, whatever rounding says.
                        let last = pump.as_ref().is_none_or(|p| next + 1 >= p.pieces.len());
                        let ends = other.filter(|(rest, _)| !last && rest.value() < left.value());
                        let stretch = ends.map_or(left, |(rest, _)| rest);
                        let (parts, part) = cut(stretch, h, *substeps);
                        for i in 0..parts {
                            let signal = signal.from(done + part * i as f64);
                            let inflow = actuator.inflow(part, signal, gain, now);
                            let inflow_2 = match (&mut *pump, other) {
                                (Some(pump), Some((_, signal))) => {
                                    let signal = signal.from(passed + part * i as f64);
                                    pump.actuator.inflow(part, signal, pump.gain, now)
                                }
                                _ => Inflow::held(T::constant(0.0)),
                            };
                            let both = [&inflow, &inflow_2];
                            if let Some(sensor) = &mut lagging {
                                let mut follow = |stretch: &Stretch<T>| sensor.follow(stretch);
                                vessels.step_fed(part, both, now, &mut Some(&mut follow));
                            } else {
                                vessels.step_fed(part, both, now, &mut None);
                            }
                            now = now + part;
                        }
                        if ends.is_none() {
                            passed = passed + stretch;
                            return;
                        }
                        done = done + stretch;
                        (next, passed) = (next + 1, T::constant(0.0));
                    }
                });
            }
        }
        *time += h;
    }
}

/// Equal parts of a piece of an interval of length `h`, and the length of each: a short piece needs no more than its share.
fn cut<T: Scalar>(length: T, h: f64, substeps: usize) -> (usize, T) {
    let parts = substeps as f64 * length.value() / h;
    let parts = ((parts - 1e-9).ceil() as usize).max(1);
    if parts == 1 {
        (1, length)
    } else {
        (parts, length * (1.0 / parts as f64))
    }
}
