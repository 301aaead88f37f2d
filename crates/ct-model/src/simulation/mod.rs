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
mod exact;
mod explicit;
mod implicit;
mod memory;
mod sliding;
mod step;

use self::delays::{Delay, Delays, POINTS};
use self::exact::Exact;
use self::implicit::Jacobian;
use self::step::{Drive, Interval, Step};
use crate::linearity::ExactSteps;
use crate::scalar::Scalar;
use crate::spec::ModelSpec;
use crate::tape::{Register, Registers, Tape};

/// Error of a step, as a share of the largest absolute value that a state has had. Derivatives are those of the steps that follow: at twice
/// this they are off by some 1e-3 where a right-hand side bends sharply.
const TOLERANCE: f64 = 1e-10;
/// The shortest step, as a share of an interval between rows.
const SHORTEST: f64 = 1e-9;
/// After two events of one guard that lie nearer to each other than this share of an interval a step of this length is taken.
const SLIDE: f64 = 1e-2;
/// A step is at most so many times as long as the last one.
const LONGER: f64 = 5.0;
/// A step that is longer than the error asked for by this much is tried, where it is the last one of an interval.
const STRETCH: f64 = 1.1;
/// Steps in an interval beyond which the simulation has failed, ...
const MOST_STEPS: usize = 50_000;
/// ... and those that every interval adds to what is left of them: a trial whose steps are short all along ends within seconds.
const STEPS_PER_INTERVAL: usize = 300;
/// Steps in an interval from which on the model may be stiff.
const MANY_STEPS: usize = 40;
/// It is where the length of such steps times the norm of the Jacobian is above this: the stability of the method, and not its error, limits
/// them.
const STABILITY: f64 = 1.5;
/// An event's time is found to this share of the step.
const EVENT: f64 = 1e-13;
/// Distance of the differences from which the speed of a guard is computed, as a share of the step.
const SPEED: f64 = 1e-4;

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

/// A model that is ready to be simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    spec: ModelSpec,
    tape: Tape,
    exact: ExactSteps,
}

impl Model {
    /// Compiles a model.
    #[must_use]
    pub fn new(spec: ModelSpec) -> Self {
        let tape = Tape::compile(&spec);
        let exact = if tape.delays.is_empty() && !spec.states.is_empty() {
            spec.exact_steps()
        } else {
            ExactSteps::No
        };
        Self { spec, tape, exact }
    }

    /// What it was compiled from.
    #[must_use]
    pub fn spec(&self) -> &ModelSpec {
        &self.spec
    }

    /// Its operations.
    pub(crate) fn tape(&self) -> &Tape {
        &self.tape
    }

    /// The values of its parameters as the text has them, in the order of [`ModelSpec::parameters`].
    #[must_use]
    pub fn parameters(&self) -> Vec<f64> {
        let parameters = self.spec.parameters.iter();
        parameters.map(|parameter| parameter.value).collect()
    }

    /// The initial values of the states as the text has them, of these parameters.
    #[must_use]
    pub fn starts<T: Scalar>(&self, parameters: &[T]) -> Vec<T> {
        let mut registers = self.tape.registers(parameters);
        self.tape.evaluate_with_guards(&mut registers);
        let starts = self.tape.starts.iter();
        starts.map(|&register| registers.values[register]).collect()
    }
}

/// A simulation in progress.
///
/// Nothing is allocated from row to row, but for the past of what is delayed.
pub struct Simulation<'a, T> {
    model: &'a Model,
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

