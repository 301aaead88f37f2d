//! A model compiled into a list of operations on numbers, which the simulation runs.
//!
//! Every subexpression is one operation, the same one is computed once, and what parameters alone define is computed once per simulation.
//!
//! **Branches.** A comparison, and what is one (`min`, `max`, `abs`, `sign`), is a [`Guard`]: the sign of a difference. Its answer is not
//! found while the operations run but given to them, so that right-hand sides are smooth within a step; the simulation looks after each
//! step whether a guard has changed its sign, and goes on from there with the other answer.

mod compile;
mod guard;
mod operation;
mod selection;

use self::guard::Branch;
pub(crate) use self::guard::Guard;
use self::operation::{Operation, run};
use self::selection::Selected;
use crate::scalar::Scalar;

/// Index of a value in the registers.
pub(crate) type Register = usize;

/// The operations of a model.
///
/// Registers: the time, parameters, inputs, states, delayed values, numbers of the text, then one for each operation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tape {
    pub parameters: usize,
    pub inputs: usize,
    pub states: usize,
    constants: Vec<f64>,
    operations: Vec<Operation>,
    /// Number of operations at the beginning that depend on parameters alone.
    once: usize,
    branches: Vec<Branch>,
    pub guards: Vec<Guard>,
    /// The derivative of each state.
    pub derivatives: Vec<Register>,
    /// Register of each output.
    pub outputs: Vec<Register>,
    /// The initial value of each state as written in the text.
    pub starts: Vec<Register>,
    /// Delayed signals and their dead times.
    pub delays: Vec<(Register, Register)>,
    pub plays: Vec<Play>,
    /// States whose initial value is that of their start at the first row.
    pub settled: Vec<usize>,
    /// Whether an operation reads the time.
    pub reads_time: bool,
    /// Registers that guards read.
    read_by_guards: Vec<Register>,
    /// Registers that guards and outputs read.
    read_by_samples: Vec<Register>,
    /// Registers that are made of parameters and inputs alone.
    pub of_inputs: Vec<bool>,
    /// Registers that any operation reads.
    read_by_all: Vec<Register>,
    first_delayed: Register,
    first_constant: Register,
    first_operation: Register,
}

/// A function with memory, such as a backlash `min(max(held, x - b), x + b)`, where `held` is its output at the last row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Play {
    /// Register of the delay's input.
    pub from: Register,
    pub held: Register,
    /// Register of the delay's output.
    pub to: Register,
}

/// Registers of a tape, with their values.
#[derive(Debug, Clone)]
pub(crate) struct Registers<T> {
    pub values: Vec<T>,
    /// Answers of the guards.
    pub answers: Vec<bool>,
    taken: Vec<bool>,
    /// For the present branches, ...
    selected: Selected,
    /// ... and for earlier ones, which come again: a state that moves to and fro across a limit.
    earlier: Vec<Selected>,
    /// Values without derivatives: parameters, constants of the text, and expressions of these.
    plain: Vec<bool>,
    /// Marks of operations, for the work of a selection.
    marks: Vec<bool>,
    /// All inputs are held, and the results that depend on inputs and parameters only are computed.
    pub held: bool,
    /// Roots, powers and logarithms of invalid arguments are zero: they occur only on a branch that ends the step.
    pub extended: bool,
}

impl<T: Clone> Registers<T> {
    /// The registers with the present selection alone.
    pub fn copied(&self) -> Self {
        Self {
            values: self.values.clone(),
            answers: self.answers.clone(),
            taken: self.taken.clone(),
            selected: self.selected.clone(),
            earlier: Vec::new(),
            plain: self.plain.clone(),
            marks: Vec::new(),
            held: self.held,
            extended: self.extended,
        }
    }
}

impl Tape {
    pub fn registers<T: Scalar>(&self, parameters: &[T]) -> Registers<T> {
        let zero = T::constant(0.0);
        let mut values = vec![zero; self.first_operation + self.operations.len()];
        values[1..=self.parameters].copy_from_slice(parameters);
        for (value, constant) in values[self.first_constant..]
            .iter_mut()
            .zip(&self.constants)
        {
            *value = T::constant(*constant);
        }
        let once = self.operations[..self.once].iter().copied();
        let once = once.zip(self.first_operation..);
        for (operation, to) in once {
            run(&[(operation, to)], &mut values, false);
        }
        let answers = vec![false; self.guards.len()];
        let taken = self.branches.iter().map(|branch| branch.holds(&answers));
        let mut registers = Registers {
            values,
            taken: taken.collect(),
            answers,
            selected: Selected::with_capacity(self.operations.len()),
            earlier: Vec::new(),
            plain: Vec::new(),
            marks: Vec::with_capacity(self.operations.len()),
            held: false,
            extended: false,
        };
        let numbers =
            (1..=self.parameters).chain(self.first_constant..self.first_operation + self.once);
        registers.plain = vec![false; registers.values.len()];
        for register in numbers {
            registers.plain[register] = registers.values[register].same_derivatives(zero);
        }
        self.select(
            (&registers.taken, &registers.plain),
            &mut registers.marks,
            &mut registers.selected,
        );
        registers
    }

