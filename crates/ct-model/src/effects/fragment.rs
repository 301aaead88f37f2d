//! An effect at a port, in the names of the model that it may be added to: its variables, and what it does to the equations.

use std::collections::BTreeMap;

use super::effect::{Effect, Place};
use crate::expression::{Expression, Operator, Variable};
use crate::spec::{Flow, Given, ModelSpec, Parameter, State};
use crate::text::{TextError, parse_effect};

/// Variables with positions below the counts of the model are the model's; the others belong to the effect.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fragment {
    pub parameters: Vec<Parameter>,
    pub states: Vec<State>,
    pub flows: Vec<Flow>,
    pub action: Action,
}

/// Action of an effect on the model.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Action {
    /// The effect's output replaces the input, output, parameter or flow of its port.
    Stand(Variable),
    /// The effect's output is added to state equations, to flows, or to readings (by position in the outputs).
    Add(Vec<(Target, Expression)>),
    /// The effect's output replaces the right-hand side of a state equation. The flow `rate` stores the original right-hand side.
    Govern { result: Variable, rate: Variable },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    State(usize),
    Flow(usize),
    Output(usize),
}

/// Number of variables of each kind in the model.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counts {
    pub parameters: usize,
    pub states: usize,
    pub flows: usize,
}

impl Counts {
    pub fn of(spec: &ModelSpec) -> Self {
        Self {
            parameters: spec.parameters.len(),
            states: spec.states.len(),
            flows: spec.flows.len(),
        }
    }
}

/// The name of the flow that an effect gives.
const RESULT: &str = "v";
/// The name of the part of it that the second state of a port gets, where that is not the whole.
const RECEIVED: &str = "w";
/// The name of the right-hand side in an effect that governs it.
const RATE: &str = "rate";

/// An effect at a port, whose inputs are these variables of the model, with these values of its constants.
pub(super) fn instance(
    effect: &Effect,
    ports: &[(&str, Variable)],
    constants: &BTreeMap<&str, f64>,
    counts: Counts,
    targets: &[(usize, bool)],
) -> Result<Fragment, TextError> {
    let small = parse_effect(effect.text, constants)?;
    let mut fragment = Fragment {
        parameters: Vec::new(),
        states: Vec::new(),
        flows: Vec::new(),
        action: Action::Add(Vec::new()),
    };
    // The parameters that are fitted come first, then the constants that the equations name; numbers stay in the expressions.
    let mut own: Vec<Expression> = small
        .parameters
        .iter()
        .map(|p| Expression::number(p.value))
        .collect();
    for constants in [false, true] {
        for (i, parameter) in small.parameters.iter().enumerate() {
            let is_constant = parameter.given == Given::Constant;
            let kept = !is_constant
                || !parameter.about.unit.is_empty()
                    && small.occurrences(Variable::Parameter(i)) > 0;
            if kept && is_constant == constants {
                let at = counts.parameters + fragment.parameters.len();
                own[i] = Expression::Variable(Variable::Parameter(at));
                fragment.parameters.push(Parameter {
                    definition: None,
                    ..parameter.clone()
                });
            }
        }
    }
    // The right-hand side becomes an additional flow after the flows of the effect.
    let rate = Variable::Flow(counts.flows + small.flows.len());
    let of = |variable: Variable| match variable {
        Variable::Parameter(i) => own[i].clone(),
        Variable::State(i) => Expression::Variable(Variable::State(counts.states + i)),
        Variable::Flow(i) => Expression::Variable(Variable::Flow(counts.flows + i)),
        Variable::Input(i) => {
            let name = small.inputs[i].about.name.as_str();
            let port = ports.iter().find(|(port, _)| *port == name);
            Expression::Variable(port.map_or(rate, |(_, variable)| *variable))
        }
    };
    for state in &small.states {
        fragment.states.push(State {
            about: state.about.clone(),
            coefficient: state.coefficient.as_ref().map(|c| c.with(&of)),
            right: state.right.with(&of),
            start: state.start.with(&of),
            fixed: state.fixed,
        });
    }
    for flow in &small.flows {
        fragment.flows.push(Flow {
            about: flow.about.clone(),
            value: flow.value.with(&of),
            of_parameters: false,
        });
    }
    let flow = |name: &str| {
        let position = small.flows.iter().position(|flow| flow.about.name == name);
        position.map(|at| Variable::Flow(counts.flows + at))
    };
    let result = flow(RESULT).unwrap_or(Variable::Flow(counts.flows));
    let received = flow(RECEIVED).unwrap_or(result);
    let governs = small.inputs.iter().any(|input| input.about.name == RATE);
    fragment.action = match effect.place {
        Place::Input
        | Place::Output
        | Place::LevelReading
        | Place::Parameter
        | Place::ParameterAndSignal
        | Place::Terminal => Action::Stand(result),
        _ if governs => Action::Govern { result, rate },
        _ => {
            let term = |negative: bool| {
                if negative {
                    Expression::Negative(Box::new(Expression::Variable(result)))
                } else {
                    Expression::Variable(received)
                }
            };
            let of = |&(state, negative)| (Target::State(state), term(negative));
            Action::Add(targets.iter().map(of).collect())
        }
    };
    Ok(fragment)
}

/// A sum; `a - b` where what is added is negative.
pub(super) fn sum(a: Expression, b: Expression) -> Expression {
    match b {
        Expression::Negative(b) => Expression::Binary(Operator::Subtract, Box::new(a), b),
        b => Expression::Binary(Operator::Add, Box::new(a), Box::new(b)),
    }
}
