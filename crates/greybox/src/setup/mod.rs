//! A structure with its records: the parameter vector that is fitted, and its bounds.

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
/// The parameter vector holds the structure's parameters (free and fixed). Then follow, for every record, the initial level of every
/// vessel, the initial state of every lag ([`Structure::lags`]) and, if the loop is simulated ([`Setup::in_loop`]), the states of the
/// controller.
#[derive(Debug, Clone)]
pub struct Setup<'a> {
    /// The structure.
    pub structure: Structure,
    /// The records, which are fitted together.
    pub records: &'a [Record],
    /// Fixed parameters with their values.
    pub fixed: BTreeMap<String, f64>,
    /// Number of equal parts of a sampling interval in the simulation.
    pub substeps: usize,
    /// Cancellation flag: when set, simulations are not started, and fits end with [`Error::Stopped`].
    pub stop: Option<&'a AtomicBool>,
    /// Interruption flag: when set, fits end with their present iterate, as after the time limit.
    pub interrupt: Option<&'a AtomicBool>,
    /// Limit on the time, shared by all fits of a search.
    pub time_limit: Option<Arc<TimeLimit>>,
    names: Vec<String>,
    bounds: Vec<(f64, f64)>,
    /// Indices of the free parameters in the parameter vector.
    free: Vec<usize>,
    /// Number of entries before the initial states.
    parameters: usize,
    /// Number of samples of each output in all records, without missing ones.
    samples: Vec<usize>,
    /// See [`estimation::Residuals::floor`].
    floors: Vec<f64>,
    /// Standard deviations of the outputs' noise, if known ([`estimation::Residuals::known_scales`]).
    pub known_scales: Option<Vec<f64>>,
    /// Prior information on parameters.
    priors: Vec<Prior>,
    /// The controller, if the loop is simulated.
    feedback: Option<Feedback>,
    /// The start time of each record on the clock of drifts, steps and periods.
    clock: Clock,
}

/// BIC penalty of a free initial state, see [`Setup::bic_penalty`].
///
/// In BIC, a parameter's penalty is the logarithm of the number of samples, because the information on a parameter grows with the record.
/// The influence of an initial state decays after a few time constants, so a longer record contains no more information on it; its penalty
/// is that of Akaike's criterion, 2. With the logarithm, BIC would prefer a dead time to a lag, which has an unknown initial state.
const STATE_PENALTY: f64 = 2.0;

impl<'a> Setup<'a> {
    /// The same structure and records in closed loop: the loop with the controller is simulated from the reference. Returns the setup and
    /// the vector `x` extended by the controller's initial states, those that reproduce the measured command.
    ///
    /// The returned setup uses the closed-loop model in [`Setup::rows`], [`Setup::linearise`] and all fits. Their rows are filtered such
    /// that the residual is the disturbance at the plant's output (method and derivation: head of `feedback.rs`). [`Setup::simulate`] and
    /// [`Setup::residuals`] still use the measured command, so that simulation errors are comparable.
    ///
    /// # Errors
    /// If a record has no reference or a constant one, or its command is not held.
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

    /// The same setup with the controller's initial states as free parameters.
    ///
    /// By default these states are fixed at the values computed from the measured command, which is valuable information. If they are free,
    /// the offset of a linear tank is no longer identifiable and has no standard error, and the standard error of a static coefficient of a
    /// tank doubles.
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

    /// Whether the closed loop is simulated.
    pub(crate) fn is_in_loop(&self) -> bool {
        self.feedback.is_some()
    }

    /// The controller simulated on the measured reading of each record; empty if the loop is not simulated.
    #[must_use]
    pub fn replays(&self) -> &[Replay] {
        self.feedback.as_ref().map_or(&[], |f| &f.replays)
    }

