//! A structure set against records: the vector that is fitted, and its bounds.

mod build;
mod priors;
mod rows;
mod simulation;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use ct_signals::{Channel, Hold, Record};
use estimation::{Noise, Prior};
use plants::{Command, Place, Placed, Structure, controller::Controller};

pub use self::priors::PriorValue;
pub(crate) use self::priors::priors_of;
pub use self::simulation::{LoopRun, Simulated, weighted_rms};
use crate::{Error, LinearPlant, Replay, TimeLimit, clock::Clock, feedback::Feedback};

/// A structure, the records, and which parameters are free.
///
/// The fitted vector holds the structure's parameters (free ones and fixed ones), then for every record the initial
/// level of every vessel and what stood behind every lag ([`Structure::lags`]) and, where the loop is simulated
/// ([`Setup::in_loop`]), the states of the controller.
#[derive(Debug, Clone)]
pub struct Setup<'a> {
    /// The structure.
    pub structure: Structure,
    /// The records that are fitted together.
    pub records: &'a [Record],
    /// Parameters that are not fitted, with their values.
    pub fixed: BTreeMap<String, f64>,
    /// Equal parts of a sampling interval in the simulation.
    pub substeps: usize,
    /// Cancellation flag: when set, nothing is simulated, and fits end with [`Error::Stopped`].
    pub stop: Option<&'a AtomicBool>,
    /// Interruption flag: when set, fits end where they are, as if the time limit had passed.
    pub interrupt: Option<&'a AtomicBool>,
    /// Limit on the time, shared by all fits of a search.
    pub time_limit: Option<Arc<TimeLimit>>,
    names: Vec<String>,
    bounds: Vec<(f64, f64)>,
    /// Positions of the parameters that are fitted.
    free: Vec<usize>,
    /// How many entries come before the initial states.
    parameters: usize,
    /// Samples of each output in all records, missing ones aside.
    samples: Vec<usize>,
    /// See [`estimation::Residuals::floor`].
    floors: Vec<f64>,
    /// Standard deviations of the outputs' noise, where they are known ([`estimation::Residuals::known_scales`]).
    pub known_scales: Option<Vec<f64>>,
    /// What is known of parameters beside the records.
    priors: Vec<Prior>,
    /// The controller, where the loop is simulated.
    feedback: Option<Feedback>,
    /// When each record begins on the clock of drifts, steps and periods.
    clock: Clock,
}

/// What an initial state costs in [`Setup::price`].
///
/// The logarithm of the samples stands for what a record tells of a parameter, which grows with its length. An initial state is
/// forgotten after a few time constants, and a longer record tells no more of it. Two is the price of Akaike's criterion. Where
/// it costs the logarithm, a lag, whose state before the record is unknown, is handicapped against a dead time.
const STATE_PRICE: f64 = 2.0;

impl<'a> Setup<'a> {
    /// The same structure and records in the loop of a controller, simulated from the reference, and the vector `x` with
    /// the controller's initial states: those with which it gives the measured command.
    ///
    /// From here on [`Setup::rows`], [`Setup::linearise`] and all fits take the loop for the model, and their rows are
    /// filtered so that the residual is the disturbance at the plant's output (the head of `feedback.rs` says how and
    /// why). [`Setup::simulate`] and [`Setup::residuals`] go on to run on the measured command, so that errors compare.
    ///
    /// # Errors
    /// Where a record has no reference or a constant one, or its command is not held.
    pub fn in_loop(&self, controller: &Controller, x: &[f64]) -> Result<(Self, Vec<f64>), Error> {
        let (sum, count) = self
            .records
            .iter()
            .flat_map(|record| &record.inputs[0].values)
            .fold((0.0, 0.0), |(sum, count), u| (sum + u, count + 1.0));
        let plant = LinearPlant::at(&self.structure, &x[..self.parameter_count()], sum / count)?;
        let feedback = Feedback::new(controller, self.records, plant)?;
        let mut with = x[..self.parameter_count()].to_vec();
        for (r, replay) in feedback.replays.iter().enumerate() {
            with.extend(&x[self.plant_states_of(r)]);
            with.extend(&replay.states);
        }
        Ok((self.rebuilt(self.structure.clone(), Some(feedback))?, with))
    }

