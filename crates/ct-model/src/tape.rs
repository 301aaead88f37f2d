//! A model compiled into a list of operations on numbers, which is what simulates.
//!
//! Every subexpression is one operation, the same one is computed once, and what parameters alone define is computed once per simulation.
//!
//! **Branches.** A comparison, and what is one (`min`, `max`, `abs`, `sign`), is a [`Guard`]: the sign of a difference. Its answer is not
//! found while the operations run but given to them, so that right-hand sides are smooth within a step; the simulation looks after each
//! step whether a guard has changed its sign, and goes on from there with the other answer.

use std::cell::Cell;
use std::collections::HashMap;

use crate::expression::{
    Comparison, Condition, Expression, Function, Operator, Variable, quantised,
};
use crate::scalar::Scalar;
use crate::spec::ModelSpec;

/// Where a number stands.
pub(crate) type Register = usize;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Operation {
    Negative(Register),
    Add(Register, Register),
    Subtract(Register, Register),
    Multiply(Register, Register),
    Divide(Register, Register),
    /// Times a number without derivatives.
    Scale(Register, Register),
    /// One by it.
    Reciprocal(Register),
    Power(Register, Register),
    /// To a whole number.
    WholePower(Register, i32),
    Sqrt(Register),
    Exp(Register),
    Log(Register),
    Log10(Register),
    Sin(Register),
    Cos(Register),
    Tan(Register),
    Tanh(Register),
    Atan2(Register, Register),
    Quantise(Register, Register),
    /// One of two, by a condition.
    Select(usize, Register, Register),
    /// The one that a condition has chosen.
    Copy(Register),
}

/// A difference whose sign decides on a branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Guard {
    /// The difference.
    pub difference: Register,
    comparison: Comparison,
}

impl Guard {
    /// Its answer where the difference has this value.
    pub fn holds(self, difference: f64) -> bool {
        match self.comparison {
            Comparison::Less => difference < 0.0,
            Comparison::LessOrEqual => difference <= 0.0,
            Comparison::Greater => difference > 0.0,
            Comparison::GreaterOrEqual => difference >= 0.0,
            Comparison::Equal => difference == 0.0,
            Comparison::NotEqual => difference != 0.0,
        }
    }

    /// Whether the difference has left the side for which the answer was given.
    pub fn is_crossed(self, answer: bool, difference: f64) -> bool {
        let positive = match self.comparison {
            Comparison::Less | Comparison::LessOrEqual => !answer,
            Comparison::Greater | Comparison::GreaterOrEqual => answer,
            // Two numbers that change with time are equal at an instant alone.
            Comparison::Equal | Comparison::NotEqual => return false,
        };
        if positive {
            difference < 0.0
        } else {
            difference > 0.0
        }
    }
}

/// When a branch is taken, over the answers of guards.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Branch {
    Constant(bool),
    Guard(usize),
    Not(Box<Branch>),
    And(Box<Branch>, Box<Branch>),
    Or(Box<Branch>, Box<Branch>),
}

impl Branch {
    fn holds(&self, answers: &[bool]) -> bool {
        match self {
            Self::Constant(value) => *value,
            Self::Guard(guard) => answers[*guard],
            Self::Not(a) => !a.holds(answers),
            Self::And(a, b) => a.holds(answers) && b.holds(answers),
            Self::Or(a, b) => a.holds(answers) || b.holds(answers),
        }
    }
}

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
    /// So many of the first operations need parameters alone.
    once: usize,
    branches: Vec<Branch>,
    pub guards: Vec<Guard>,
    /// The derivative of each state.
    pub derivatives: Vec<Register>,
    /// Each output.
    pub outputs: Vec<Register>,
    /// The initial value of each state as the text has it.
    pub starts: Vec<Register>,
    /// What is delayed, and by how much.
    pub delays: Vec<(Register, Register)>,
    pub plays: Vec<Play>,
    /// States whose initial value is that of their start at the first row.
    pub settled: Vec<usize>,
    /// Something reads the time.
    pub reads_time: bool,
    /// What guards read.
    read_by_guards: Vec<Register>,
    /// Registers that are made of parameters and inputs alone.
    pub of_inputs: Vec<bool>,
    /// What anything reads.
    read_by_all: Vec<Register>,
    first_delayed: Register,
    first_constant: Register,
    first_operation: Register,
}

