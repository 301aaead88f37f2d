//! Compiles a model's expressions to operations on registers: a repeated subexpression becomes one operation.

mod memory;

use std::cell::Cell;
use std::collections::HashMap;

use super::{Branch, Guard, Operation, Play, Register, Tape};
use crate::expression::{Comparison, Condition, Expression, Function, Operator, Variable};
use crate::spec::ModelSpec;

struct Compiler<'a> {
    spec: &'a ModelSpec,
    constants: Vec<f64>,
    operations: Vec<Operation>,
    /// Whether parameters alone define the result of each operation.
    fixed: Vec<bool>,
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
        // The positions of registers depend on the number of constants and delays: count them first.
        let (numbers, delays, plays) = (Cell::new(1), Cell::new(0), Cell::new(0));
        let starts = spec.states.iter().map(|state| &state.start);
        for expression in spec.expressions().chain(starts) {
            expression.any(&|part| {
                match part {
                    Expression::Number(_) => numbers.set(numbers.get() + 1),
                    Expression::Call(Function::Sign | Function::Abs, _) => {
                        numbers.set(numbers.get() + 2);
                    }
                    Expression::Call(Function::Play | Function::StayBetween, _) => {
                        plays.set(plays.get() + 1);
                    }
                    Expression::Call(Function::StickSlip, _) => {
                        numbers.set(numbers.get() + 3);
                        plays.set(plays.get() + 4);
                    }
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
            fixed: Vec::new(),
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
            read_by_samples: Vec::new(),
            of_inputs: Vec::new(),
            read_by_all: Vec::new(),
            first_delayed,
            first_constant: compiler.first_constant,
            first_operation: compiler.first_operation,
        };
        tape.parameters_first(&compiler.fixed);
        tape.note_results();
        tape
    }

    /// Moves operations on parameters alone to the front.
    fn parameters_first(&mut self, fixed: &[bool]) {
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
        let all = !matches!(operation, Operation::Select(..));
        let mut reads = operation.reads().into_iter().flatten();
        self.fixed
            .push(all && reads.all(|register| self.is_fixed(register)));
        self.operations.push(operation);
        self.known.insert(operation, register);
        register
    }

    /// Division by an expression of parameters alone: multiplication by its reciprocal, which is computed once.
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
            return self.fixed[i];
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
                let given_at = |i: usize| given.get(i).copied().unwrap_or(0);
                self.call(*function, [given[0], given_at(1), given_at(2), given_at(3)])
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

    fn call(&mut self, function: Function, [a, b, c, d]: [Register; 4]) -> Register {
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
            Function::StayBetween => self.stay_between(a, a, b),
            Function::StickSlip => self.stick_slip(a, [b, c, d]),
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

/// The value of an exponent, if it is an integer constant.
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
