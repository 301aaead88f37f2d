//! Simulation of a structure from sample to sample.

mod construction;
mod numbers;

pub use numbers::SimulatorNumber;

use crate::{
    Scalar, actuator::Actuator, actuator::Signal, inflow::Feed, inflow::Inflow,
    limits::MAX_VESSELS, limits::SERIES, sensor::Sensor, vessels::Stretch, vessels::Vessels,
};

/// The command over one sampling interval \[input unit\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Command at the beginning of the interval.
    pub from: f64,
    /// Command at the end of a linear ramp; `None`: the command is held.
    pub to: Option<f64>,
}

impl Command {
    /// A held command (zero-order hold).
    #[must_use]
    pub fn held(u: f64) -> Self {
        Self { from: u, to: None }
    }
    /// A linear ramp (first-order hold).
    #[must_use]
    pub fn ramp(from: f64, to: f64) -> Self {
        Self { from, to: Some(to) }
    }
}

/// A simulation in progress. Call [`Simulator::read`] before [`Simulator::advance`]: `y[k]` is read before `u[k]` acts.
///
/// Linear plants without effects in their vessels are propagated exactly, in closed form. Other plants are integrated by a Runge-Kutta
/// method of order four in [`Simulator::set_substeps`] equal parts of the sampling interval. The parts are cut where the delayed input
/// jumps, where a level reaches its rim and where a law jumps. Parts longer than a vessel's time constant are exponential Runge-Kutta steps
/// (see the [front page](crate#steps-longer-than-a-time-constant)). A step allocates no memory, except for the queue of a dead time while
/// it fills.
pub struct Simulator<T: Scalar> {
    actuator: Actuator<T>,
    layout: Layout<T>,
    /// For each output, the vessel whose level it reads, and its sensor.
    sensors: Vec<(usize, Sensor<T>)>,
    /// The output whose sensor has a lag.
    lagging: Option<usize>,
    pump_gain: T,
    disturbance: Option<Disturbance<T>>,
    time: f64,
    substeps: usize,
}

/// How the vessels are connected.
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
    /// Inflow per unit of the disturbance.
    gain: T,
    /// The disturbance flows into the lower of two vessels. A flow into the upper vessel, or into the only one, is added to the pump's
    /// inflow.
    into_lower: bool,
}

impl<T: Scalar> Disturbance<T> {
    /// The inflow by the disturbance over an interval of length `h`.
    fn over(&self, Command { from, to }: Command, time: f64, h: f64) -> Feed<T> {
        let rise = to.map_or(0.0, |to| to - from);
        let coefficients = [self.gain * from, self.gain * rise, T::constant(0.0)];
        Feed::new(T::constant(time), T::constant(h), coefficients)
    }
}

struct SecondPump<T: Scalar> {
    actuator: Actuator<T>,
    gain: T,
    /// Lengths and commands of the pump's pieces in the present interval (scratch space).
    pieces: Vec<(T, Signal<T>)>,
}

impl<T: SimulatorNumber> Simulator<T> {
    /// Sets the number of equal parts of every sampling interval (at least one).
    pub fn set_substeps(&mut self, n: usize) {
        self.substeps = n.max(1);
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.sensors.len()
    }

    /// The present reading of an output. Sensors may have memory: call it once for each output and sample, in order of time.
    pub fn read(&mut self, output: usize) -> T {
        T::read(self, output)
    }

    /// The present level of each vessel; only the first [`crate::Plant::vessels`] entries are used.
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

    /// Present position of the element that the command to the first pump moves: the latest command, unless there is backlash or stiction.
    /// A simulation that takes it as `at_rest` continues from there.
    pub fn stands(&self) -> f64 {
        self.actuator.stands()
    }

    /// Time on the clock of drifts, steps and periods \[s\]: zero when the record began, unless the record is a later part of an
    /// experiment.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Advances by one sampling interval of length `h` \[s\], with a command of zero to the second pump and no measured disturbance.
    pub fn advance(&mut self, command: Command, h: f64) {
        self.advance_both([command, Command::held(0.0)], h);
    }

    /// As [`Simulator::advance`], with two inputs, each held or a ramp: the commands to both pumps, or a command and a measured
    /// disturbance. The second input is ignored if the plant has neither a second pump nor a disturbance.
    pub fn advance_both(&mut self, [command, second]: [Command; 2], h: f64) {
        T::step(self, T::constant(command.from), command.to, second, h);
    }

    /// As [`Simulator::advance`], with a held command to the first pump that has derivatives, as a controller computes it.
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
                // The pieces of the one pump are cut where the pieces of the other pump end.
                let mut next = 0;
                let mut passed = T::constant(0.0);
                actuator.pieces(from, to, *time, h, |actuator, length, signal| {
                    let mut done = T::constant(0.0);
                    loop {
                        let left = length - done;
                        let other = pump.as_ref().and_then(|pump| pump.pieces.get(next));
                        let other = other.map(|&(whole, signal)| (whole - passed, signal));
                        // The last piece of the other pump ends with the interval, whatever the rounding error.
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

/// Number and length of the equal parts of a piece; a short piece of an interval of length `h` has proportionally fewer parts.
fn cut<T: Scalar>(length: T, h: f64, substeps: usize) -> (usize, T) {
    let parts = substeps as f64 * length.value() / h;
    let parts = ((parts - 1e-9).ceil() as usize).max(1);
    if parts == 1 {
        (1, length)
    } else {
        (parts, length * (1.0 / parts as f64))
    }
}