/// A play: `min(max(held, x - b), x + b)`, where `held` is what it gave at the last row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Play {
    /// What goes in.
    pub from: Register,
    pub held: Register,
    /// What it gives.
    pub to: Register,
}

/// What a tape computes with.
#[derive(Debug, Clone)]
pub(crate) struct Registers<T> {
    pub values: Vec<T>,
    /// The answers of the guards.
    pub answers: Vec<bool>,
    taken: Vec<bool>,
    /// The operations, and where their results go, that the taken branches leave: those that slopes need, ...
    slopes: Vec<(Operation, Register)>,
    /// ... of these what moves where all inputs are held, ...
    moving: Vec<(Operation, Register)>,
    /// ... what guards need beside the slopes, what outputs need beside both, and all.
    guards: Vec<(Operation, Register)>,
    outputs: Vec<(Operation, Register)>,
    all: Vec<(Operation, Register)>,
    /// Numbers that have no derivatives: parameters, numbers of the text, and what is made of them.
    plain: Vec<bool>,
    /// All inputs are held, and what is made of them and of parameters stands computed.
    pub held: bool,
    /// Roots, powers and logarithms that have no value are zero: beyond a branch that a step has to end at.
    pub extended: bool,
}

struct Compiler<'a> {
    spec: &'a ModelSpec,
    constants: Vec<f64>,
    operations: Vec<Operation>,
    known: HashMap<Operation, Register>,
    branches: Vec<Branch>,
    guards: Vec<Guard>,
    flows: Vec<Option<Register>>,
    delays: Vec<(Register, Register)>,
    delayed: HashMap<(Register, Register), Register>,
    plays: Vec<Play>,
    first_play: Register,
    first_delayed: Register,
    first_constant: Register,
    first_operation: Register,
}

impl Tape {
    pub fn compile(spec: &ModelSpec) -> Self {
        // How many numbers and delays there are decides where registers stand: counted first.
        let (numbers, delays, plays) = (Cell::new(1), Cell::new(0), Cell::new(0));
        let starts = spec.states.iter().map(|state| &state.start);
        for expression in spec.expressions().chain(starts) {
            expression.any(&|part| {
                match part {
                    Expression::Number(_) => numbers.set(numbers.get() + 1),
                    Expression::Call(Function::Sign | Function::Abs, _) => {
                        numbers.set(numbers.get() + 2);
                    }
                    Expression::Call(Function::Play, _) => plays.set(plays.get() + 1),
                    Expression::Delay(..) => delays.set(delays.get() + 1),
                    _ => {}
                }
                false
            });
        }
        let (numbers, delays, plays) = (numbers.get(), delays.get(), plays.get());
        let first_delayed = 1 + spec.parameters.len() + spec.inputs.len() + spec.states.len();
        let mut compiler = Compiler {
            spec,
            constants: Vec::new(),
            operations: Vec::new(),
            known: HashMap::new(),
            branches: Vec::new(),
            guards: Vec::new(),
            flows: vec![None; spec.flows.len()],
            delays: Vec::new(),
            delayed: HashMap::new(),
            plays: Vec::new(),
            first_play: first_delayed + delays,
            first_delayed,
            first_constant: first_delayed + delays + plays,
            first_operation: first_delayed + delays + plays + numbers,
        };
        for &flow in &spec.order {
            let register = compiler.expression(&spec.flows[flow].value);
            compiler.flows[flow] = Some(register);
        }
        let derivatives = spec.states.iter().map(|state| {
            let right = compiler.expression(&state.right);
            match &state.coefficient {
                None => right,
                Some(coefficient) => {
                    let coefficient = compiler.expression(coefficient);
                    compiler.divided(right, coefficient)
                }
            }
        });
        let derivatives = derivatives.collect();
        let outputs = spec.outputs.iter();
        let outputs = outputs
            .map(|output| compiler.variable(output.variable))
            .collect();
        let starts = spec.states.iter();
        let starts = starts
            .map(|state| compiler.expression(&state.start))
            .collect();
        let mut tape = Self {
            parameters: spec.parameters.len(),
            inputs: spec.inputs.len(),
            states: spec.states.len(),
            constants: compiler.constants,
            operations: compiler.operations,
            once: 0,
            branches: compiler.branches,
            guards: compiler.guards,
            derivatives,
            outputs,
            starts,
            delays: compiler.delays,
            plays: compiler.plays,
            settled: (0..spec.states.len())
                .filter(|&i| spec.is_settled(i))
                .collect(),
            reads_time: false,
            read_by_guards: Vec::new(),
            of_inputs: Vec::new(),
            read_by_all: Vec::new(),
            first_delayed,
            first_constant: compiler.first_constant,
            first_operation: compiler.first_operation,
        };
        tape.parameters_first();
        tape.note_results();
        tape
    }