    /// Finds which registers are read, after all operations have their final order.
    fn note_results(&mut self) {
        let guards = self.guards.iter().map(|guard| guard.difference);
        self.read_by_guards = guards.collect();
        let outputs = self.outputs.iter().copied();
        self.read_by_samples = self.read_by_guards.iter().copied().chain(outputs).collect();
        let delays = self.delays.iter().flat_map(|&(what, by)| [what, by]);
        let plays = self.plays.iter().flat_map(|play| [play.from, play.to]);
        let all = self.derivatives.iter().chain(&self.read_by_guards);
        let all = all.chain(&self.outputs).chain(&self.starts).copied();
        self.read_by_all = all.chain(delays).chain(plays).collect();
        let operations = self.operations.iter();
        let mut read = operations.flat_map(|o| o.reads().into_iter().flatten());
        self.reads_time = read.any(|register| register == 0)
            || self.read_by_all.contains(&0)
            || !self.delays.is_empty();
        let moving = self.state(0)..self.first_constant;
        self.of_inputs = self.made_of(|register| register != 0 && !moving.contains(&register));
    }

    /// For each delay, whether its signal depends on inputs, parameters and time alone.
    pub fn known_ahead(&self) -> Vec<bool> {
        let by_states = self.state(0)..self.first_constant;
        let known = self.made_of(|register| !by_states.contains(&register));
        self.delays.iter().map(|&(what, _)| known[what]).collect()
    }

    /// For each delay, whether outputs alone read it, and its signal is smooth between the rows: made of states, parameters and time, with
    /// branches that parameters alone decide.
    pub fn delays_of_outputs(&self) -> Vec<bool> {
        // Every simulation asks, and few models delay anything.
        if self.delays.is_empty() {
            return Vec::new();
        }
        let stored = self.first_delayed..self.first_constant;
        let inputs = self.input(0)..self.state(0);
        let by_parameters = |&branch: &usize| {
            let mut all = true;
            self.branches[branch].each_guard(&mut |guard| {
                let register = self.guards[guard].difference;
                let once = self.first_operation + self.once;
                all &= (1..=self.parameters).contains(&register)
                    || (self.first_constant..once).contains(&register);
            });
            all
        };
        let smooth = self.made_without(
            |register| !stored.contains(&register) && !inputs.contains(&register),
            |operation| matches!(operation, Operation::Select(branch, ..) if !by_parameters(branch)),
        );
        let plays = self.plays.iter().flat_map(|play| [play.from, play.to]);
        let inner = self.delays.iter().flat_map(|&(what, by)| [what, by]);
        let read = self.derivatives.iter().chain(&self.read_by_guards).copied();
        let read: Vec<Register> = read.chain(plays).chain(inner).collect();
        let is_of_output = |(i, &(what, _)): (usize, &(Register, Register))| {
            let delayed = self.delayed(i);
            // Whichever branches are taken.
            let without = self.made_without(|register| register != delayed, |_| false);
            smooth[what] && read.iter().all(|&register| without[register])
        };
        self.delays.iter().enumerate().map(is_of_output).collect()
    }

    /// Registers that depend on these variables alone, for every choice of branches.
    fn made_of(&self, these: impl Fn(Register) -> bool) -> Vec<bool> {
        let selects = |operation: &Operation| matches!(operation, Operation::Select(..));
        self.made_without(these, selects)
    }

    /// Registers that depend on these variables alone, conditions aside, and on no operation that is left out.
    fn made_without(
        &self,
        these: impl Fn(Register) -> bool,
        left_out: impl Fn(&Operation) -> bool,
    ) -> Vec<bool> {
        let mut made: Vec<bool> = (0..self.first_operation + self.operations.len())
            .map(these)
            .collect();
        for (i, operation) in self.operations.iter().enumerate() {
            let reads = operation.reads().into_iter().flatten();
            made[self.first_operation + i] =
                reads.into_iter().all(|register| made[register]) && !left_out(operation);
        }
        made
    }

    /// Register of an input.
    pub fn input(&self, i: usize) -> Register {
        1 + self.parameters + i
    }

    /// Register of a state.
    pub fn state(&self, i: usize) -> Register {
        1 + self.parameters + self.inputs + i
    }

