//! Steps over several sampling intervals, while the inputs are held. The states at the samples within such a step are interpolated.
//!
//! That an input changes is known only at the sample where it does: the rest of the step is then discarded, as it is where a guard changes
//! its sign. The guards are evaluated at every sample, as they are after steps of one interval. Models whose equations read the time have no
//! such steps: what happens between the stages of a step, such as a pulse after a long rest, is not in its error.
//!
//! The values have the error of the tolerance. Derivatives have a relative error of at most its square root; they too accept or reject a
//! step, so that simulations with and without derivatives may differ by the tolerance.

use super::delays::Delays;
use super::drive::{Drive, Interval};
use super::explicit::{self, Interpolation};
use super::interval::{growth, reduction};
use super::step::largest;
use super::{Method, SimulationState};
use crate::scalar::Scalar;
use crate::tape::Tape;

/// Length of the shortest long step, of the first attempt, and of the longest one, in sampling intervals. A long step evaluates the slopes six
/// times, and a step of order four four times.
const FEWEST_INTERVALS: f64 = 5.0;
const FIRST_INTERVALS: f64 = 8.0;
const MOST_INTERVALS: f64 = 1000.0;
/// The most intervals before the next attempt.
const MOST_WAITING: u32 = 64;
/// Share of a step by which a sample may be after its end because of rounding.
const ROUNDING: f64 = 1e-9;

/// The present long step.
pub(super) struct LongStep<T> {
    /// A long step is in progress, and the registers hold its inputs, guards and outputs.
    active: bool,
    inside: Interpolation<T>,
    begin: f64,
    length: f64,
    /// Length that the error of the last one allows.
    allowed: f64,
    /// Number of samples that it has reached.
    reached: u32,
    /// Number of intervals before the next attempt, now and after the next failure.
    waiting: (u32, u32),
    /// The state at the last sample.
    before: Vec<T>,
}

impl<T: Scalar> LongStep<T> {
    pub fn new(states: usize) -> Self {
        Self {
            active: false,
            inside: Interpolation::new(states),
            begin: 0.0,
            length: 0.0,
            allowed: f64::INFINITY,
            reached: 0,
            waiting: (0, 1),
            before: vec![T::constant(0.0); states],
        }
    }

    pub fn is_active(&self) -> bool {
        self.active
    }

    /// Whether a long step is in progress and reaches this time.
    pub fn reaches(&self, until: f64) -> bool {
        self.active && (until - self.begin) / self.length <= 1.0 + ROUNDING
    }

    /// Ends the long step. After one that reached few samples, more intervals pass before the next attempt.
    pub fn end(&mut self) {
        if !self.active {
            return;
        }
        self.active = false;
        if f64::from(self.reached) >= FEWEST_INTERVALS {
            self.waiting = (0, 1);
        } else {
            self.wait();
        }
    }

    fn wait(&mut self) {
        let (now, next) = &mut self.waiting;
        *now = *next;
        *next = (2 * *next).min(MOST_WAITING);
    }
}

impl<T: Scalar> SimulationState<T> {
    /// Attempts a long step that begins at the present sample; the registers hold the inputs and the first stage the slopes.
    pub(super) fn begin_long_step(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        delays: &Delays<T>,
    ) -> bool {
        let is_smooth = self.method == Method::Explicit
            && !tape.reads_time
            && tape.delays.is_empty()
            && tape.plays.is_empty()
            && self.work.sliding.is_empty();
        if !is_smooth {
            return false;
        }
        if self.long_step.waiting.0 > 0 {
            self.long_step.waiting.0 -= 1;
            return false;
        }
        let mut most = if self.long_step.allowed.is_finite() {
            let allowed = self.long_step.allowed / interval.length;
            allowed.clamp(FEWEST_INTERVALS, MOST_INTERVALS)
        } else {
            FIRST_INTERVALS
        };
        self.order_four = false;
        loop {
            // Whole intervals, so that evenly spaced samples reach the end.
            let count = most.floor();
            if count < FEWEST_INTERVALS {
                self.long_step.allowed = FEWEST_INTERVALS * interval.length;
                self.long_step.wait();
                return false;
            }
            let length = count * interval.length;
            let error = self.attempt(tape, interval, T::constant(length), delays);
            // Where an effect is absent, the values do not depend on how fast it acts; its derivatives do.
            let tolerance = self.tolerance.sqrt();
            let of_derivatives =
                explicit::error_of_derivatives(&self.work, &self.state, length, tolerance);
            let error = largest([error, of_derivatives].into_iter());
            if error <= 1.0 {
                self.long_step.allowed = length * growth(error);
                self.long_step.length = length;
                break;
            }
            most = count * reduction(error);
        }
        let Self {
            long_step,
            work,
            state,
            ..
        } = self;
        let length = T::constant(long_step.length);
        long_step.inside.over(work, state, length);
        long_step.begin = self.time.value();
        long_step.active = true;
        long_step.reached = 0;
        true
    }

    /// Moves the states to the next sample within the long step. If a guard has changed its sign there, the long step ends at the present
    /// sample.
    pub(super) fn go_on_in_long_step(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        until: f64,
        delays: &Delays<T>,
    ) -> bool {
        let Self {
            long_step,
            work,
            state,
            ..
        } = self;
        long_step.before.copy_from_slice(state);
        let share = (until - long_step.begin) / long_step.length;
        long_step.inside.at(share, state);
        let drive = Drive::new(interval, delays);
        work.registers.held = true;
        work.load(tape, &drive, T::constant(until), state);
        tape.evaluate_readings(&mut work.registers);
        if tape.is_any_changed(&work.registers) {
            state.copy_from_slice(&long_step.before);
            long_step.end();
            return false;
        }
        long_step.reached += 1;
        self.note_largest();
        true
    }
}
