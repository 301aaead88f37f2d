//! Spans: steps over several sampling intervals, while the inputs are held. The states at the samples within a span are interpolated.
//!
//! That an input changes is known only at the sample where it does: the rest of the span is then discarded, as it is where a guard changes
//! its sign. The guards are evaluated at every sample, as they are after steps of one interval.

use super::delays::Delays;
use super::explicit::{self, Interpolation};
use super::interval::{longer, shorter};
use super::step::{Drive, Interval, largest};
use super::{Method, SimulationState};
use crate::scalar::Scalar;
use crate::tape::Tape;

/// The shortest span, in sampling intervals. A span has six evaluations of the slopes, and a step of order four has four.
const SHORTEST: f64 = 5.0;
/// The first span that is attempted, in sampling intervals.
const FIRST: f64 = 8.0;
/// The longest span, in sampling intervals.
const LONGEST: f64 = 1000.0;
/// The most intervals before the next span is attempted.
const MOST_WAITING: u32 = 64;
/// By how much of a span a sample may lie beyond its end, by rounding.
const ROUNDING: f64 = 1e-9;

/// The present span.
pub(super) struct Span<T> {
    /// A span is in progress, and the registers hold its inputs.
    active: bool,
    inside: Interpolation<T>,
    begin: f64,
    length: f64,
    /// Length that the error of the last span allows.
    allowed: f64,
    /// Number of samples that the span has reached.
    reached: u32,
    /// Number of intervals before a span is attempted, now and after the next failure.
    waiting: (u32, u32),
    /// The state at the last sample.
    before: Vec<T>,
}

impl<T: Scalar> Span<T> {
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

    /// Ends the span; one that has not been worth its evaluations makes the next ones rarer.
    pub fn end(&mut self) {
        if !self.active {
            return;
        }
        self.active = false;
        if f64::from(self.reached) >= SHORTEST {
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
    /// Attempts a span that begins at the present sample; the registers hold the inputs and the first stage the slopes.
    pub(super) fn begin_span(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        delays: &Delays<T>,
    ) -> bool {
        let is_smooth = self.method == Method::Explicit
            && tape.delays.is_empty()
            && tape.plays.is_empty()
            && self.work.sliding.is_empty();
        if !is_smooth {
            return false;
        }
        if self.span.waiting.0 > 0 {
            self.span.waiting.0 -= 1;
            return false;
        }
        let mut most = if self.span.allowed.is_finite() {
            (self.span.allowed / interval.length).min(LONGEST)
        } else {
            FIRST
        };
        self.order_four = false;
        loop {
            // Whole intervals, so that evenly spaced samples reach the end.
            let count = most.floor();
            if count < SHORTEST {
                self.span.allowed = SHORTEST * interval.length;
                self.span.wait();
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
                self.span.allowed = length * longer(error);
                self.span.length = length;
                break;
            }
            most = count * shorter(error);
        }
        let Self {
            span, work, state, ..
        } = self;
        span.inside.over(work, state, T::constant(span.length));
        span.begin = self.time.value();
        span.active = true;
        span.reached = 0;
        true
    }

    /// Moves the states to the next sample, if the span reaches it and no guard has changed its sign; otherwise the span ends at the present
    /// sample.
    pub(super) fn go_on_in_span(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        until: f64,
        delays: &Delays<T>,
    ) -> bool {
        let share = (until - self.span.begin) / self.span.length;
        if share > 1.0 + ROUNDING {
            self.span.end();
            return false;
        }
        self.span.before.copy_from_slice(&self.state);
        self.span.inside.at(share, &mut self.state);
        let drive = Drive::new(interval, delays);
        self.work.registers.held = true;
        drive.load(tape, &mut self.work, T::constant(until), &self.state);
        tape.evaluate_readings(&mut self.work.registers);
        if tape.is_any_crossed(&self.work.registers) {
            self.state.copy_from_slice(&self.span.before);
            self.span.end();
            return false;
        }
        self.span.reached += 1;
        self.note_largest();
        true
    }
}
