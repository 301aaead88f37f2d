//! Simulates a model, with exact derivatives by parameters and initial states.
//!
//! - Models without delays whose states go linearly into their equations, and inputs that are held in any way, go from row to row exactly;
//!   with inputs in straight lines where these go in linearly too.
//! - All others by an explicit method of order five whose steps follow its error, until its steps are far shorter than the error asks for:
//!   then the model is stiff there, and an implicit method of order four goes on ([`Method`]).
//! - Steps end where an input jumps, where a delay lets a jump through, and where a branch changes (`if`, `min`, `max`, `abs`, `sign`).
//!   Such a time depends on the parameters, and the length of the step carries its derivative: what comes after has the derivatives of the
//!   true solution.
//!
//! **Reference** for the derivatives through events: S. Galan, W. F. Feehery, P. I. Barton, Applied Numerical Mathematics 31 (1999) 17-47.

mod delays;
mod events;
mod exact;
mod explicit;
mod implicit;
mod interval;
mod memory;
mod model;
mod numbers;
mod owners;
mod sliding;
mod step;

pub use self::model::Model;
pub use self::numbers::SimulationNumber;
pub use self::owners::{SharedSimulation, Simulation};

use self::delays::{Delay, Delays};
use self::exact::Exact;
use self::implicit::Jacobian;
use self::interval::MOST_STEPS;
use self::step::{Drive, Interval, Step};
use crate::linearity::ExactSteps;
use crate::scalar::Scalar;
use crate::tape::Tape;

/// How a model is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Linear: exactly.
    Exact,
    /// Explicit Runge-Kutta steps of order five (Dormand and Prince).
    Explicit,
    /// Stiff: implicit Runge-Kutta steps of order four.
    Implicit,
}

/// The simulation cannot go on: states that grow beyond all bounds, or an equation that has no value there.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the simulation cannot go on beyond time {time}: a state grows without bound, or an equation has no value there"
)]
pub struct NoSolution {
    /// When \[unit of the record's time\].
    pub time: f64,
}

/// A simulation in progress, without its model: whoever owns it hands over the same model in every call.
pub struct SimulationState<T> {
    method: Method,
    time: T,
    state: Vec<T>,
    work: Step<T>,
    exact: Option<Exact<T>>,
    jacobian: Option<Jacobian>,
    delays: Option<Delays<T>>,
    /// When each guard changed its answer last.
    changed: Vec<f64>,
    /// The largest absolute value that each state has had, times the tolerance.
    scale: Vec<f64>,
    largest: Vec<f64>,
    /// Steps that may be taken beside [`STEPS_PER_INTERVAL`].
    steps_left: usize,
    /// Length of the last step that the error allowed.
    length: f64,
    rise: Vec<f64>,
    /// The inputs at the end of the last interval.
    last: Vec<f64>,
    /// Length of the last interval.
    last_length: f64,
    /// The inputs of the last reading.
    read: Vec<f64>,
    /// No rise.
    held: Vec<f64>,
    /// The registers hold what these and the present states give.
    computed: bool,
    /// What the rise of the inputs adds to the slopes, per unit of time: of exact steps.
    added: Vec<T>,
    scratch: Vec<T>,
    begun: bool,
    /// The registers hold slopes and guards where the last interval ended, with inputs that were held in it.
    ended_within: bool,
    /// Settled states have their initial values.
    settled: bool,
}

impl<T: Scalar> SimulationState<T> {
    fn begin(model: &Model, parameters: &[T], initial: &[T], start: f64) -> Self {
        let tape = &model.tape;
        assert_eq!(parameters.len(), tape.parameters, "parameters");
        assert_eq!(initial.len(), tape.states, "initial states");
        let mut work = Step::new(tape, parameters);
        let exact = (model.exact != ExactSteps::No).then(|| Exact::new(tape, &mut work));
        // A function of inputs may have no value at zero, where the matrix is read.
        let exact = exact.filter(Exact::is_finite);
        let zero = T::constant(0.0);
        let delays = tape.delays.iter().zip(tape.known_ahead());
        let delays = delays.map(|(&(_, by), ahead)| {
            let by = work.registers.values[by];
            // Nothing comes out before it went in.
            Delay::new(if by.value() < 0.0 { zero } else { by }, ahead)
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
            }),
            changed: vec![f64::NEG_INFINITY; tape.guards.len()],
            scale: vec![0.0; tape.states],
            largest: initial.iter().map(|x| x.value().abs()).collect(),
            steps_left: MOST_STEPS,
            length: f64::INFINITY,
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
        let Some(delays) = self.delays.take() else {
            return;
        };
        let drive = Drive::held(inputs, &self.held, &delays);
        let tape = &model.tape;
        if self.ended_within && inputs == self.last {
            // The last step's end is this reading.
            tape.evaluate_outputs(&mut self.work.registers);
        } else {
            self.work.registers.held = false;
            drive.load(tape, &mut self.work, self.time, &self.state);
            if self.begun {
                self.let_through(tape, &delays);
            } else {
                self.before_the_record(tape);
            }
            self.remember(tape);
        }
        self.ended_within = false;
        self.read.copy_from_slice(inputs);
        // A delay may let something through, and a play move, where the interval begins.
        self.computed = tape.delays.is_empty() && tape.plays.is_empty();
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
        let result = if self.exact.is_some() {
            self.step_exactly(tape, from, &rise, length)
        } else {
            self.begin_interval(tape, interval, until, delays);
            self.steps(tape, interval, until, delays)
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

    /// From here on the inputs go in straight lines through what is not linear.
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

    fn step_exactly(
        &mut self,
        tape: &Tape,
        from: &[f64],
        rise: &[f64],
        h: f64,
    ) -> Result<(), NoSolution> {
        let n = tape.states;
        let delays = Delays { all: Vec::new() };
        // `time` plays no part in what is linear; held inputs first, then what their rise adds.
        if !self.is_computed(from) {
            let drive = Drive::held(from, &self.held, &delays);
            drive.load(tape, &mut self.work, self.time, &self.state);
            // A branch may stand on an input.
            tape.evaluate_with_guards(&mut self.work.registers);
        }
        self.work.keep_slope(tape, 0);
        self.remember(tape);
        self.begun = true;
        if rise.iter().any(|rise| *rise != 0.0) {
            let ends = self.last.iter_mut().zip(from).zip(rise);
            for ((end, from), rise) in ends {
                *end = from + rise * h;
            }
            let drive = Drive::held(&self.last, &self.held, &delays);
            drive.load(tape, &mut self.work, self.time, &self.state);
            tape.evaluate(&mut self.work.registers);
            self.work.keep_slope(tape, 1);
            for (i, added) in self.added.iter_mut().enumerate() {
                *added = (self.work.slopes[n + i] - self.work.slopes[i]) * (1.0 / h);
            }
        } else {
            self.added.fill(T::constant(0.0));
        }
        if let Some(exact) = &mut self.exact {
            exact.step(&mut self.state, &self.work.slopes[..n], &self.added, h);
        }
        Ok(())
    }
}
