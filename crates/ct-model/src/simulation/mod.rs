//! Simulation of a model, with exact derivatives by parameters and initial states.
//!
//! - Models whose equations are linear in the states are integrated exactly from sample to sample: for held inputs in all cases, for
//!   linearly interpolated inputs if the equations are linear in the inputs too. A delay that outputs alone read is interpolated between exact
//!   states; with a delay elsewhere the model is integrated in steps.
//! - All other models are integrated by an explicit method of order five with step-size control, or of order four where the tolerance is
//!   large and the sampling interval short. Where its steps become far shorter than the error requires, the model is stiff, and an implicit
//!   method of order four continues until accuracy alone limits the steps again ([`Method`]).
//! - While the inputs are held, a step may have several sampling intervals, and the states at the samples are interpolated.
//! - Steps end where an input jumps, where a jump leaves a delay, and where a branch changes (`if`, `min`, `max`, `abs`, `sign`). Such a
//!   time depends on the parameters, and the step length carries its derivative, so that the later states have the derivatives of the exact
//!   solution.
//!
//! **Reference** for the derivatives through events: S. Galan, W. F. Feehery, P. I. Barton, Applied Numerical Mathematics 31 (1999) 17-47.

mod delays;
mod drive;
mod events;
mod exact;
mod explicit;
mod implicit;
mod interval;
mod long_step;
mod memory;
mod model;
mod numbers;
mod order_four;
mod owners;
mod sliding;
mod step;

pub use self::interval::TOLERANCE;
pub use self::model::Model;
pub use self::numbers::SimulationNumber;
pub use self::owners::{SharedSimulation, Simulation};

use self::delays::{Delay, Delays};
use self::drive::{Drive, Interval};
use self::exact::Exact;
use self::implicit::Jacobian;
use self::interval::MOST_STEPS;
use self::long_step::LongStep;
use self::step::Step;
use crate::linearity::ExactSteps;
use crate::scalar::Scalar;
use crate::tape::Tape;

/// The integration method of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Exact steps of a linear model.
    Exact,
    /// Explicit Runge-Kutta steps of order five (Dormand and Prince), or of order four where these are accurate enough.
    Explicit,
    /// Implicit Runge-Kutta steps of order four, for stiff models.
    Implicit,
}

/// The simulation has failed: a state grows beyond all bounds, or an equation has no value.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the simulation cannot continue after time {time}: a state grows without bound, or an equation has no value there"
)]
pub struct NoSolution {
    /// Time of the failure \[unit of the record's time\].
    pub time: f64,
}

/// A simulation in progress.
///
/// No memory is allocated from sample to sample, except for the past of delayed expressions.
pub struct SimulationState<T> {
    method: Method,
    time: T,
    state: Vec<T>,
    work: Step<T>,
    exact: Option<Exact<T>>,
    jacobian: Option<Jacobian>,
    delays: Option<Delays<T>>,
    /// Time at which each guard last changed its branch.
    changed: Vec<f64>,
    /// Relative tolerance of a step.
    tolerance: f64,
    /// Absolute tolerance of each state: the largest absolute value that it has had, times the relative tolerance.
    scale: Vec<f64>,
    largest: Vec<f64>,
    /// Steps that may be taken in addition to [`STEPS_PER_INTERVAL`].
    steps_left: usize,
    /// Step length that the error of the last step allows.
    length: f64,
    /// Number of implicit steps since explicit ones were considered, and the length of the longest of them.
    implicit_steps: (u32, f64),
    /// The present step is one of order four.
    order_four: bool,
    /// Number of steps of order five before order four is attempted again, now and after the next failure.
    order_five: (u32, u32),
    long_step: LongStep<T>,
    rise: Vec<f64>,
    /// The inputs at the end of the last interval.
    last: Vec<f64>,
    /// Length of the last interval.
    last_length: f64,
    /// The inputs at the last call of [`Simulation::read`].
    read: Vec<f64>,
    /// A zero slope for each input, for held inputs.
    held: Vec<f64>,
    /// The registers hold the values for the inputs `read` and the present states.
    computed: bool,
    /// For exact steps: change of the states' slopes per unit of time that the inputs' slopes cause.
    added: Vec<T>,
    scratch: Vec<T>,
    begun: bool,
    /// The registers hold slopes and guards at the end of the last interval, whose inputs were held.
    ended_within: bool,
    /// States whose initial values depend on inputs or other states have received these values.
    settled: bool,
}

