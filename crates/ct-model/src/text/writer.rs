//! A model written as text, which reads back as the same model.

use std::collections::VecDeque;
use std::fmt::{self, Display, Formatter};

use crate::expression::{Comparison, Condition, Expression, Operator, Variable};
use crate::spec::{About, Given, ModelSpec};

/// Binding strength of an expression; an expression with less strength than its place needs is put in brackets.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Choice,
    Or,
    And,
    Not,
    Relation,
    Sum,
    Term,
    Factor,
    Primary,
}

/// An expression or a condition with its model, for printing.
struct Written<'a, T> {
    spec: &'a ModelSpec,
    part: &'a T,
    /// Binding strength that the place needs.
    at_least: Binding,
}

impl ModelSpec {
    fn written<'a, T>(&'a self, part: &'a T, at_least: Binding) -> Written<'a, T> {
        Written {
            spec: self,
            part,
            at_least,
        }
    }

    /// An expression of this model as text.
    #[must_use]
    pub fn write(&self, expression: &Expression) -> String {
        self.written(expression, Binding::Choice).to_string()
    }
}

impl Expression {
    fn binding(&self) -> Binding {
        match self {
            Self::If(..) => Binding::Choice,
            Self::Negative(_) | Self::Binary(Operator::Add | Operator::Subtract, ..) => {
                Binding::Sum
            }
            Self::Binary(Operator::Multiply | Operator::Divide, ..) => Binding::Term,
            Self::Binary(Operator::Power, ..) => Binding::Factor,
            _ => Binding::Primary,
        }
    }
}

impl Condition {
    fn binding(&self) -> Binding {
        match self {
            Self::Constant(_) => Binding::Primary,
            Self::Compare(..) => Binding::Relation,
            Self::Not(_) => Binding::Not,
            Self::And(..) => Binding::And,
            Self::Or(..) => Binding::Or,
        }
    }
}

/// A number in Modelica notation: the shortest text with the same value.
fn number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e15 {
        return format!("{value:.0}");
    }
    format!("{value:?}")
}

impl Display for Written<'_, Expression> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let brackets = self.part.binding() < self.at_least;
        if brackets {
            f.write_str("(")?;
        }
        let part = |part, at_least| self.spec.written::<Expression>(part, at_least);
        match self.part {
            Expression::Number(value) => f.write_str(&number(*value))?,
            Expression::Time => f.write_str("time")?,
            Expression::Variable(variable) => f.write_str(&self.spec.about(*variable).name)?,
            // `-a*b` is read as `-(a*b)`.
            Expression::Negative(a) => write!(f, "-{}", part(a, Binding::Term))?,
            Expression::Binary(operator, a, b) => {
                let (sign, left, right) = match operator {
                    Operator::Add => (" + ", Binding::Sum, Binding::Term),
                    Operator::Subtract => (" - ", Binding::Sum, Binding::Term),
                    Operator::Multiply => ("*", Binding::Term, Binding::Factor),
                    Operator::Divide => ("/", Binding::Term, Binding::Factor),
                    Operator::Power => ("^", Binding::Primary, Binding::Primary),
                };
                write!(f, "{}{sign}{}", part(a, left), part(b, right))?;
            }
            Expression::Call(function, arguments) => {
                write!(f, "{}(", function.name())?;
                for (i, argument) in arguments.iter().enumerate() {
                    let comma = if i > 0 { ", " } else { "" };
                    write!(f, "{comma}{}", part(argument, Binding::Choice))?;
                }
                f.write_str(")")?;
            }
            Expression::If(condition, a, b) => {
                let condition: &Condition = condition;
                write!(
                    f,
                    "if {} then {} else {}",
                    self.spec.written(condition, Binding::Or),
                    part(a, Binding::Choice),
                    part(b, Binding::Choice)
                )?;
            }
            Expression::Delay(a, by) => {
                let (a, by) = (part(a, Binding::Choice), part(by, Binding::Choice));
                write!(f, "delay({a}, {by})")?;
            }
        }
        if brackets {
            f.write_str(")")?;
        }
        Ok(())
    }
}

impl Display for Written<'_, Condition> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let brackets = self.part.binding() < self.at_least;
        if brackets {
            f.write_str("(")?;
        }
        let part = |part, at_least| self.spec.written::<Condition>(part, at_least);
        match self.part {
            Condition::Constant(value) => write!(f, "{value}")?,
            Condition::Compare(comparison, a, b) => {
                let sign = match comparison {
                    Comparison::Less => "<",
                    Comparison::LessOrEqual => "<=",
                    Comparison::Greater => ">",
                    Comparison::GreaterOrEqual => ">=",
                    Comparison::Equal => "==",
                    Comparison::NotEqual => "<>",
                };
                let (a, b): (&Expression, &Expression) = (a, b);
                let (a, b) = (
                    self.spec.written(a, Binding::Sum),
                    self.spec.written(b, Binding::Sum),
                );
                write!(f, "{a} {sign} {b}")?;
            }
            Condition::Not(a) => write!(f, "not {}", part(a, Binding::Relation))?,
            Condition::And(a, b) => {
                let (a, b) = (part(a, Binding::And), part(b, Binding::Not));
                write!(f, "{a} and {b}")?;
            }
            Condition::Or(a, b) => {
                write!(f, "{} or {}", part(a, Binding::Or), part(b, Binding::And))?;
            }
        }
        if brackets {
            f.write_str(")")?;
        }
        Ok(())
    }
}