    fn rebuilt(&self, structure: Structure, feedback: Option<Feedback>) -> Result<Self, Error> {
        let mut setup = Self::build(structure, self.records, self.fixed.clone(), feedback)?;
        setup.limited_as(self);
        setup.clock = self.clock.clone();
        let mut priors = self.prior_values();
        priors.retain(|name, _| setup.names[..setup.parameters].contains(name));
        setup.with_priors(&priors)
    }

    /// The same setup with the controller's initial states fitted like the others.
    ///
    /// They are known from the measured command, and by default they stay there: the knowledge of where the command
    /// stood is worth much. Let go, they take the offset of a linear tank with them, whose standard error is then gone, and
    /// a static coefficient of a tank is known half as well.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn with_unknown_controller_states(&self) -> Result<Self, Error> {
        let mut feedback = self.feedback.clone();
        if let Some(feedback) = &mut feedback {
            feedback.released = true;
        }
        self.rebuilt(self.structure.clone(), feedback)
    }

    /// The loop is simulated.
    pub(crate) fn is_in_loop(&self) -> bool {
        self.feedback.is_some()
    }

    /// What the controller gives on the measured reading of each record; empty where the loop is not simulated.
    #[must_use]
    pub fn replays(&self) -> &[Replay] {
        self.feedback.as_ref().map_or(&[], |f| &f.replays)
    }

    /// The same records against another structure.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn with_structure(&self, structure: Structure) -> Result<Self, Error> {
        self.rebuilt(structure, self.feedback.clone())
    }

    /// The computation was cancelled.
    #[must_use]
    pub fn stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// The time limit has passed, or the user has ended the search: fits take no further steps.
    #[must_use]
    pub fn out_of_time(&self) -> bool {
        self.interrupt
            .is_some_and(|interrupt| interrupt.load(Ordering::Relaxed))
            || self.time_limit.as_ref().is_some_and(|limit| limit.passed())
    }

    /// Whether a part of a search has to be left out for want of time, or because the computation was cancelled; it is noted then.
    #[must_use]
    pub fn leaves_out(&self, part: &str) -> bool {
        let out = self.stopped() || self.out_of_time();
        if out && let Some(limit) = &self.time_limit {
            limit.leave_out(part);
        }
        out
    }

    /// Steps and limits of another setup.
    fn limited_as<'c: 'a>(&mut self, other: &Setup<'c>) {
        self.substeps = other.substeps;
        self.stop = other.stop;
        self.interrupt = other.interrupt;
        self.time_limit.clone_from(&other.time_limit);
        self.known_scales.clone_from(&other.known_scales);
    }

    /// The same structure against other records, in the same scales, run on the measured command, without priors. Those that begin after
    /// the records of this setup have ended continue its clock.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn with_records<'b>(&self, records: &'b [Record]) -> Result<Setup<'b>, Error>
    where
        'a: 'b,
    {
        let mut setup: Setup<'b> = Setup::new(self.structure.clone(), records, self.fixed.clone())?;
        setup.limited_as(self);
        setup.clock = self.clock.with_records(records);
        Ok(setup)
    }

    /// Names of the vector's entries.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Bounds of the vector's entries.
    #[must_use]
    pub fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    /// Positions of the entries that are fitted.
    #[must_use]
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// How many of the vector's entries are parameters, before the initial states.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        self.parameters
    }

    /// The unit of every entry in words.
    #[must_use]
    pub fn unit_labels(&self) -> Vec<String> {
        let record = &self.records[0];
        let (level, input) = (&record.outputs[0].unit, &record.inputs[0].unit);
        let parameters = self.structure.parameters();
        let mut units: Vec<String> = parameters
            .iter()
            .map(|info| {
                let second = record
                    .inputs
                    .get(1)
                    .filter(|_| info.name == "disturbance_gain");
                let input = second.map_or(input, |second| &second.unit);
                self.structure.unit_label(info, level, input)
            })
            .collect();
        for _ in self.records {
            units.extend((0..self.structure.plant.vessels()).map(|_| level.clone()));
            units.extend(self.structure.lags().iter().map(|lag| {
                if lag.effect.place == plants::Place::Actuator {
                    input.clone()
                } else {
                    level.clone()
                }
            }));
            let controller = self.feedback.as_ref().map_or(0, |f| f.controller.states());
            units.extend((0..controller).map(|_| input.clone()));
        }
        units
    }

    /// Entries of one record: its initial levels, what its lags begin with, the controller's states.
    pub(crate) fn states(&self) -> usize {
        (self.names.len() - self.parameters) / self.records.len()
    }

    /// Puts the fixed parameters' values in their places.
    pub(crate) fn impose_fixed(&self, x: &mut [f64]) {
        for (name, value) in self.names.iter().zip(x) {
            if let Some(fixed) = self.fixed.get(name) {
                *value = *fixed;
            }
        }
    }

    /// Holds every parameter; only initial levels stay free.
    pub fn freeze_parameters(&mut self) {
        let count = self.parameter_count();
        self.free.retain(|&i| i >= count);
    }

    /// What the fitted numbers cost in the Bayesian information criterion, with a noise of so many coefficients and its variance:
    /// the logarithm of the samples each, but two for an initial state.
    #[must_use]
    pub fn price(&self, noise_order: usize) -> f64 {
        let states = self.free.iter().filter(|&&i| i >= self.parameters).count();
        let lasting = self.free.len() - states + self.outputs() + noise_order;
        lasting as f64 * (self.samples() as f64).ln() + STATE_PRICE * states as f64
    }

    /// Holds the initial states; only parameters stay free. For records that begin where a simulation has led to.
    pub fn hold_initial_states(&mut self) {
        let count = self.parameter_count();
        self.free.retain(|&i| i < count);
    }

    /// Samples of all outputs in all records, missing ones aside.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples.iter().sum()
    }

    /// Samples of each output in all records, missing ones aside.
    #[must_use]
    pub fn samples_per_output(&self) -> &[usize] {
        &self.samples
    }

    /// Whether the controller of the loop reads this output.
    fn reads(&self, output: usize) -> bool {
        let controller = self.feedback.as_ref().map(|f| f.controller.output());
        controller == Some(output)
    }

    /// How many outputs there are.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.samples.len()
    }

    /// White noise at every output.
    #[must_use]
    pub fn white_noise(&self) -> Noise {
        Noise::white(self.outputs())
    }

    /// Positions of the initial states of record `r`.
    fn states_of(&self, r: usize) -> std::ops::Range<usize> {
        let n = self.states();
        let from = self.parameter_count() + r * n;
        from..from + n
    }

    /// Positions of the plant's initial states of record `r`, from 0, without those of the controller.
    #[must_use]
    pub fn plant_states_of(&self, r: usize) -> std::ops::Range<usize> {
        let own = self.states_of(r);
        let controller = self.feedback.as_ref().map_or(0, |f| f.controller.states());
        own.start..own.end - controller
    }

    /// The controller's initial states as they give the measured command of record `r`.
    pub(crate) fn controller_states(&self, r: usize) -> &[f64] {
        self.feedback.as_ref().map_or(&[], |f| &f.replays[r].states)
    }
}