impl<T: Scalar> SimulationState<T> {
    fn begin(model: &Model, parameters: &[T], initial: &[T], start: f64) -> Self {
        let tape = &model.tape;
        assert_eq!(parameters.len(), tape.parameters, "parameters");
        assert_eq!(initial.len(), tape.states, "initial states");
        let mut work = Step::new(tape, parameters);
        let exact = (model.exact != ExactSteps::No).then(|| Exact::new(tape, &mut work));
        // A function of inputs may have no value at inputs of zero, where the matrix is computed.
        let exact = exact.filter(Exact::is_finite);
        let zero = T::constant(0.0);
        let kinds = tape.known_ahead().into_iter().zip(tape.delays_of_outputs());
        let delays = tape.delays.iter().zip(kinds);
        let delays = delays.map(|(&(_, by), (ahead, of_output))| {
            let by = work.registers.values[by];
            // A negative delay is replaced by zero.
            let by = if by.value() < 0.0 { zero } else { by };
            Delay::new(by, ahead, of_output)
        });
        let plain: Vec<f64> = parameters.iter().map(|value| value.value()).collect();
        Self {
            method: if exact.is_some() {
                Method::Exact
            } else {
                Method::Explicit
            },
            time: T::constant(start),
            state: initial.to_vec(),
            jacobian: exact.is_none().then(|| Jacobian::new(tape, &plain)),
            exact,
            delays: Some(Delays {
                all: delays.collect(),
                for_outputs: false,
            }),
            changed: vec![f64::NEG_INFINITY; tape.guards.len()],
            tolerance: TOLERANCE,
            scale: vec![0.0; tape.states],
            largest: initial.iter().map(|x| x.value().abs()).collect(),
            steps_left: MOST_STEPS,
            length: f64::INFINITY,
            implicit_steps: (0, 0.0),
            order_four: false,
            order_five: (0, 1),
            long_step: LongStep::new(tape.states),
            rise: vec![0.0; tape.inputs],
            last: vec![0.0; tape.inputs],
            last_length: 0.0,
            read: vec![0.0; tape.inputs],
            held: vec![0.0; tape.inputs],
            computed: false,
            added: vec![zero; tape.states],
            scratch: vec![zero; tape.states],
            begun: false,
            ended_within: false,
            settled: false,
            work,
        }
    }

    fn read(&mut self, model: &Model, inputs: &[f64], outputs: &mut [T]) {
        let Some(mut delays) = self.delays.take() else {
            return;
        };
        delays.for_outputs = true;
        let drive = Drive::held(inputs, &self.held, &delays);
        let tape = &model.tape;
        if self.long_step.is_active() && inputs == self.last {
            // The outputs were computed together with the guards.
        } else if self.ended_within && inputs == self.last {
            // The reading is that at the end of the last step.
            tape.evaluate_outputs(&mut self.work.registers);
        } else {
            self.long_step.end();
            self.work.registers.held = false;
            self.work.load(tape, &drive, self.time, &self.state);
            if self.begun {
                self.let_through(tape, &delays);
            } else {
                self.before_the_record(tape);
            }
            self.remember(tape);
        }
        self.ended_within = false;
        self.read.copy_from_slice(inputs);
        // At the beginning of an interval, a jump may leave a delay and a play operator may move. Within a long step, slopes are not
        // computed.
        self.computed =
            tape.delays.is_empty() && tape.plays.is_empty() && !self.long_step.is_active();
        for (output, &register) in outputs.iter_mut().zip(&tape.outputs) {
            *output = self.work.registers.values[register];
        }
        if !self.work.sliding.is_empty() {
            self.computed = false;
            self.work.follow_sliding(tape);
            let interval = Interval {
                begin: self.time.value(),
                length: self.last_length,
                from: inputs,
                rise: &self.rise,
            };
            self.work
                .evaluate_slopes(tape, &Drive::new(interval, &delays));
            let Step {
                sliding, registers, ..
            } = &mut self.work;
            sliding.read(tape, registers, outputs);
        }
        delays.for_outputs = false;
        self.delays = Some(delays);
    }