    /// Moves what parameters alone define to the front.
    fn parameters_first(&mut self) {
        let fixed_inputs = |register: Register| {
            (1..=self.parameters).contains(&register)
                || (self.first_constant..self.first_operation).contains(&register)
        };
        let mut fixed = vec![false; self.operations.len()];
        for (i, operation) in self.operations.iter().enumerate() {
            let all = !matches!(operation, Operation::Select(..));
            fixed[i] = all
                && operation.reads().into_iter().flatten().all(|register| {
                    fixed_inputs(register)
                        || register
                            .checked_sub(self.first_operation)
                            .is_some_and(|before| fixed[before])
                });
        }
        let mut order: Vec<usize> = (0..self.operations.len()).collect();
        order.sort_by_key(|&i| !fixed[i]);
        self.once = fixed.iter().filter(|fixed| **fixed).count();
        let mut place = vec![0; order.len()];
        for (new, &old) in order.iter().enumerate() {
            place[old] = new;
        }
        let first = self.first_operation;
        let moved = |register: Register| match register.checked_sub(first) {
            Some(old) => first + place[old],
            None => register,
        };
        self.operations = order
            .iter()
            .map(|&old| self.operations[old].with(moved))
            .collect();
        let registers = self.derivatives.iter_mut().chain(&mut self.outputs);
        for register in registers.chain(&mut self.starts) {
            *register = moved(*register);
        }
        for guard in &mut self.guards {
            guard.difference = moved(guard.difference);
        }
        for (what, by) in &mut self.delays {
            (*what, *by) = (moved(*what), moved(*by));
        }
        for play in &mut self.plays {
            (play.from, play.to) = (moved(play.from), moved(play.to));
        }
    }

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
            values[to] = operation.result(&values, false);
        }
        let answers = vec![false; self.guards.len()];
        let taken = self.branches.iter().map(|branch| branch.holds(&answers));
        let mut registers = Registers {
            values,
            taken: taken.collect(),
            answers,
            slopes: Vec::with_capacity(self.operations.len()),
            moving: Vec::with_capacity(self.operations.len()),
            guards: Vec::with_capacity(self.operations.len()),
            outputs: Vec::with_capacity(self.operations.len()),
            plain: Vec::new(),
            held: false,
            all: Vec::with_capacity(self.operations.len()),
            extended: false,
        };
        let numbers =
            (1..=self.parameters).chain(self.first_constant..self.first_operation + self.once);
        registers.plain = vec![false; registers.values.len()];
        for register in numbers {
            registers.plain[register] = registers.values[register].same_derivatives(zero);
        }
        self.choose_operations(&mut registers);
        registers
    }

    /// Which registers are read once everything has its place.
    fn note_results(&mut self) {
        let guards = self.guards.iter().map(|guard| guard.difference);
        self.read_by_guards = guards.collect();
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

    /// Leaves out what only branches need that are not taken.
    fn choose_operations<T: Scalar>(&self, registers: &mut Registers<T>) {
        let Registers {
            taken,
            slopes,
            moving,
            guards,
            outputs,
            all,
            plain,
            ..
        } = registers;
        self.needed(&self.derivatives, (taken, plain), slopes);
        self.needed(&self.read_by_guards, (taken, plain), guards);
        self.needed(&self.read_by_all, (taken, plain), all);
        guards.retain(|guard| !slopes.contains(guard));
        self.needed(&self.outputs, (taken, plain), outputs);
        outputs.retain(|output| !slopes.contains(output) && !guards.contains(output));
        moving.clear();
        moving.extend(slopes.iter().filter(|(_, to)| !self.of_inputs[*to]));
        if registers.held {
            for &(operation, to) in registers
                .slopes
                .iter()
                .filter(|(_, to)| self.of_inputs[*to])
            {
                registers.values[to] = operation.result(&registers.values, registers.extended);
            }
        }
    }

    /// The operations that results need, in order; what reads a choice reads the one that is chosen.
    fn needed(
        &self,
        results: &[Register],
        (taken, plain): (&[bool], &[bool]),
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
        let mut needed = vec![false; self.operations.len()];
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

    /// Of each delay, whether what is delayed is made of inputs, parameters and the time alone.
    pub fn known_ahead(&self) -> Vec<bool> {
        let by_states = self.state(0)..self.first_constant;
        let known = self.made_of(|register| !by_states.contains(&register));
        self.delays.iter().map(|&(what, _)| known[what]).collect()
    }

    /// Which registers are made of these alone, whatever branches are taken.
    fn made_of(&self, these: impl Fn(Register) -> bool) -> Vec<bool> {
        let mut made: Vec<bool> = (0..self.first_operation + self.operations.len())
            .map(these)
            .collect();
        for (i, operation) in self.operations.iter().enumerate() {
            let reads = operation.reads().into_iter().flatten();
            made[self.first_operation + i] = reads.into_iter().all(|register| made[register])
                && !matches!(operation, Operation::Select(..));
        }
        made
    }

    /// Where inputs stand.
    pub fn input(&self, i: usize) -> Register {
        1 + self.parameters + i
    }

    /// Where states stand.
    pub fn state(&self, i: usize) -> Register {
        1 + self.parameters + self.inputs + i
    }

    /// Where delayed values stand.
    pub fn delayed(&self, i: usize) -> Register {
        self.first_delayed + i
    }

    /// Computes everything from the time, inputs, states and delayed values, with the answers of the guards that the registers hold.
    pub fn evaluate<T: Scalar>(&self, registers: &mut Registers<T>) {
        run(&registers.all, &mut registers.values, registers.extended);
    }

    /// The same for the slopes of the states alone.
    pub fn evaluate_slopes<T: Scalar>(&self, registers: &mut Registers<T>) {
        let operations = if registers.held {
            &registers.moving
        } else {
            &registers.slopes
        };
        run(operations, &mut registers.values, registers.extended);
    }

    /// The differences of guards, where the slopes have been computed.
    pub fn evaluate_guards<T: Scalar>(&self, registers: &mut Registers<T>) {
        run(&registers.guards, &mut registers.values, registers.extended);
    }

    /// The outputs, where slopes and guards have been computed.
    pub fn evaluate_outputs<T: Scalar>(&self, registers: &mut Registers<T>) {
        run(
            &registers.outputs,
            &mut registers.values,
            registers.extended,
        );
    }

    /// The same, where every guard answers by its difference.
    pub fn evaluate_with_guards<T: Scalar>(&self, registers: &mut Registers<T>) {
        // A guard may stand on what another one decides: after as many rounds as there are guards none changes any more.
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

    /// Has the branches follow the answers.
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

    /// Has the guards that stand on a difference answer for one of its sides.
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

    /// The state that a difference is, less or from a number, and its sign.
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

    /// Takes over the answers of other registers.
    pub fn copy_answers<T: Scalar, S>(&self, from: &Registers<S>, to: &mut Registers<T>) {
        to.answers.copy_from_slice(&from.answers);
        self.answers_changed(to);
    }
}

/// `f(a)` of this value and slope. Where the slope is infinite, as that of a root at zero, it is left out: there a limit holds the argument.
fn slope<T: Scalar>(a: T, value: f64, slope: f64) -> T {
    T::with_slopes(value, [(a, if slope.is_infinite() { 0.0 } else { slope })])
}

fn power<T: Scalar>(a: T, b: T) -> T {
    let (x, n) = (a.value(), b.value());
    let value = x.powf(n);
    let finite = |slope: f64| if slope.is_finite() { slope } else { 0.0 };
    // Below zero only whole powers are numbers, and these do not change.
    let by_power = if x > 0.0 { value * x.ln() } else { 0.0 };
    T::with_slopes(value, [(a, finite(n * x.powf(n - 1.0))), (b, by_power)])
}

/// Computes operations in order.
#[inline]
fn run<T: Scalar>(operations: &[(Operation, Register)], values: &mut [T], extended: bool) {
    for &(operation, to) in operations {
        values[to] = operation.result(values, extended);
    }
}

fn whole_power<T: Scalar>(a: T, n: i32) -> T {
    let x = a.value();
    if (2..=4).contains(&n) {
        let before = match n {
            2 => x,
            3 => x * x,
            _ => x * x * x,
        };
        return slope(a, before * x, f64::from(n) * before);
    }
    slope(a, x.powi(n), f64::from(n) * x.powi(n - 1))
}

impl Operation {
    /// Its result. `extended`: roots, powers and logarithms of what is negative are zero.
    #[inline(always)]
    fn result<T: Scalar>(self, values: &[T], extended: bool) -> T {
        let no_value = |x: f64| extended && x < 0.0;
        match self {
            Self::Negative(a) => -values[a],
            Self::Add(a, b) => values[a] + values[b],
            Self::Subtract(a, b) => values[a] - values[b],
            Self::Multiply(a, b) => values[a] * values[b],
            Self::Divide(a, b) => values[a] / values[b],
            Self::Scale(a, b) => values[a] * values[b].value(),
            Self::Reciprocal(a) => T::constant(1.0) / values[a],
            Self::Power(a, _) | Self::Sqrt(a) | Self::Log(a) if no_value(values[a].value()) => {
                T::constant(0.0)
            }
            Self::Power(a, b) => power(values[a], values[b]),
            Self::WholePower(a, n) => whole_power(values[a], n),
            Self::Sqrt(a) => {
                let root = values[a].value().sqrt();
                slope(values[a], root, 0.5 / root)
            }
            Self::Exp(a) => values[a].exp(),
            Self::Log(a) => {
                let x = values[a].value();
                slope(values[a], x.ln(), 1.0 / x)
            }
            Self::Log10(a) => {
                let x = values[a].value();
                slope(values[a], x.log10(), std::f64::consts::LOG10_E / x)
            }
            Self::Sin(a) => values[a].sin_cos().0,
            Self::Cos(a) => values[a].sin_cos().1,
            Self::Tan(a) => {
                let tan = values[a].value().tan();
                slope(values[a], tan, 1.0 + tan * tan)
            }
            Self::Tanh(a) => {
                let tanh = values[a].value().tanh();
                slope(values[a], tanh, 1.0 - tanh * tanh)
            }
            Self::Atan2(a, b) => {
                let (y, x) = (values[a].value(), values[b].value());
                let square = x * x + y * y;
                let of = [(values[a], x / square), (values[b], -y / square)];
                T::with_slopes(y.atan2(x), of)
            }
            Self::Quantise(a, b) => {
                // What is rounded rises as what goes in, on the whole; its steps have no derivative.
                let value = quantised(values[a].value(), values[b].value());
                slope(values[a], value, 1.0)
            }
            Self::Copy(a) => values[a],
            // Which of the two is decided before it is computed.
            Self::Select(_, a, _) => values[a],
        }
    }

    /// The registers that it reads, guards aside.
    fn reads(self) -> [Option<Register>; 2] {
        match self {
            Self::Add(a, b)
            | Self::Subtract(a, b)
            | Self::Multiply(a, b)
            | Self::Divide(a, b)
            | Self::Scale(a, b)
            | Self::Power(a, b)
            | Self::Atan2(a, b)
            | Self::Quantise(a, b)
            | Self::Select(_, a, b) => [Some(a), Some(b)],
            Self::Negative(a)
            | Self::Reciprocal(a)
            | Self::WholePower(a, _)
            | Self::Sqrt(a)
            | Self::Exp(a)
            | Self::Log(a)
            | Self::Log10(a)
            | Self::Sin(a)
            | Self::Cos(a)
            | Self::Tan(a)
            | Self::Tanh(a)
            | Self::Copy(a) => [Some(a), None],
        }
    }

    /// The same with its registers moved.
    fn with(self, moved: impl Fn(Register) -> Register) -> Self {
        match self {
            Self::Negative(a) => Self::Negative(moved(a)),
            Self::Add(a, b) => Self::Add(moved(a), moved(b)),
            Self::Subtract(a, b) => Self::Subtract(moved(a), moved(b)),
            Self::Multiply(a, b) => Self::Multiply(moved(a), moved(b)),
            Self::Divide(a, b) => Self::Divide(moved(a), moved(b)),
            Self::Scale(a, b) => Self::Scale(moved(a), moved(b)),
            Self::Reciprocal(a) => Self::Reciprocal(moved(a)),
            Self::Power(a, b) => Self::Power(moved(a), moved(b)),
            Self::WholePower(a, n) => Self::WholePower(moved(a), n),
            Self::Sqrt(a) => Self::Sqrt(moved(a)),
            Self::Exp(a) => Self::Exp(moved(a)),
            Self::Log(a) => Self::Log(moved(a)),
            Self::Log10(a) => Self::Log10(moved(a)),
            Self::Sin(a) => Self::Sin(moved(a)),
            Self::Cos(a) => Self::Cos(moved(a)),
            Self::Tan(a) => Self::Tan(moved(a)),
            Self::Tanh(a) => Self::Tanh(moved(a)),
            Self::Atan2(a, b) => Self::Atan2(moved(a), moved(b)),
            Self::Quantise(a, b) => Self::Quantise(moved(a), moved(b)),
            Self::Select(branch, a, b) => Self::Select(branch, moved(a), moved(b)),
            Self::Copy(a) => Self::Copy(moved(a)),
        }
    }
}

impl Compiler<'_> {
    fn variable(&mut self, variable: Variable) -> Register {
        let (parameters, inputs) = (self.spec.parameters.len(), self.spec.inputs.len());
        match variable {
            Variable::Parameter(i) => 1 + i,
            Variable::Input(i) => 1 + parameters + i,
            Variable::State(i) => 1 + parameters + inputs + i,
            Variable::Flow(i) => match self.flows[i] {
                Some(register) => register,
                // Starts and outputs come after all flows, and these in their order.
                None => unreachable!("flows are sorted"),
            },
        }
    }

    fn operation(&mut self, operation: Operation) -> Register {
        if let Some(&register) = self.known.get(&operation) {
            return register;
        }
        let register = self.first_operation + self.operations.len();
        self.operations.push(operation);
        self.known.insert(operation, register);
        register
    }

    /// By what parameters alone define: times its reciprocal, which is computed once.
    fn divided(&mut self, a: Register, b: Register) -> Register {
        if !self.is_fixed(b) || self.is_fixed(a) {
            return self.operation(Operation::Divide(a, b));
        }
        let reciprocal = self.operation(Operation::Reciprocal(b));
        self.operation(Operation::Multiply(a, reciprocal))
    }

    /// Whether parameters alone define it.
    fn is_fixed(&self, register: Register) -> bool {
        if let Some(i) = register.checked_sub(self.first_operation) {
            let operation = self.operations[i];
            let mut reads = operation.reads().into_iter().flatten();
            return !matches!(operation, Operation::Select(..))
                && reads.all(|register| self.is_fixed(register));
        }
        (1..=self.spec.parameters.len()).contains(&register) || register >= self.first_constant
    }

    fn number(&mut self, value: f64) -> Register {
        let same = |known: &f64| known.to_bits() == value.to_bits();
        let position = self.constants.iter().position(same).unwrap_or_else(|| {
            self.constants.push(value);
            self.constants.len() - 1
        });
        self.first_constant + position
    }

    fn guard(&mut self, comparison: Comparison, a: Register, b: Register) -> Branch {
        let difference = self.operation(Operation::Subtract(a, b));
        let guard = Guard {
            difference,
            comparison,
        };
        let position = self.guards.iter().position(|known| *known == guard);
        Branch::Guard(position.unwrap_or_else(|| {
            self.guards.push(guard);
            self.guards.len() - 1
        }))
    }

    fn select(&mut self, branch: Branch, a: Register, b: Register) -> Register {
        let position = self.branches.iter().position(|known| *known == branch);
        let position = position.unwrap_or_else(|| {
            self.branches.push(branch);
            self.branches.len() - 1
        });
        self.operation(Operation::Select(position, a, b))
    }

    fn expression(&mut self, expression: &Expression) -> Register {
        match expression {
            Expression::Number(value) => self.number(*value),
            Expression::Time => 0,
            Expression::Variable(variable) => self.variable(*variable),
            Expression::Negative(a) => {
                let a = self.expression(a);
                self.operation(Operation::Negative(a))
            }
            Expression::Binary(Operator::Power, a, b) => {
                let a = self.expression(a);
                if let Some(n) = whole(b) {
                    return self.operation(Operation::WholePower(a, n));
                }
                let b = self.expression(b);
                self.operation(Operation::Power(a, b))
            }
            Expression::Binary(operator, a, b) => {
                let (a, b) = (self.expression(a), self.expression(b));
                self.operation(match operator {
                    Operator::Add => Operation::Add(a, b),
                    Operator::Subtract => Operation::Subtract(a, b),
                    Operator::Multiply => Operation::Multiply(a, b),
                    Operator::Divide | Operator::Power => return self.divided(a, b),
                })
            }
            Expression::Call(function, arguments) => {
                let given: Vec<Register> = arguments.iter().map(|a| self.expression(a)).collect();
                self.call(*function, given[0], given.get(1).copied().unwrap_or(0))
            }
            Expression::If(condition, a, b) => {
                let branch = self.condition(condition);
                let (a, b) = (self.expression(a), self.expression(b));
                self.select(branch, a, b)
            }
            Expression::Delay(a, by) => {
                let (a, by) = (self.expression(a), self.expression(by));
                if let Some(&register) = self.delayed.get(&(a, by)) {
                    return register;
                }
                let register = self.first_delayed + self.delays.len();
                self.delays.push((a, by));
                self.delayed.insert((a, by), register);
                register
            }
        }
    }

    fn call(&mut self, function: Function, a: Register, b: Register) -> Register {
        match function {
            Function::Abs => {
                let (zero, negative) = (self.number(0.0), self.operation(Operation::Negative(a)));
                let positive = self.guard(Comparison::GreaterOrEqual, a, zero);
                self.select(positive, a, negative)
            }
            Function::Sign => {
                let (zero, one) = (self.number(0.0), self.number(1.0));
                let minus_one = self.operation(Operation::Negative(one));
                let negative = self.guard(Comparison::Less, a, zero);
                let positive = self.guard(Comparison::Greater, a, zero);
                let otherwise = self.select(negative, minus_one, zero);
                self.select(positive, one, otherwise)
            }
            Function::Min => self.smaller(a, b),
            Function::Max => self.larger(a, b),
            Function::Play => self.play(a, b),
            Function::Quantise => self.operation(Operation::Quantise(a, b)),
            Function::Sqrt => self.operation(Operation::Sqrt(a)),
            Function::Exp => self.operation(Operation::Exp(a)),
            Function::Log => self.operation(Operation::Log(a)),
            Function::Log10 => self.operation(Operation::Log10(a)),
            Function::Sin => self.operation(Operation::Sin(a)),
            Function::Cos => self.operation(Operation::Cos(a)),
            Function::Tan => self.operation(Operation::Tan(a)),
            Function::Tanh => self.operation(Operation::Tanh(a)),
            Function::Atan2 => self.operation(Operation::Atan2(a, b)),
        }
    }

    fn smaller(&mut self, a: Register, b: Register) -> Register {
        let smaller = self.guard(Comparison::LessOrEqual, a, b);
        self.select(smaller, a, b)
    }

    fn larger(&mut self, a: Register, b: Register) -> Register {
        let larger = self.guard(Comparison::GreaterOrEqual, a, b);
        self.select(larger, a, b)
    }

    fn play(&mut self, from: Register, half_width: Register) -> Register {
        let low = self.operation(Operation::Subtract(from, half_width));
        let high = self.operation(Operation::Add(from, half_width));
        let held = self.first_play + self.plays.len();
        let pushed = self.larger(held, low);
        let to = self.smaller(pushed, high);
        self.plays.push(Play { from, held, to });
        to
    }

    fn condition(&mut self, condition: &Condition) -> Branch {
        match condition {
            Condition::Constant(value) => Branch::Constant(*value),
            Condition::Compare(comparison, a, b) => {
                let (a, b) = (self.expression(a), self.expression(b));
                self.guard(*comparison, a, b)
            }
            Condition::Not(a) => Branch::Not(Box::new(self.condition(a))),
            Condition::And(a, b) => {
                Branch::And(Box::new(self.condition(a)), Box::new(self.condition(b)))
            }
            Condition::Or(a, b) => {
                Branch::Or(Box::new(self.condition(a)), Box::new(self.condition(b)))
            }
        }
    }
}

/// The whole number that an exponent is.
fn whole(exponent: &Expression) -> Option<i32> {
    let value = match exponent {
        Expression::Number(value) => *value,
        Expression::Negative(a) => -f64::from(whole(a)?),
        _ => return None,
    };
    #[allow(clippy::cast_possible_truncation, reason = "a small whole number")]
    let number = value as i32;
    (value.abs() < 1e3 && f64::from(number) == value).then_some(number)
}
