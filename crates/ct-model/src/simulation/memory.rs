//! Initialisation at the first sample, and the memory of play and stick-slip operators from sample to sample.
//!
//! Within a sampling interval the output is computed from its value at the last sample. For a play this is exact if its input is held or
//! monotone in the interval, as every model input is. For stick-slip it is exact if the input is held; otherwise the output moves at most
//! once in an interval, and then follows its input to the next sample. Before the record, the output of a play is the input, that of
//! stick-slip is where its fourth argument says. A value that stays between two others begins at the first of them; inside an interval it is exact where both are monotone.

use super::SimulationState;
use super::delays::{Delay, Delays};
use super::drive::Drive;
use crate::scalar::Scalar;
use crate::tape::Tape;

impl<T: Scalar> SimulationState<T> {
    /// Sets the values before the record to those at its beginning: of delays, of play operators, and of states whose initial values depend
    /// on inputs or other states (`settled`).
    pub(super) fn before_the_record(&mut self, tape: &Tape) {
        // One of these values may depend on another one, so the evaluation is repeated.
        for _ in 0..=tape.delays.len() + tape.plays.len() + tape.settled.len() {
            tape.evaluate_with_guards(&mut self.work.registers);
            let values = &mut self.work.registers.values;
            for (i, &(what, _)) in tape.delays.iter().enumerate() {
                values[tape.delayed(i)] = values[what];
            }
            for play in &tape.plays {
                values[play.held] = values[play.from];
            }
            if !self.settled {
                for &i in &tape.settled {
                    values[tape.state(i)] = values[tape.starts[i]];
                }
            }
        }
        if !self.settled {
            for &i in &tape.settled {
                self.state[i] = self.work.registers.values[tape.state(i)];
                self.largest[i] = self.state[i].value().abs();
            }
            self.settled = true;
        }
    }

    /// Sets the initial values of play operators and of states whose initial values depend on inputs, from the inputs of the first sample.
    pub(super) fn settle(&mut self, tape: &Tape, inputs: &[f64], delays: &Delays<T>) {
        if self.settled || (tape.settled.is_empty() && tape.plays.is_empty()) {
            return;
        }
        let drive = Drive::held(inputs, &self.held, delays);
        self.work.load(tape, &drive, self.time, &self.state);
        self.before_the_record(tape);
    }

    /// Evaluates the outputs; an expression with a delay of zero takes its present value.
    pub(super) fn let_through(&mut self, tape: &Tape, delays: &Delays<T>) {
        tape.evaluate_with_guards(&mut self.work.registers);
        // A delay of an output has the present value already, with the derivative by the delay.
        let at_once = |delay: &Delay<T>| delay.by.value() == 0.0 && !delay.of_output;
        for _ in 0..delays.all.iter().filter(|delay| at_once(delay)).count() {
            let values = &mut self.work.registers.values;
            for (i, &(what, _)) in tape.delays.iter().enumerate() {
                if at_once(&delays.all[i]) {
                    values[tape.delayed(i)] = values[what];
                }
            }
            tape.evaluate_with_guards(&mut self.work.registers);
        }
    }

    /// Stores the outputs of the play operators at this sample as their new initial values.
    pub(super) fn remember(&mut self, tape: &Tape) {
        for play in &tape.plays {
            self.work.registers.values[play.held] = self.work.registers.values[play.to];
        }
    }
}
