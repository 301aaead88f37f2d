//! Working storage of a step: registers, and slopes at the stages.

use super::drive::{Drive, Interval};
use super::sliding::Sliding;
use crate::scalar::Scalar;
use crate::tape::{Registers, Tape};

/// Stages whose slopes are stored: those of the method of order five, which has the most.
pub(super) const STAGES: usize = 7;

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
            slopes: vec![zero; STAGES * tape.states],
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

    /// Writes time, inputs, states and delayed values into the registers; held inputs are in the registers already.
    pub fn load(&mut self, tape: &Tape, drive: &Drive<'_, T>, time: T, x: &[T]) {
        let held = self.registers.held;
        let values = &mut self.registers.values;
        if tape.reads_time {
            values[0] = time;
        }
        let Interval {
            begin, from, rise, ..
        } = drive.interval;
        if !held {
            for (i, (&from, &rise)) in from.iter().zip(rise).enumerate() {
                values[tape.input(i)] = if rise == 0.0 {
                    T::constant(from)
                } else {
                    (time - begin) * rise + from
                };
            }
            for (i, driven) in self.driven.iter().enumerate() {
                if let Some(driven) = driven {
                    values[tape.input(i)] = *driven;
                }
            }
        }
        let first = tape.state(0);
        values[first..first + x.len()].copy_from_slice(x);
        for i in 0..tape.delays.len() {
            if let Some(value) = drive.delays.at(i, time) {
                values[tape.delayed(i)] = value;
            }
        }
    }

    /// Evaluates the slopes at a time for the states of `next`, and stores them as those of a stage.
    pub fn evaluate_next(&mut self, tape: &Tape, drive: &Drive<'_, T>, time: T, stage: usize) {
        let next = std::mem::take(&mut self.next);
        self.load(tape, drive, time, &next);
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
            self.slopes.copy_within((STAGES - 1) * n.., 0);
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