impl<'a, T: Scalar> Simulation<'a, T> {
    /// Begins at `start` on the clock that `time` follows, with parameters in the order of [`ModelSpec::parameters`] and a value for
    /// each state.
    ///
    /// # Panics
    /// Where the numbers of parameters or states are not the model's.
    #[must_use]
    pub fn new(model: &'a Model, parameters: &[T], initial: &[T], start: f64) -> Self {
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
            model,
        }
    }

    /// How it is simulated by now.
    #[must_use]
    pub fn method(&self) -> Method {
        self.method
    }

    /// The present states.
    #[must_use]
    pub fn state(&self) -> &[T] {
        &self.state
    }

    /// The outputs now, with the inputs of this row.
    pub fn read(&mut self, inputs: &[f64], outputs: &mut [T]) {
        let Some(delays) = self.delays.take() else {
            return;
        };
        let drive = Drive::held(inputs, &self.held, &delays);
        let tape = &self.model.tape;
        if self.ended_within && inputs == self.last {
            // The last step's end is this reading.
            tape.evaluate_outputs(&mut self.work.registers);
        } else {
            self.work.registers.held = false;
            drive.load(tape, &mut self.work, self.time, &self.state);
            if self.begun {
                self.let_through(&delays);
            } else {
                self.before_the_record();
            }
            self.remember();
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

    /// Goes on to `until`, the inputs in straight lines from one value to the other (the same where they are held).
    ///
    /// # Errors
    /// Where the simulation cannot go on.
    pub fn advance(&mut self, from: &[f64], to: &[f64], until: f64) -> Result<(), NoSolution> {
        let Some(mut delays) = self.delays.take() else {
            return Err(NoSolution { time: until });
        };
        let done = self.go_on(from, to, until, &mut delays);
        self.delays = Some(delays);
        self.last.copy_from_slice(to);
        done
    }

    fn go_on(
        &mut self,
        from: &[f64],
        to: &[f64],
        until: f64,
        delays: &mut Delays<T>,
    ) -> Result<(), NoSolution> {
        let model = self.model;
        let tape = &model.tape;
        let begin = self.time.value();
        let length = until - begin;
        self.last_length = length;
        self.ended_within = false;
        self.work.registers.held = false;
        self.settle(from, delays);
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
        if self.model.exact == ExactSteps::HeldInputs && rise.iter().any(|rise| *rise != 0.0) {
            self.go_on_in_steps();
        }
        let result = if self.exact.is_some() {
            self.step_exactly(from, &rise, length)
        } else {
            self.begin_interval(interval, until, delays);
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
    fn go_on_in_steps(&mut self) {
        if self.exact.take().is_none() {
            return;
        }
        let tape = &self.model.tape;
        let parameters = &self.work.registers.values[1..=tape.parameters];
        let plain: Vec<f64> = parameters.iter().map(|value| value.value()).collect();
        self.jacobian = Some(Jacobian::new(tape, &plain));
        self.method = Method::Explicit;
        self.note_largest();
    }

    fn step_exactly(&mut self, from: &[f64], rise: &[f64], h: f64) -> Result<(), NoSolution> {
        let tape = &self.model.tape;
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
        self.remember();
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

    /// The guards' answers where an interval begins, and what delays know of it.
    fn begin_interval(&mut self, interval: Interval<'_>, until: f64, delays: &mut Delays<T>) {
        let tape = &self.model.tape;
        let Interval {
            begin, from, rise, ..
        } = interval;
        let first = !self.begun;
        let jumps = first || from != self.last;
        let bends = rise.iter().any(|rise| *rise != 0.0);
        if !delays.all.is_empty() {
            if first {
                let drive = Drive::new(interval, delays);
                drive.load(tape, &mut self.work, self.time, &self.state);
                self.before_the_record();
                for (delay, &(what, _)) in delays.all.iter_mut().zip(&tape.delays) {
                    delay.begin(self.time, self.work.registers.values[what]);
                }
            } else if jumps || bends {
                for delay in &mut delays.all {
                    delay.jump(self.time);
                }
            }
            let length = T::constant(until) - self.time;
            self.keep_past(interval, length, delays, true);
            for delay in &mut delays.all {
                delay.forget(begin);
            }
        }
        self.begun = true;
        if !self.is_computed(from) {
            let drive = Drive::new(interval, delays);
            drive.load(tape, &mut self.work, self.time, &self.state);
            tape.evaluate_with_guards(&mut self.work.registers);
            self.remember();
            self.slide_on(tape, &drive);
        }
        // Whatever made the registers, it was computed for the inputs of this interval.
        self.work.registers.held = !bends;
        self.work.keep_slope(tape, 0);
        self.work.begun = true;
    }

    /// Whether the registers hold what these inputs give at the present row.
    fn is_computed(&self, inputs: &[f64]) -> bool {
        self.computed && self.read == inputs
    }

    /// Keeps what is delayed over the next or the last step: what is known ahead for a whole interval, everything else after each step.
    fn keep_past(
        &mut self,
        interval: Interval<'_>,
        length: T,
        delays: &mut Delays<T>,
        ahead: bool,
    ) {
        let tape = &self.model.tape;
        if length.value() <= 0.0 || delays.all.iter().all(|delay| delay.known_ahead != ahead) {
            return;
        }
        let count = delays.all.len();
        let mut values = vec![[T::constant(0.0); POINTS]; count];
        for point in 0..POINTS {
            let share = point as f64 / (POINTS - 1) as f64;
            let mut state = std::mem::take(&mut self.scratch);
            state.copy_from_slice(&self.state);
            if !ahead {
                match self.method {
                    Method::Implicit => {
                        for (i, x) in state.iter_mut().enumerate() {
                            *x = *x + (self.work.next[i] - *x) * share;
                        }
                    }
                    _ => explicit::within(&self.work, &self.state, length, share, &mut state),
                }
            }
            let drive = Drive::new(interval, delays);
            drive.load(tape, &mut self.work, self.time + length * share, &state);
            if ahead {
                tape.evaluate_with_guards(&mut self.work.registers);
            } else {
                tape.evaluate(&mut self.work.registers);
            }
            self.scratch = state;
            for (values, &(what, _)) in values.iter_mut().zip(&tape.delays) {
                values[point] = self.work.registers.values[what];
            }
        }
        for (delay, values) in delays.all.iter_mut().zip(values) {
            if delay.known_ahead == ahead {
                delay.push(self.time, length, values);
            }
        }
    }

    fn steps(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        until: f64,
        delays: &mut Delays<T>,
    ) -> Result<(), NoSolution> {
        let shortest = SHORTEST * interval.length;
        let mut taken = 0;
        let most = self.steps_left + STEPS_PER_INTERVAL;
        loop {
            let now = self.time.value();
            let left = T::constant(until) - self.time;
            // The end of what is smooth: the row, or a jump that comes out of a delay.
            let mut limit = left;
            let mut out = None;
            for (i, delay) in delays.all.iter().enumerate() {
                if let Some(next) = delay.next_out() {
                    let distance = next - self.time;
                    if distance.value() < limit.value() {
                        limit = distance;
                        out = Some(i);
                    }
                }
            }
            if out.is_none() && left.value() <= 1e-14 * interval.length {
                // What is left of the interval has a derivative, where its last step ended at an event.
                self.finish(tape, interval, left, delays);
                return Ok(());
            }
            taken += 1;
            self.steps_left = (most - taken).min(MOST_STEPS);
            if taken == most {
                return Err(NoSolution { time: now });
            }
            let mut longest = self.length;
            for delay in delays.all.iter().filter(|delay| !delay.known_ahead) {
                longest = longest.min(delay.by.value().max(interval.length / 50.0));
            }
            let whole = limit.value() <= longest * STRETCH;
            let mut h = if whole { limit } else { T::constant(longest) };
            let mut error = self.attempt(tape, interval, h, delays);
            let mut beyond = None;
            if error.is_nan() {
                beyond = self.branch_before(tape, interval, h, delays);
            }
            if let Some((event, error_there)) = &beyond {
                (h, error) = (event.after, *error_there);
            }
            if (error > 1.0 || error.is_nan()) && h.value() > shortest {
                // What is no number asks for a much shorter step.
                let factor = if error.is_finite() {
                    (0.9 * error.powf(-0.2)).clamp(0.1, 0.9)
                } else {
                    0.1
                };
                self.length = (h.value() * factor).max(shortest);
                continue;
            }
            if !error.is_finite() {
                return Err(NoSolution { time: now });
            }
            let is_new = beyond.is_none();
            let event = match beyond {
                Some((event, _)) => Some(event),
                None => self.first_event(tape, interval, h, delays),
            };
            let is_short = !whole || error > 0.5 || self.length < h.value() * LONGER;
            if event.is_none() && is_short {
                let grown = h.value() * (0.9 * error.max(1e-10).powf(-0.2)).clamp(0.2, LONGER);
                if !whole || error > 0.5 || grown > self.length {
                    self.length = grown.max(shortest);
                }
            }
            if let Some(Event { after, .. }) = event.as_ref().filter(|_| is_new) {
                h = *after;
                self.attempt(tape, interval, h, delays);
            }
            self.keep_past(interval, h, delays, false);
            let sliding = !self.work.sliding.is_empty();
            self.work
                .go_on(event.is_none() && !sliding && self.method == Method::Explicit);
            self.state.copy_from_slice(&self.work.next);
            self.time = self.time + h;
            if sliding {
                self.put_back(tape, &Drive::new(interval, delays));
            }
            self.note_largest();
            if event.is_none() && whole && out.is_none() {
                let explicit = self.method == Method::Explicit;
                self.ended_within = explicit
                    && !sliding
                    && self.work.registers.held
                    && !tape.reads_time
                    && tape.plays.is_empty();
                return Ok(());
            }
            if let Some(Event { change, .. }) = event {
                let drive = Drive::new(interval, delays);
                drive.load(tape, &mut self.work, self.time, &self.state);
                self.change(tape, &drive, change);
                for delay in delays.all.iter_mut().filter(|delay| !delay.known_ahead) {
                    delay.jump(self.time);
                }
            } else if let Some(out) = out.filter(|_| whole) {
                delays.all[out].let_out();
                self.work.begun = false;
                // A branch may stand on what jumps.
                let drive = Drive::new(interval, delays);
                drive.load(tape, &mut self.work, self.time, &self.state);
                tape.evaluate_with_guards(&mut self.work.registers);
                self.slide_on(tape, &drive);
                for (i, delay) in delays.all.iter_mut().enumerate() {
                    if i != out && !delay.known_ahead {
                        delay.jump(self.time);
                    }
                }
            }
            if taken == MANY_STEPS && self.method == Method::Explicit {
                self.look_for_stiffness(tape, h.value());
            }
        }
    }

    /// Where an equation has no value within a step: the change of a branch before that, `sqrt(max(x, 0))` at zero, and the error of the step
    /// to it, which stands computed.
    fn branch_before(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        h: T,
        delays: &Delays<T>,
    ) -> Option<(Event<T>, f64)> {
        self.work.registers.extended = true;
        self.work.begun = false;
        let error = self.attempt(tape, interval, h, delays);
        let event = error
            .is_finite()
            .then(|| self.first_event(tape, interval, h, delays))
            .flatten();
        let found = event.map(|event| {
            let error = self.attempt(tape, interval, event.after, delays);
            (event, error)
        });
        self.work.registers.extended = false;
        self.work.begun = false;
        found
    }

    /// Changes branches where a step has ended at an event; what drives the model stands in the registers.
    fn change(&mut self, tape: &Tape, drive: &Drive<'_, T>, change: Change) {
        let Step {
            sliding, registers, ..
        } = &mut self.work;
        let difference = match change {
            Change::Crossed(difference, positive) => {
                tape.answer(registers, difference, positive);
                sliding.add(tape, registers, difference);
                self.work.evaluate_slopes(tape, drive);
                let length = drive.interval.length;
                if self.work.sliding.is_attractive(length, &self.largest) {
                    self.put_back(tape, drive);
                } else {
                    let Step {
                        sliding, registers, ..
                    } = &mut self.work;
                    sliding.remove(tape, registers, sliding.len() - 1, positive);
                }
                difference
            }
            Change::LetGo(k, positive) => sliding.remove(tape, registers, k, positive),
            Change::None => return,
        };
        for (guard, changed) in tape.guards.iter().zip(&mut self.changed) {
            if guard.difference == difference {
                *changed = self.time.value();
            }
        }
    }

    /// Puts states back onto the guards that stay at zero.
    fn put_back(&mut self, tape: &Tape, drive: &Drive<'_, T>) {
        drive.load(tape, &mut self.work, self.time, &self.state);
        self.work.evaluate_slopes(tape, drive);
        let Step {
            sliding, registers, ..
        } = &mut self.work;
        sliding.put_back(registers, &mut self.state);
    }

    /// Guards stay at zero where every guard has answered by its difference, but for those that an input has moved off or whose sides do not
    /// both lead there any more.
    fn slide_on(&mut self, tape: &Tape, drive: &Drive<'_, T>) {
        while !self.work.sliding.is_empty() {
            self.work.follow_sliding(tape);
            self.work.evaluate_slopes(tape, drive);
            let Step {
                sliding, registers, ..
            } = &mut self.work;
            let Some((k, positive)) = sliding.let_go(registers, drive.interval.length) else {
                break;
            };
            sliding.remove(tape, registers, k, positive);
            self.work.evaluate_slopes(tape, drive);
        }
    }

    /// Carries the derivative of what is left of an interval whose last step ended at its very end.
    fn finish(&mut self, tape: &Tape, interval: Interval<'_>, left: T, delays: &Delays<T>) {
        let drive = Drive::new(interval, delays);
        drive.load(tape, &mut self.work, self.time, &self.state);
        self.work.evaluate_slopes(tape, &drive);
        for (x, &register) in self.state.iter_mut().zip(&tape.derivatives) {
            *x = *x + left * self.work.registers.values[register];
        }
    }

    fn note_largest(&mut self) {
        for (largest, x) in self.largest.iter_mut().zip(&self.state) {
            *largest = largest.max(x.value().abs());
        }
    }

    fn look_for_stiffness(&mut self, tape: &Tape, h: f64) {
        if let Some(jacobian) = &mut self.jacobian {
            jacobian.compute(tape, &self.work.registers);
            if self.length.min(h) * jacobian.norm() > STABILITY {
                self.method = Method::Implicit;
            }
        }
    }

    /// Computes a step, with the answers of the guards as they are, and its error against the tolerance.
    fn attempt(&mut self, tape: &Tape, interval: Interval<'_>, h: T, delays: &Delays<T>) -> f64 {
        let drive = Drive::new(interval, delays);
        for (i, scale) in self.scale.iter_mut().enumerate() {
            let slope = self.work.slopes.get(i).map_or(0.0, |k| k.value().abs());
            let moved = if slope.is_finite() {
                slope * h.value()
            } else {
                0.0
            };
            *scale = TOLERANCE * self.largest[i].max(moved).max(1e-30);
        }
        let at = (self.time, &self.state[..], h);
        match (&mut self.jacobian, self.method) {
            (Some(jacobian), Method::Implicit) => {
                implicit::step(tape, &mut self.work, jacobian, &drive, at, &self.scale)
                    .unwrap_or(f64::NAN)
            }
            _ => {
                explicit::step(tape, &mut self.work, &drive, at);
                explicit::error(&self.work, h.value(), &self.scale)
            }
        }
    }

    /// What may change within a step: what of it has to stay above zero, where the registers are.
    fn distance(&self, watched: Watched) -> T {
        let Step {
            sliding, registers, ..
        } = &self.work;
        match watched {
            Watched::Guard(guard) => {
                let difference = self.model.tape.guards[guard].difference;
                registers.values[difference]
            }
            Watched::Share(k, true) => T::constant(1.0 - sliding.share(k)),
            Watched::Share(k, false) => T::constant(sliding.share(k)),
        }
    }

    /// The first change of a branch within the step that has been computed.
    fn first_event(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        h: T,
        delays: &Delays<T>,
    ) -> Option<Event<T>> {
        if tape.guards.is_empty() || h.value() <= 0.0 {
            return None;
        }
        tape.evaluate_guards(&mut self.work.registers);
        let Registers {
            values, answers, ..
        } = &self.work.registers;
        let guards = tape.guards.iter().zip(answers);
        let mut stays = guards
            .map(|(guard, &answer)| !guard.is_crossed(answer, values[guard.difference].value()));
        if self.work.sliding.is_empty() && stays.all(|stays| stays) {
            return None;
        }
        let answers = self.work.registers.answers.clone();
        let is_crossed = |watched: Watched, value: f64| match watched {
            Watched::Guard(i) => tape.guards[i].is_crossed(answers[i], value),
            Watched::Share(..) => value < 0.0,
        };
        let sliding = &self.work.sliding;
        let guards = (0..tape.guards.len()).map(Watched::Guard);
        let shares =
            (0..sliding.len()).flat_map(|k| [Watched::Share(k, false), Watched::Share(k, true)]);
        let crossed = guards.chain(shares).filter_map(|watched| {
            if let Watched::Guard(i) = watched
                && sliding.holds(tape.guards[i].difference)
            {
                return None;
            }
            let distance = self.distance(watched).value();
            is_crossed(watched, distance).then_some((watched, distance))
        });
        let crossed: Vec<_> = crossed.collect();
        let at = |own: &mut Self, watched: Watched, share: f64| {
            let part = T::constant(h.value() * share);
            own.attempt(tape, interval, part, delays);
            tape.evaluate_guards(&mut own.work.registers);
            own.distance(watched)
        };
        let mut first: Option<(f64, Watched, bool)> = None;
        for (watched, mut ends_with) in crossed {
            let mut end = 1.0;
            if let Some((share, ..)) = first {
                end = share;
                ends_with = at(self, watched, share).value();
            }
            if !is_crossed(watched, ends_with) {
                continue;
            }
            let begins_with = at(self, watched, 0.0).value();
            // It may have been on the other side when the step began.
            let share = if is_crossed(watched, begins_with) || begins_with == 0.0 {
                0.0
            } else {
                let distance = |share: f64| at(self, watched, share).value();
                change_of_sign(distance, (0.0, begins_with), (end, ends_with))
            };
            first = Some((share, watched, ends_with > 0.0));
        }
        let (share, watched, positive) = first?;
        let mut after = T::constant(h.value() * share);
        let guard = match watched {
            // Slopes are the same with the share at its end and without: the time needs no derivative.
            Watched::Share(k, upper) => {
                return Some(Event {
                    after,
                    change: Change::LetGo(k, upper),
                });
            }
            Watched::Guard(guard) => guard,
        };
        let difference = tape.guards[guard].difference;
        let slide = SLIDE * interval.length;
        let since = self.time.value() - self.changed[guard];
        if since < slide && share * h.value() < 1e-3 * slide {
            // It changes back at once, by rounding: to either side in turn.
            let after = T::constant(slide.min(h.value()));
            self.attempt(tape, interval, after, delays);
            tape.evaluate_guards(&mut self.work.registers);
            let there = self.distance(watched).value();
            let change = if is_crossed(watched, there) {
                Change::Crossed(difference, there > 0.0)
            } else {
                Change::None
            };
            return Some(Event { after, change });
        }
        let speed = (at(self, watched, share + SPEED).value()
            - at(self, watched, share - SPEED).value())
            / (2.0 * SPEED * h.value());
        if speed != 0.0 && speed.is_finite() {
            let here = at(self, watched, share);
            after = T::with_slopes(after.value(), [(here, -1.0 / speed)]);
        }
        Some(Event {
            after,
            change: Change::Crossed(difference, positive),
        })
    }
}

/// Where a function changes its sign between two points, by regula falsi with halved ordinates (Illinois); the point on the far side.
fn change_of_sign(
    mut f: impl FnMut(f64) -> f64,
    (mut a, mut fa): (f64, f64),
    (mut b, mut fb): (f64, f64),
) -> f64 {
    let far = fb.is_sign_positive();
    let mut last = None;
    for _ in 0..100 {
        if b - a <= EVENT {
            break;
        }
        let mut c = (a * fb - b * fa) / (fb - fa);
        if !(c > a && c < b) {
            c = 0.5 * (a + b);
        }
        let fc = f(c);
        if fc == 0.0 {
            return c;
        }
        let is_far = fc.is_sign_positive() == far;
        if is_far {
            (b, fb) = (c, fc);
        } else {
            (a, fa) = (c, fc);
        }
        if last == Some(is_far) {
            if is_far {
                fa *= 0.5;
            } else {
                fb *= 0.5;
            }
        }
        last = Some(is_far);
    }
    b
}

/// A change of branches within a step.
struct Event<T> {
    /// How long after its beginning.
    after: T,
    change: Change,
}

#[derive(Clone, Copy)]
enum Change {
    None,
    /// A difference has changed its sign; whether to a positive one.
    Crossed(Register, bool),
    /// A guard that stayed at zero does so no more; whether it turns positive.
    LetGo(usize, bool),
}

/// What is looked at after each step.
#[derive(Clone, Copy)]
enum Watched {
    Guard(usize),
    /// The share of a guard that stays at zero, at its upper or lower end.
    Share(usize, bool),
}
