//! Selection of the operations that the present branches need: a tape has those of all branches, and a step runs only some of them.

use super::operation::{Operation, run};
use super::{Register, Registers, Tape};
use crate::scalar::Scalar;

/// The operations on the selected branches, with the registers of their results.
#[derive(Debug, Clone)]
pub(super) struct Selected {
    /// Whether the first value of each branch is selected.
    pub taken: Vec<bool>,
    /// The operations that slopes need, ...
    pub slopes: Vec<(Operation, Register)>,
    /// ... the operations whose results change although all inputs are held, ...
    pub moving: Vec<(Operation, Register)>,
    /// ... the operations that guards need in addition to the slopes, those that outputs need in addition to both, and all.
    pub guards: Vec<(Operation, Register)>,
    pub outputs: Vec<(Operation, Register)>,
    /// The operations that guards and outputs need and whose results change although all inputs are held.
    pub readings: Vec<(Operation, Register)>,
    pub all: Vec<(Operation, Register)>,
}

/// Number of selections that are kept besides the present one: five branches that switch have 32 combinations.
const EARLIER: usize = 31;

impl Selected {
    pub fn with_capacity(operations: usize) -> Self {
        let list = || Vec::with_capacity(operations);
        Self {
            taken: Vec::new(),
            slopes: list(),
            moving: list(),
            guards: list(),
            outputs: list(),
            readings: list(),
            all: list(),
        }
    }
}

impl Tape {
    /// Selects the operations that the present branches need.
    pub(super) fn choose_operations<T: Scalar>(&self, registers: &mut Registers<T>) {
        let Registers {
            taken,
            selected,
            earlier,
            plain,
            marks,
            ..
        } = registers;
        // The latest is the last.
        let known = earlier.iter().position(|known| known.taken == *taken);
        let next = match known {
            Some(known) => earlier.remove(known),
            None => {
                let mut next = if earlier.len() < EARLIER {
                    Selected::with_capacity(self.operations.len())
                } else {
                    earlier.remove(0)
                };
                self.select((taken, plain), marks, &mut next);
                next
            }
        };
        earlier.push(std::mem::replace(selected, next));
        if registers.held {
            for &(operation, to) in &registers.selected.slopes {
                if self.of_inputs[to] {
                    run(
                        &[(operation, to)],
                        &mut registers.values,
                        registers.extended,
                    );
                }
            }
        }
    }

    /// Leaves out the operations that only other branches need.
    pub(super) fn select(
        &self,
        (taken, plain): (&[bool], &[bool]),
        marks: &mut Vec<bool>,
        into: &mut Selected,
    ) {
        let Selected {
            taken: of,
            slopes,
            moving,
            guards,
            outputs,
            readings,
            all,
        } = into;
        of.clear();
        of.extend_from_slice(taken);
        self.needed(&self.derivatives, (taken, plain), marks, slopes);
        self.needed(&self.read_by_guards, (taken, plain), marks, guards);
        self.needed(&self.read_by_all, (taken, plain), marks, all);
        self.needed(&self.outputs, (taken, plain), marks, outputs);
        self.needed(&self.read_by_samples, (taken, plain), marks, readings);
        // An operation is listed once, with the first results that need it.
        marks.fill(false);
        slopes
            .iter()
            .for_each(|(_, to)| marks[to - self.first_operation] = true);
        for list in [guards, outputs] {
            list.retain(|(_, to)| !std::mem::replace(&mut marks[to - self.first_operation], true));
        }
        readings.retain(|(_, to)| !self.of_inputs[*to]);
        moving.clear();
        moving.extend(slopes.iter().filter(|(_, to)| !self.of_inputs[*to]));
    }

    /// The operations that the results depend on, in order; an operation that reads a choice reads the selected register.
    fn needed(
        &self,
        results: &[Register],
        (taken, plain): (&[bool], &[bool]),
        needed: &mut Vec<bool>,
        into: &mut Vec<(Operation, Register)>,
    ) {
        let first = self.first_operation;
        let chosen = |mut register: Register| {
            while let Some(i) = register.checked_sub(first)
                && let Operation::Select(branch, a, b) = self.operations[i]
            {
                register = if taken[branch] { a } else { b };
            }
            register
        };
        needed.clear();
        needed.resize(self.operations.len(), false);
        for result in results {
            if let Some(i) = result.checked_sub(first) {
                needed[i] = true;
            }
        }
        into.clear();
        for i in (self.once..self.operations.len()).rev() {
            if !needed[i] {
                continue;
            }
            let operation = match self.operations[i] {
                Operation::Select(..) => Operation::Copy(chosen(first + i)),
                other => match other.with(chosen) {
                    Operation::Multiply(a, b) if plain[b] => Operation::Scale(a, b),
                    Operation::Multiply(a, b) if plain[a] => Operation::Scale(b, a),
                    other => other,
                },
            };
            for register in operation.reads().into_iter().flatten() {
                if let Some(i) = register.checked_sub(first) {
                    needed[i] = true;
                }
            }
            into.push((operation, first + i));
        }
        into.reverse();
    }
}
