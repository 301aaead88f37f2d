//! Steps a structure from sample to sample.

mod construction;
mod numbers;

pub use numbers::SimulatorNumber;

use crate::{
    Scalar, actuator::Actuator, actuator::Signal, inflow::Feed, inflow::Inflow, sensor::Sensor,
    structure::MAX_VESSELS, structure::SERIES, vessels::Stretch, vessels::Vessels,
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

impl<T: SimulatorNumber> Simulator<T> {
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
        T::read(self, output)
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
        T::step(self, T::constant(command.from), command.to, second, h);
    }

    /// The same under a held command to the first pump that has derivatives, as a controller gives it.
    pub fn advance_held(&mut self, command: T, second: Command, h: f64) {
        T::step(self, command, None, second, h);
    }
}

impl<T: Scalar> Simulator<T> {
    fn reading(&mut self, output: usize) -> T {
        let (vessel, sensor) = &mut self.sensors[output];
        let level = match &self.layout {
            Layout::Series(vessels) => vessels.levels[*vessel],
            Layout::Joined(joined) => joined.vessels.levels[*vessel],
        };
        sensor.read(level, self.time)
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
