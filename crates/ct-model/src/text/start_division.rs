//! Divisions by zero where a simulation begins.

use crate::expression::{Condition, Expression, Operator, Variable};
use crate::spec::ModelSpec;

/// A state that starts at zero, and the equation in which it makes a divisor zero.
pub(super) struct StartDivision {
    /// The state, by position.
    pub state: usize,
    /// The variable whose equation it is, and the quotient.
    pub of: String,
    pub quotient: String,
}

/// The first division by zero at the declared starts, with a state that starts at zero in the divisor. Inputs are not known: expressions of
/// inputs count as not zero, and the branches of an `if` that depends on inputs are not checked.
pub(super) fn start_division(spec: &ModelSpec) -> Option<StartDivision> {
    let parameter = |variable: Variable| match variable {
        Variable::Parameter(i) => spec.parameters[i].value,
        _ => f64::NAN,
    };
    let starts = spec.states.iter();
    let starts: Vec<f64> = starts.map(|s| s.start.value(0.0, &parameter)).collect();
    let mut flows = vec![f64::NAN; spec.flows.len()];
    for &i in &spec.order {
        let value = spec.flows[i].value.value(0.0, &|variable| match variable {
            Variable::State(k) => starts[k],
            Variable::Flow(k) => flows[k],
            other => parameter(other),
        });
        flows[i] = value;
    }
    let at = |variable: Variable| match variable {
        Variable::State(k) => starts[k],
        Variable::Flow(k) => flows[k],
        other => parameter(other),
    };
    let of_flows = spec.flows.iter().map(|flow| (&flow.about, &flow.value));
    let of_states = spec.states.iter().flat_map(|state| {
        let parts = state.coefficient.iter().chain([&state.right]);
        parts.map(|part| (&state.about, part))
    });
    let mut parts = of_flows.chain(of_states);
    parts.find_map(|(about, part)| {
        let (state, quotient) = zero_divisor(part, &at)?;
        Some(StartDivision {
            state,
            of: about.name.clone(),
            quotient: spec.write(quotient),
        })
    })
}

/// The state that makes a divisor of an expression zero, and the quotient.
fn zero_divisor<'e>(
    expression: &'e Expression,
    at: &impl Fn(Variable) -> f64,
) -> Option<(usize, &'e Expression)> {
    match expression {
        Expression::Number(_) | Expression::Time | Expression::Variable(_) => None,
        Expression::Negative(a) | Expression::Delay(a, _) => zero_divisor(a, at),
        Expression::Binary(operator, a, b) => {
            let within = zero_divisor(a, at).or_else(|| zero_divisor(b, at));
            let divisor = match operator {
                Operator::Divide => b,
                Operator::Power if b.value(0.0, at) < 0.0 => a,
                _ => return within,
            };
            within.or_else(|| {
                let mut state = None;
                divisor.each_variable(&mut |variable| match variable {
                    Variable::State(i) if at(variable) == 0.0 && state.is_none() => state = Some(i),
                    _ => {}
                });
                (divisor.value(0.0, at) == 0.0)
                    .then_some(state?)
                    .map(|state| (state, expression))
            })
        }
        Expression::Call(_, arguments) => arguments.iter().find_map(|part| zero_divisor(part, at)),
        Expression::If(condition, a, b) => {
            if !is_known(condition, at) {
                return None;
            }
            zero_divisor(if condition.holds(0.0, at) { a } else { b }, at)
        }
    }
}

fn is_known(condition: &Condition, at: &impl Fn(Variable) -> f64) -> bool {
    let mut known = true;
    condition.each_variable(&mut |variable| known &= !at(variable).is_nan());
    known
}