    fn advance(
        &mut self,
        model: &Model,
        (from, to): (&[f64], &[f64]),
        until: f64,
    ) -> Result<(), NoSolution> {
        let Some(mut delays) = self.delays.take() else {
            return Err(NoSolution { time: until });
        };
        let done = self.go_on(model, (from, to), until, &mut delays);
        self.delays = Some(delays);
        self.last.copy_from_slice(to);
        done
    }

    fn go_on(
        &mut self,
        model: &Model,
        (from, to): (&[f64], &[f64]),
        until: f64,
        delays: &mut Delays<T>,
    ) -> Result<(), NoSolution> {
        let tape = &model.tape;
        let begin = self.time.value();
        let length = until - begin;
        self.last_length = length;
        self.ended_within = false;
        self.work.registers.held = false;
        self.settle(tape, from, delays);
        for ((rise, from), to) in self.rise.iter_mut().zip(from).zip(to) {
            *rise = (to - from) / length;
        }
        let rise = std::mem::take(&mut self.rise);
        let interval = Interval {
            begin,
            length,
            from,
            rise: &rise,
        };
        if model.exact == ExactSteps::HeldInputs && rise.iter().any(|rise| *rise != 0.0) {
            self.go_on_in_steps(tape);
        }
        let result = match (&self.exact, delays.all.is_empty()) {
            (None, _) => self.step_over(tape, interval, until, delays),
            (Some(_), true) => {
                self.step_exactly(tape, (from, &rise), length, delays);
                Ok(())
            }
            (Some(_), false) => {
                self.step_in_pieces(tape, interval, delays);
                Ok(())
            }
        };
        self.rise = rise;
        self.computed = false;
        self.time = T::constant(until);
        let finite = |x: &T| x.value().abs() < 1e150;
        if result.is_ok() && self.state.iter().all(finite) {
            Ok(())
        } else {
            Err(NoSolution { time: begin })
        }
    }

    /// Steps over one interval, or the part in it of a step over several.
    fn step_over(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        until: f64,
        delays: &mut Delays<T>,
    ) -> Result<(), NoSolution> {
        let is_still = self.begun && interval.is_held() && !self.jumps(interval.from);
        let goes_on = is_still && self.long_step.reaches(until);
        if goes_on && self.go_on_in_long_step(tape, interval, until, delays) {
            return Ok(());
        }
        self.long_step.end();
        self.begin_interval(tape, interval, until, delays);
        // Where a guard has changed its sign, a new long step would meet the same change.
        let begins = is_still && !goes_on && self.begin_long_step(tape, interval, delays);
        if begins && self.go_on_in_long_step(tape, interval, until, delays) {
            return Ok(());
        }
        self.steps(tape, interval, until, delays)
    }

    fn drive(&mut self, driven: &[Option<T>]) {
        self.work.driven.clear();
        self.work.driven.extend_from_slice(driven);
        // A driven input may have other derivatives at the same value.
        (self.computed, self.ended_within) = (false, false);
    }

    /// Whether an input jumps between the last interval and one that begins with these inputs.
    fn jumps(&self, from: &[f64]) -> bool {
        from != self.last || !self.work.driven.is_empty()
    }

    /// Changes from exact steps to explicit ones: the inputs are no longer held, and the model is nonlinear in them.
    fn go_on_in_steps(&mut self, tape: &Tape) {
        if self.exact.take().is_none() {
            return;
        }
        let parameters = &self.work.registers.values[1..=tape.parameters];
        let plain: Vec<f64> = parameters.iter().map(|value| value.value()).collect();
        self.jacobian = Some(Jacobian::new(tape, &plain));
        self.method = Method::Explicit;
        self.note_largest();
    }
}