/// A text between quotes.
fn quoted(text: &str) -> String {
    let escaped = text
        .replace('\\', "\\\\")
        .replace('"', "\\\"")
        .replace('\n', "\\n")
        .replace('\t', "\\t");
    format!("\"{escaped}\"")
}

/// A description after a blank; empty if there is none.
fn description(text: &str) -> String {
    if text.is_empty() {
        return String::new();
    }
    format!(" {}", quoted(text))
}

impl ModelSpec {
    /// States and flows in an order that is consistent with the orders of states, flows and outputs.
    fn declared(&self) -> Vec<Variable> {
        let states = (0..self.states.len()).map(Variable::State);
        let of_time = |i: &usize| !self.flows[*i].of_parameters;
        let flows = (0..self.flows.len()).filter(of_time).map(Variable::Flow);
        let mut all = Vec::new();
        let mut rest = [
            states.collect::<VecDeque<_>>(),
            flows.collect::<VecDeque<_>>(),
        ];
        for output in &self.outputs {
            let Some(own) = rest.iter_mut().find(|own| own.contains(&output.variable)) else {
                continue;
            };
            while let Some(next) = own.pop_front() {
                all.push(next);
                if next == output.variable {
                    break;
                }
            }
        }
        all.extend(rest.into_iter().flatten());
        all
    }
}

/// Name and attributes of a variable: its own, and more that are given.
fn declared(about: &About, more: &[(&str, String)]) -> String {
    let mut attributes = Vec::new();
    if !about.quantity.is_empty() {
        attributes.push(format!("quantity={}", quoted(&about.quantity)));
    }
    if !about.unit.is_empty() {
        attributes.push(format!("unit={}", quoted(&about.unit)));
    }
    if about.min.is_finite() {
        attributes.push(format!("min={}", number(about.min)));
    }
    if about.max.is_finite() {
        attributes.push(format!("max={}", number(about.max)));
    }
    attributes.extend(more.iter().map(|(name, value)| format!("{name}={value}")));
    if attributes.is_empty() {
        return about.name.clone();
    }
    format!("{}({})", about.name, attributes.join(", "))
}

impl Display for ModelSpec {
    /// The model as Modelica. It reads back as the same model, except for comments and the order of its flows.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "model {}{}", self.name, description(&self.description))?;
        for parameter in &self.parameters {
            let given = match parameter.given {
                Given::Fitted => "parameter",
                Given::Measured => "final parameter",
                Given::Constant => "constant",
            };
            let about = &parameter.about;
            let of = |variable| match variable {
                Variable::Parameter(i) => self.parameters[i].value,
                _ => f64::NAN,
            };
            // A changed value no longer equals the formula in the text.
            let same = |definition: &&Expression| definition.value(0.0, &of) == parameter.value;
            let value = match parameter.definition.as_ref().filter(same) {
                Some(definition) => self.write(definition),
                None => number(parameter.value),
            };
            let words = description(&about.description);
            writeln!(
                f,
                "  {given} Real {} = {value}{words};",
                declared(about, &[])
            )?;
        }
        for flow in self.flows.iter().filter(|flow| flow.of_parameters) {
            writeln!(
                f,
                "  final parameter Real {} = {}{};",
                declared(&flow.about, &[]),
                self.write(&flow.value),
                description(&flow.about.description)
            )?;
        }
        for input in &self.inputs {
            let about = &input.about;
            let words = description(&about.description);
            writeln!(f, "  input Real {}{words};", declared(about, &[]))?;
        }
        let output = |variable| {
            if self.is_output(variable) {
                "output "
            } else {
                ""
            }
        };
        for variable in self.declared() {
            let about = self.about(variable);
            let words = description(&about.description);
            let kept = output(variable);
            match variable {
                Variable::State(i) => {
                    let state = &self.states[i];
                    let mut more = Vec::new();
                    if !self.is_settled(i) {
                        more.push(("start", self.write(&state.start)));
                    }
                    if state.fixed && !self.is_settled(i) {
                        more.push(("fixed", "true".to_string()));
                    }
                    writeln!(f, "  {kept}Real {}{words};", declared(about, &more))?;
                }
                _ => writeln!(f, "  {kept}Real {}{words};", declared(about, &[]))?,
            }
        }
        let settled = (0..self.states.len()).filter(|&i| self.is_settled(i));
        for (count, i) in settled.enumerate() {
            if count == 0 {
                writeln!(f, "initial equation")?;
            }
            let state = &self.states[i];
            writeln!(f, "  {} = {};", state.about.name, self.write(&state.start))?;
        }
        writeln!(f, "equation")?;
        for flow in self.flows.iter().filter(|flow| !flow.of_parameters) {
            writeln!(f, "  {} = {};", flow.about.name, self.write(&flow.value))?;
        }
        for state in &self.states {
            let name = &state.about.name;
            let right = self.write(&state.right);
            match &state.coefficient {
                Some(coefficient) => {
                    let coefficient = self.written(coefficient, Binding::Term);
                    writeln!(f, "  {coefficient}*der({name}) = {right};")?;
                }
                None => writeln!(f, "  der({name}) = {right};")?,
            }
        }
        writeln!(f, "end {};", self.name)
    }
}
