//! Working storage of a step: registers, slopes at the stages, and the inputs of the model.

use super::delays::Delays;
use super::explicit;
use super::sliding::Sliding;
use crate::scalar::Scalar;
use crate::tape::{Registers, Tape};

/// Storage of one step.
#[derive(Debug, Clone)]
pub(super) struct Step<T> {
    pub registers: Registers<T>,
    /// The derivative of the states at each stage, one stage after the other.
    pub slopes: Vec<T>,
    /// The states at the end of the step.
    pub next: Vec<T>,
    /// The first stage holds the slope at the beginning of the step already.
    pub begun: bool,
    /// Guards on whose surfaces the states slide.
    pub sliding: Sliding<T>,
    /// The inputs that a controller drives, held, with their derivatives; empty if there is none.
    pub driven: Vec<Option<T>>,
}

impl<T: Scalar> Step<T> {
    pub fn new(tape: &Tape, parameters: &[T]) -> Self {
        let zero = T::constant(0.0);
        Self {
            registers: tape.registers(parameters),
            slopes: vec![zero; explicit::STAGES * tape.states],
            next: vec![zero; tape.states],
            begun: false,
            sliding: Sliding::none(),
            driven: Vec::new(),
        }
    }

    /// Computes the slopes from the registers and, while states slide, the differences of the guards.
    pub fn evaluate_slopes(&mut self, tape: &Tape, drive: &Drive<'_, T>) {
        tape.evaluate_slopes(&mut self.registers);
        if !self.sliding.is_empty() {
            tape.evaluate_guards(&mut self.registers);
            self.sliding.mean_slopes(tape, &mut self.registers, drive);
        }
    }

    /// Evaluates the slopes at a time for the states of `next`, and stores them as those of a stage.
    pub fn evaluate_next(&mut self, tape: &Tape, drive: &Drive<'_, T>, time: T, stage: usize) {
        let next = std::mem::take(&mut self.next);
        drive.load(tape, self, time, &next);
        self.next = next;
        self.evaluate_slopes(tape, drive);
        self.keep_slope(tape, stage);
    }

    /// Sets the guards on which the states slide to their sides again, whatever the signs of their differences.
    pub fn follow_sliding(&mut self, tape: &Tape) {
        self.sliding.follow(tape, &mut self.registers);
    }

    /// Prepares the next step: its initial slope is the slope at the end of this step, unless there is a jump in between.
    pub fn go_on(&mut self, smooth: bool) {
        let n = self.next.len();
        if smooth {
            self.slopes.copy_within((explicit::STAGES - 1) * n.., 0);
        }
        self.begun = smooth;
    }

    /// Stores the derivative that the registers hold as the slope of a stage.
    pub fn keep_slope(&mut self, tape: &Tape, stage: usize) {
        let slopes = &mut self.slopes[stage * tape.states..];
        for (slope, &register) in slopes.iter_mut().zip(&tape.derivatives) {
            *slope = self.registers.values[register];
        }
    }
}

/// The largest of the states' errors, or NaN if one is NaN.
pub(super) fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a })
}

/// A sampling interval and the inputs in it, each linear in time.
#[derive(Clone, Copy)]
pub(super) struct Interval<'a> {
    pub begin: f64,
    pub length: f64,
    pub from: &'a [f64],
    /// Slope of each input.
    pub rise: &'a [f64],
}

impl Interval<'_> {
    /// Whether all inputs are constant over the interval.
    pub fn is_held(&self) -> bool {
        self.rise.iter().all(|rise| *rise == 0.0)
    }
}

/// The inputs and delayed expressions over an interval.
#[derive(Clone, Copy)]
pub(super) struct Drive<'a, T> {
    pub interval: Interval<'a>,
    pub delays: &'a Delays<T>,
}

impl<'a, T: Scalar> Drive<'a, T> {
    pub fn new(interval: Interval<'a>, delays: &'a Delays<T>) -> Self {
        Self { interval, delays }
    }

    /// Inputs that are held; `still`: a zero slope for each.
    pub fn held(inputs: &'a [f64], still: &'a [f64], delays: &'a Delays<T>) -> Self {
        let interval = Interval {
            begin: 0.0,
            length: 0.0,
            from: inputs,
            rise: still,
        };
        Self { interval, delays }
    }

    /// Writes time, inputs, states and delayed values into the registers; held inputs are in the registers already.
    pub fn load(&self, tape: &Tape, work: &mut Step<T>, time: T, x: &[T]) {
        let held = work.registers.held;
        let values = &mut work.registers.values;
        if tape.reads_time {
            values[0] = time;
        }
        let Interval {
            begin, from, rise, ..
        } = self.interval;
        if !held {
            for (i, (&from, &rise)) in from.iter().zip(rise).enumerate() {
                values[tape.input(i)] = if rise == 0.0 {
                    T::constant(from)
                } else {
                    (time - begin) * rise + from
                };
            }
            for (i, driven) in work.driven.iter().enumerate() {
                if let Some(driven) = driven {
                    values[tape.input(i)] = *driven;
                }
            }
        }
        let first = tape.state(0);
        values[first..first + x.len()].copy_from_slice(x);
        for i in 0..tape.delays.len() {
            values[tape.delayed(i)] = self.delays.at(i, time);
        }
    }
}