/// The inputs from sample `k` to the next one: the command, and that to a second pump or a measured disturbance; zero where there is none.
pub fn commands(record: &Record, k: usize) -> [Command; 2] {
    let command = |u: &Channel| match u.hold {
        Hold::Zero => Command::held(u.values[k]),
        Hold::First => Command::ramp(u.values[k], u.values[k + 1]),
    };
    [command(&record.inputs[0]), second(record, command)]
}

/// The second input at sample `k`, held: the command to a second pump or a measured disturbance; zero where there is none.
fn second_command(record: &Record, k: usize) -> Command {
    second(record, |u| Command::held(u.values[k]))
}

fn second(record: &Record, command: impl Fn(&Channel) -> Command) -> Command {
    record.inputs.get(1).map_or(Command::held(0.0), command)
}

/// The inputs before a record began: its first ones.
#[must_use]
pub fn at_rest(record: &Record) -> [f64; 2] {
    let second = record.inputs.get(1);
    [
        record.inputs[0].values[0],
        second.map_or(0.0, |signal| signal.values[0]),
    ]
}

/// The pump in front of which something lags, the first one for what is not at a pump.
fn pump_of(lag: Placed) -> usize {
    if lag.effect.place == Place::Actuator {
        lag.vessel.min(1)
    } else {
        0
    }
}

/// The set point at sample `k`; not a number where the record has none.
fn reference(record: &Record, k: usize) -> f64 {
    record.references.first().map_or(f64::NAN, |r| r.values[k])
}