    /// Register of a delayed value.
    pub fn delayed(&self, i: usize) -> Register {
        self.first_delayed + i
    }

    /// Computes all registers from the time, inputs, states and delayed values, with the stored answers of the guards.
    pub fn evaluate<T: Scalar>(&self, registers: &mut Registers<T>) {
        run(
            &registers.selected.all,
            &mut registers.values,
            registers.extended,
        );
    }

    /// Evaluates the slopes of the states alone.
    pub fn evaluate_slopes<T: Scalar>(&self, registers: &mut Registers<T>) {
        let operations = if registers.held {
            &registers.selected.moving
        } else {
            &registers.selected.slopes
        };
        run(operations, &mut registers.values, registers.extended);
    }

    /// The differences of guards, where the slopes have been computed.
    pub fn evaluate_guards<T: Scalar>(&self, registers: &mut Registers<T>) {
        run(
            &registers.selected.guards,
            &mut registers.values,
            registers.extended,
        );
    }

    /// The outputs, where slopes and guards have been computed.
    pub fn evaluate_outputs<T: Scalar>(&self, registers: &mut Registers<T>) {
        run(
            &registers.selected.outputs,
            &mut registers.values,
            registers.extended,
        );
    }

    /// The differences of guards and the outputs, where the inputs are held.
    pub fn evaluate_readings<T: Scalar>(&self, registers: &mut Registers<T>) {
        run(
            &registers.selected.readings,
            &mut registers.values,
            registers.extended,
        );
    }

    /// Whether the answer of a guard is no longer that of its difference, or the difference has no value.
    pub fn is_any_changed<T: Scalar>(&self, registers: &Registers<T>) -> bool {
        let mut guards = self.guards.iter().zip(&registers.answers);
        guards.any(|(guard, &answer)| {
            let difference = registers.values[guard.difference].value();
            difference.is_nan() || guard.holds(difference) != answer
        })
    }

    /// Evaluates the tape with the branch of every guard chosen by its present difference.
    pub fn evaluate_with_guards<T: Scalar>(&self, registers: &mut Registers<T>) {
        // A guard may depend on the answer of another guard: after as many rounds as there are guards, no answer changes.
        for _ in 0..=self.guards.len() {
            self.evaluate(registers);
            let mut changed = false;
            for (guard, answer) in self.guards.iter().zip(&mut registers.answers) {
                let now = guard.holds(registers.values[guard.difference].value());
                changed |= now != *answer;
                *answer = now;
            }
            self.answers_changed(registers);
            if !changed {
                break;
            }
        }
    }

    /// Updates the branches after a change of answers.
    pub fn answers_changed<T: Scalar>(&self, registers: &mut Registers<T>) {
        let mut changed = false;
        for (branch, taken) in self.branches.iter().zip(&mut registers.taken) {
            let now = branch.holds(&registers.answers);
            changed |= now != *taken;
            *taken = now;
        }
        if changed {
            self.choose_operations(registers);
        }
    }

    /// Sets the answers of the guards on this difference to those for one sign.
    pub fn answer<T: Scalar>(
        &self,
        registers: &mut Registers<T>,
        difference: Register,
        positive: bool,
    ) {
        let side = if positive { 1.0 } else { -1.0 };
        for (guard, answer) in self.guards.iter().zip(&mut registers.answers) {
            if guard.difference == difference {
                *answer = guard.holds(side);
            }
        }
        self.answers_changed(registers);
    }

    /// If a difference is a state plus or minus a constant: the state and its sign.
    pub fn state_of(&self, difference: Register) -> Option<(usize, f64)> {
        let states = self.state(0)..self.state(self.states);
        let state = |register: Register| {
            let known = states.contains(&register);
            known.then(|| register - states.start)
        };
        let is_number = |register: Register| {
            let once = self.first_operation..self.first_operation + self.once;
            let numbers = self.first_constant..self.first_operation;
            let parameters = 1..self.input(0);
            [once, numbers, parameters]
                .iter()
                .any(|of| of.contains(&register))
        };
        match self
            .operations
            .get(difference.checked_sub(self.first_operation)?)?
        {
            Operation::Subtract(a, b) if is_number(*b) => Some((state(*a)?, 1.0)),
            Operation::Subtract(a, b) if is_number(*a) => Some((state(*b)?, -1.0)),
            _ => None,
        }
    }

    /// Copies the answers of the guards from other registers.
    pub fn copy_answers<T: Scalar, S>(&self, from: &Registers<S>, to: &mut Registers<T>) {
        to.answers.copy_from_slice(&from.answers);
        self.answers_changed(to);
    }
}
