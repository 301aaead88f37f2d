//! Sizes and units of the terms of an equation.

use super::port::Port;
use super::unit_text::{product, quotient};
use super::visited::Visited;
use crate::expression::{Expression, Operator, Variable};
use crate::spec::ModelSpec;

/// Evaluates terms where the data were.
pub(super) struct Scales<'a> {
    spec: &'a ModelSpec,
    visited: &'a Visited,
}

impl<'a> Scales<'a> {
    pub fn of(spec: &'a ModelSpec, visited: &'a Visited) -> Self {
        Self { spec, visited }
    }

    /// The largest term of a state's equation; one where that cannot be found.
    pub fn balance(&self, state: usize) -> f64 {
        let mut terms = Vec::new();
        self.terms(&self.spec.states[state].right, &mut terms);
        let sizes = [0.0, 0.5, 1.0].map(|share| {
            let of = terms.iter().map(|term| self.value(term, share).abs());
            of.filter(|size| size.is_finite()).fold(0.0, f64::max)
        });
        let largest = sizes.into_iter().fold(0.0, f64::max);
        if largest > 0.0 { largest } else { 1.0 }
    }

    /// The width of an output's range; one elsewhere.
    pub fn reading(&self, port: Port) -> f64 {
        match port {
            Port::OutputAnd(y, _) => self.visited.span(self.spec.outputs[y].variable).width(),
            _ => 1.0,
        }
    }

    fn value(&self, expression: &Expression, share: f64) -> f64 {
        let of = |variable: Variable| match variable {
            Variable::Parameter(i) => self.spec.parameters[i].value,
            Variable::Flow(i) if !self.visited.spans.contains_key(&variable) => {
                self.value(&self.spec.flows[i].value, share)
            }
            variable => {
                let span = self.visited.span(variable);
                span.low + share * (span.high - span.low)
            }
        };
        let time = self.visited.begin + share * self.visited.duration;
        expression.value(time, &of)
    }

    fn terms<'e>(&self, expression: &'e Expression, all: &mut Vec<&'e Expression>)
    where
        'a: 'e,
    {
        match self.spec.behind(expression) {
            Expression::Binary(Operator::Add | Operator::Subtract, a, b) => {
                self.terms(a, all);
                self.terms(b, all);
            }
            Expression::Negative(a) => self.terms(a, all),
            other => all.push(other),
        }
    }
}

/// The unit of a state's equation, from a flow that is a term of it, or from the state and its coefficient; empty if it is not known.
pub(super) fn balance_unit(spec: &ModelSpec, state: usize, time: &str) -> String {
    let state = &spec.states[state];
    let mut units = Vec::new();
    units_of_terms(spec, &state.right, &mut units);
    if let Some(unit) = units.into_iter().next() {
        return unit;
    }
    let unit = &state.about.unit;
    let own = if unit.is_empty() {
        String::new()
    } else {
        quotient(unit, time)
    };
    match &state.coefficient {
        None => own,
        Some(Expression::Variable(c)) => match spec.about(*c).unit.as_str() {
            "" => String::new(),
            coefficient => product(&own, coefficient),
        },
        Some(_) => String::new(),
    }
}

fn units_of_terms(spec: &ModelSpec, expression: &Expression, all: &mut Vec<String>) {
    match expression {
        Expression::Binary(Operator::Add | Operator::Subtract, a, b) => {
            units_of_terms(spec, a, all);
            units_of_terms(spec, b, all);
        }
        Expression::Negative(a) => units_of_terms(spec, a, all),
        Expression::Variable(variable) => {
            let unit = &spec.about(*variable).unit;
            if !unit.is_empty() {
                all.push(unit.clone());
            }
        }
        _ => {}
    }
}