    /// A setup of the same records with another structure.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn with_structure(&self, structure: Structure) -> Result<Self, Error> {
        self.rebuilt(structure, self.feedback.clone())
    }

    /// Whether the computation was cancelled.
    #[must_use]
    pub fn stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// Whether the time limit has passed or the user has ended the search: fits then stop iterating.
    #[must_use]
    pub fn out_of_time(&self) -> bool {
        self.interrupt
            .is_some_and(|interrupt| interrupt.load(Ordering::Relaxed))
            || self.time_limit.as_ref().is_some_and(|limit| limit.passed())
    }

    /// Whether a part of a search is skipped because time is up or the computation was cancelled; a skipped part is recorded.
    #[must_use]
    pub fn leaves_out(&self, part: &str) -> bool {
        let out = self.stopped() || self.out_of_time();
        if out && let Some(limit) = &self.time_limit {
            limit.leave_out(part);
        }
        out
    }

    /// Copies substeps, flags and time limit from another setup.
    fn limited_as<'c: 'a>(&mut self, other: &Setup<'c>) {
        self.substeps = other.substeps;
        self.stop = other.stop;
        self.interrupt = other.interrupt;
        self.time_limit.clone_from(&other.time_limit);
        self.known_scales.clone_from(&other.known_scales);
    }

    /// The same structure with other records, with the same scales, on the measured command and without priors. Records that begin after
    /// the end of this setup's records continue its clock.
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

    /// Names of the parameter vector's entries.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Bounds of the parameter vector's entries.
    #[must_use]
    pub fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    /// Indices of the free entries.
    #[must_use]
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// Number of parameters, which come before the initial states.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        self.parameters
    }

    /// The unit of every entry as text.
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

    /// Number of entries of one record: its initial levels, the initial states of its lags, and the controller's states.
    pub(crate) fn states(&self) -> usize {
        (self.names.len() - self.parameters) / self.records.len()
    }

    /// Writes the values of the fixed parameters into a parameter vector.
    pub(crate) fn impose_fixed(&self, x: &mut [f64]) {
        for (name, value) in self.names.iter().zip(x) {
            if let Some(fixed) = self.fixed.get(name) {
                *value = *fixed;
            }
        }
    }

    /// Fixes all parameters; only initial states remain free.
    pub fn freeze_parameters(&mut self) {
        let count = self.parameter_count();
        self.free.retain(|&i| i >= count);
    }

    /// BIC penalty of all estimated numbers: the free entries, the noise variances and `noise_order` noise coefficients. It is the
    /// logarithm of the number of samples for each, but 2 for an initial state.
    #[must_use]
    pub fn bic_penalty(&self, noise_order: usize) -> f64 {
        let states = self.free.iter().filter(|&&i| i >= self.parameters).count();
        let lasting = self.free.len() - states + self.outputs() + noise_order;
        lasting as f64 * (self.samples() as f64).ln() + STATE_PENALTY * states as f64
    }

    /// Fixes the initial states; only parameters remain free. For records whose initial state comes from a simulation.
    pub fn hold_initial_states(&mut self) {
        let count = self.parameter_count();
        self.free.retain(|&i| i < count);
    }

    /// Number of samples of all outputs in all records, without missing ones.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples.iter().sum()
    }

    /// Number of samples of each output in all records, without missing ones.
    #[must_use]
    pub fn samples_per_output(&self) -> &[usize] {
        &self.samples
    }

    /// Number of outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.samples.len()
    }

    /// A white-noise model for every output.
    #[must_use]
    pub fn white_noise(&self) -> Noise {
        Noise::white(self.outputs())
    }

    /// Indices of the initial states of record `r`.
    fn states_of(&self, r: usize) -> std::ops::Range<usize> {
        let n = self.states();
        let from = self.parameter_count() + r * n;
        from..from + n
    }

    /// Indices of the plant's initial states of record `r`, counted from 0, without the controller's states.
    #[must_use]
    pub fn plant_states_of(&self, r: usize) -> std::ops::Range<usize> {
        let own = self.states_of(r);
        let controller = self.feedback.as_ref().map_or(0, |f| f.controller.states());
        own.start..own.end - controller
    }

    /// The controller's initial states that reproduce the measured command of record `r`.
    pub(crate) fn controller_states(&self, r: usize) -> &[f64] {
        self.feedback.as_ref().map_or(&[], |f| &f.replays[r].states)
    }
}

/// The inputs from sample `k` to the next one: the command, and the second input (command to a second pump or measured disturbance), zero
/// if there is none.
pub fn commands(record: &Record, k: usize) -> [Command; 2] {
    let command = |u: &Channel| match u.hold {
        Hold::Zero => Command::held(u.values[k]),
        Hold::First => Command::ramp(u.values[k], u.values[k + 1]),
    };
    [command(&record.inputs[0]), second(record, command)]
}

/// The second input at sample `k`, held: the command to a second pump or a measured disturbance; zero if there is none.
fn second_command(record: &Record, k: usize) -> Command {
    second(record, |u| Command::held(u.values[k]))
}

fn second(record: &Record, command: impl Fn(&Channel) -> Command) -> Command {
    record.inputs.get(1).map_or(Command::held(0.0), command)
}

/// The inputs before the record began, taken as its first samples.
#[must_use]
pub fn at_rest(record: &Record) -> [f64; 2] {
    let second = record.inputs.get(1);
    [
        record.inputs[0].values[0],
        second.map_or(0.0, |signal| signal.values[0]),
    ]
}

/// Index of the pump at which a lag is; the first pump for a lag that is not at a pump.
fn pump_of(lag: Placed) -> usize {
    if lag.effect.place == Place::Actuator {
        lag.vessel.min(1)
    } else {
        0
    }
}

/// The set point at sample `k`; NaN if the record has none.
fn reference(record: &Record, k: usize) -> f64 {
    record.references.first().map_or(f64::NAN, |r| r.values[k])
}
