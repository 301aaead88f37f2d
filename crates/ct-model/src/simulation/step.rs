//! What a step works with: registers, slopes at the stages, and what drives the model.

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
    /// The states at the end.
    pub next: Vec<T>,
    /// The slope at the beginning stands in the first stage.
    pub begun: bool,
    /// Guards that stay at zero.
    pub sliding: Sliding<T>,
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
        }
    }

    /// Computes slopes from what is loaded, and the differences of guards where states slide.
    pub fn evaluate_slopes(&mut self, tape: &Tape, drive: &Drive<'_, T>) {
        tape.evaluate_slopes(&mut self.registers);
        if !self.sliding.is_empty() {
            tape.evaluate_guards(&mut self.registers);
            self.sliding.mean_slopes(tape, &mut self.registers, drive);
        }
    }

    /// Guards that stay at zero answer for their sides again, whatever they answered by their differences.
    pub fn follow_sliding(&mut self, tape: &Tape) {
        self.sliding.follow(tape, &mut self.registers);
    }

    /// What follows a step: the slope at its end is that at the next one's beginning, where nothing jumps between.
    pub fn go_on(&mut self, smooth: bool) {
        let n = self.next.len();
        if smooth {
            self.slopes.copy_within((explicit::STAGES - 1) * n.., 0);
        }
        self.begun = smooth;
    }

    /// Keeps the derivative that the registers hold as that of a stage.
    pub fn keep_slope(&mut self, tape: &Tape, stage: usize) {
        let slopes = &mut self.slopes[stage * tape.states..];
        for (slope, &register) in slopes.iter_mut().zip(&tape.derivatives) {
            *slope = self.registers.values[register];
        }
    }
}

/// An interval between rows, and the inputs in it, each in a straight line.
#[derive(Clone, Copy)]
pub(super) struct Interval<'a> {
    pub begin: f64,
    pub length: f64,
    pub from: &'a [f64],
    /// Rise of each input per unit of time.
    pub rise: &'a [f64],
}

/// What drives the model over an interval: inputs, and what is delayed.
#[derive(Clone, Copy)]
pub(super) struct Drive<'a, T> {
    pub interval: Interval<'a>,
    pub delays: &'a Delays<T>,
}

impl<'a, T: Scalar> Drive<'a, T> {
    pub fn new(interval: Interval<'a>, delays: &'a Delays<T>) -> Self {
        Self { interval, delays }
    }

    /// Inputs that are held; `still`: a zero for each.
    pub fn held(inputs: &'a [f64], still: &'a [f64], delays: &'a Delays<T>) -> Self {
        let interval = Interval {
            begin: 0.0,
            length: 0.0,
            from: inputs,
            rise: still,
        };
        Self { interval, delays }
    }

    /// Writes time, inputs, states and delayed values into the registers; inputs that are held stand there.
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
        }
        let first = tape.state(0);
        values[first..first + x.len()].copy_from_slice(x);
        for i in 0..tape.delays.len() {
            values[tape.delayed(i)] = self.delays.at(i, time);
        }
    }
}
