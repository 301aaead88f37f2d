//! What the first row settles, and what plays remember from row to row.
//!
//! A play moves with what goes into it at a distance of at most its half-width. Within an interval between rows it starts from what it
//! gave at the row: exact where what goes in is held or runs in one direction, as every input does. It comes to rest in the middle before the record.

use super::SimulationState;
use super::delays::{Delay, Delays};
use super::step::Drive;
use crate::scalar::Scalar;
use crate::tape::Tape;

impl<T: Scalar> SimulationState<T> {
    /// Before the record everything was as at its beginning: what a delay lets through, what plays hold, and settled states, too.
    pub(super) fn before_the_record(&mut self, tape: &Tape) {
        // One may stand on what another one gives.
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

    /// Gives the settled states their initial values, and plays theirs, from the inputs of the first row.
    pub(super) fn settle(&mut self, tape: &Tape, inputs: &[f64], delays: &Delays<T>) {
        if self.settled || (tape.settled.is_empty() && tape.plays.is_empty()) {
            return;
        }
        let drive = Drive::held(inputs, &self.held, delays);
        drive.load(tape, &mut self.work, self.time, &self.state);
        self.before_the_record(tape);
    }

    /// Evaluates a reading: what is delayed by nothing is there at once.
    pub(super) fn let_through(&mut self, tape: &Tape, delays: &Delays<T>) {
        tape.evaluate_with_guards(&mut self.work.registers);
        let at_once = |delay: &Delay<T>| delay.by.value() == 0.0;
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

    /// Plays start anew from what they give at this row.
    pub(super) fn remember(&mut self, tape: &Tape) {
        for play in &tape.plays {
            self.work.registers.values[play.held] = self.work.registers.values[play.to];
        }
    }
}
