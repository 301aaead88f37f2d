//! Hard nonlinearities: limits, dead zones, friction, backlash. Near one a linear form of the model says nothing.

use crate::expression::{Condition, Expression, Function, Operator, Variable};
use crate::spec::ModelSpec;

/// Time, states and inputs at one row of a simulation.
#[derive(Debug, Clone, Copy)]
pub struct OperatingPoint<'a> {
    /// The time \[unit of the model's time\].
    pub time: f64,
    /// The states, in the order of the text.
    pub states: &'a [f64],
    /// The inputs, in the order of the text.
    pub inputs: &'a [f64],
}

/// What decides between the branches of a part of an equation.
enum Choice<'a> {
    Condition(&'a Condition),
    /// The smaller one of two: of `min` and `max`.
    Smaller(&'a Expression, &'a Expression),
    /// The sign: of `abs` and `sign`.
    Sign(&'a Expression),
    /// The past of a signal: of backlash.
    Past(&'a Expression),
}

impl Choice<'_> {
    /// The branch that is taken, for these values of the variables; `None` between two branches, where both give the same value.
    fn branch(&self, time: f64, of: &impl Fn(Variable) -> f64) -> Option<bool> {
        let less = |a: f64, b: f64| (a != b).then_some(a < b);
        match self {
            Self::Condition(condition) => Some(condition.holds(time, of)),
            Self::Smaller(a, b) => less(a.value(time, of), b.value(time, of)),
            Self::Sign(a) => less(a.value(time, of), 0.0),
            Self::Past(_) => Some(true),
        }
    }

    fn each_variable(&self, each: &mut impl FnMut(Variable)) {
        match self {
            Self::Condition(condition) => condition.each_variable(each),
            Self::Smaller(a, b) => {
                a.each_variable(each);
                b.each_variable(each);
            }
            Self::Sign(a) | Self::Past(a) => a.each_variable(each),
        }
    }
}

/// A choice, and the branches of other choices that it is in.
struct Selector<'a> {
    choice: Choice<'a>,
    within: Vec<(&'a Condition, bool)>,
}

impl Selector<'_> {
    fn is_reached(&self, time: f64, of: &impl Fn(Variable) -> f64) -> bool {
        let mut within = self.within.iter();
        within.all(|(condition, taken)| condition.holds(time, of) == *taken)
    }
}

/// Adds the selectors of an expression; rounding has none: on the average it is linear.
fn add_selectors<'a>(
    expression: &'a Expression,
    within: &[(&'a Condition, bool)],
    all: &mut Vec<Selector<'a>>,
) {
    let mut add = |choice: Choice<'a>| {
        all.push(Selector {
            choice,
            within: within.to_vec(),
        });
    };
    match expression {
        Expression::If(condition, a, b) => {
            add(Choice::Condition(condition));
            for (arm, taken) in [(a, true), (b, false)] {
                let within = [within, &[(&**condition, taken)]].concat();
                add_selectors(arm, &within, all);
            }
        }
        Expression::Call(function, arguments) => {
            match function {
                Function::Abs | Function::Sign => add(Choice::Sign(&arguments[0])),
                Function::Min | Function::Max => {
                    add(Choice::Smaller(&arguments[0], &arguments[1]));
                }
                Function::Play | Function::StickSlip | Function::StayBetween => {
                    add(Choice::Past(&arguments[0]));
                }
                _ => {}
            }
            for argument in arguments {
                add_selectors(argument, within, all);
            }
        }
        Expression::Binary(Operator::Multiply, a, b) => {
            let mut factors = Vec::new();
            add_factors(a, &mut factors);
            add_factors(b, &mut factors);
            for factor in &factors {
                // The slope of `v*abs(v)` has no jump.
                let is_smooth = matches!(factor, Expression::Call(Function::Abs, of) if factors.contains(&&of[0]));
                if !is_smooth {
                    add_selectors(factor, within, all);
                }
            }
        }
        Expression::Binary(_, a, b) | Expression::Delay(a, b) => {
            add_selectors(a, within, all);
            add_selectors(b, within, all);
        }
        Expression::Negative(a) => add_selectors(a, within, all),
        Expression::Number(_) | Expression::Time | Expression::Variable(_) => {}
    }
}

/// Adds the factors of a product.
fn add_factors<'a>(expression: &'a Expression, all: &mut Vec<&'a Expression>) {
    match expression {
        Expression::Binary(Operator::Multiply, a, b) => {
            add_factors(a, all);
            add_factors(b, all);
        }
        Expression::Negative(a) => add_factors(a, all),
        other => all.push(other),
    }
}

impl Expression {
    /// Whether a variable decides between branches: in a condition, `min`, `max`, `abs`, `sign`, backlash.
    #[must_use]
    pub fn branches_by(&self, variable: Variable) -> bool {
        let mut all = Vec::new();
        add_selectors(self, &[], &mut all);
        all.iter().any(|selector| {
            let mut is_read = false;
            let choice = &selector.choice;
            choice.each_variable(&mut |read| is_read |= read == variable);
            is_read
        })
    }
}

impl ModelSpec {
    /// The first variable with a hard nonlinearity that acts: its branch changes from one of these points to another, or depends on the past.
    /// Branches that depend on nothing but time, parameters and inputs that are not among `driven` do not count.
    ///
    /// # Panics
    /// Where there are not as many parameters, states or inputs as the model has.
    pub fn hard_nonlinearity<'i>(
        &self,
        parameters: &[f64],
        driven: &[usize],
        points: impl IntoIterator<Item = OperatingPoint<'i>>,
    ) -> Option<Variable> {
        let mut reads = vec![None; self.flows.len()];
        let of_interest = |variable: Variable, reads: &[Option<Variable>]| match variable {
            Variable::Parameter(_) => None,
            Variable::Input(i) => driven.contains(&i).then_some(variable),
            Variable::State(_) => Some(variable),
            Variable::Flow(i) => reads[i],
        };
        for &i in &self.order {
            let mut found = None;
            self.flows[i].value.each_variable(&mut |variable| {
                found = found.or_else(|| of_interest(variable, &reads));
            });
            reads[i] = found;
        }
        let mut all = Vec::new();
        for expression in self.expressions() {
            add_selectors(expression, &[], &mut all);
        }
        let mut undecided: Vec<(Selector, Variable, Option<bool>)> = Vec::new();
        for selector in all {
            let mut of = None;
            let choice = &selector.choice;
            choice.each_variable(&mut |variable| of = of.or_else(|| of_interest(variable, &reads)));
            undecided.extend(of.map(|of| (selector, of, None)));
        }
        if undecided.is_empty() {
            return None;
        }
        let mut flows = vec![0.0; self.flows.len()];
        for point in points {
            for &i in &self.order {
                flows[i] = self.flows[i].value.value(point.time, &|variable| {
                    value_of(variable, parameters, point, &flows)
                });
            }
            let of = |variable: Variable| value_of(variable, parameters, point, &flows);
            for (selector, variable, first) in &mut undecided {
                if !selector.is_reached(point.time, &of) {
                    continue;
                }
                let branch = selector.choice.branch(point.time, &of);
                let changes = first.is_some() && branch.is_some() && branch != *first;
                if changes || matches!(selector.choice, Choice::Past(_)) {
                    return Some(*variable);
                }
                *first = first.or(branch);
            }
        }
        None
    }
}

fn value_of(
    variable: Variable,
    parameters: &[f64],
    point: OperatingPoint<'_>,
    flows: &[f64],
) -> f64 {
    match variable {
        Variable::Parameter(i) => parameters[i],
        Variable::Input(i) => point.inputs[i],
        Variable::State(i) => point.states[i],
        Variable::Flow(i) => flows[i],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The variable whose branch changes while `x` runs from -1 to 1, `u` from 0 to 2 and `w` from 2 to 0.
    fn found(right: &str, parameters: &[f64]) -> Option<String> {
        let text = format!(
            "model M parameter Real p = 0; input Real u; input Real w; output Real y = x; Real x(start=0); Real q = 2*x; equation der(x) = {right} + 0*(p + u + w + q); end M;"
        );
        let spec = ModelSpec::parse(&text).unwrap_or_else(|error| panic!("{error}"));
        let rows: Vec<(f64, [f64; 1], [f64; 2])> = (0..21)
            .map(|k| 0.1 * f64::from(k))
            .map(|t| (t, [t - 1.0], [t, 2.0 - t]))
            .collect();
        let points = rows.iter().map(|(time, states, inputs)| OperatingPoint {
            time: *time,
            states,
            inputs,
        });
        let found = spec.hard_nonlinearity(parameters, &[0], points);
        found.map(|variable| spec.about(variable).name.clone())
    }

    #[test]
    fn a_limit_counts_where_it_acts() {
        let of_u = Some("u".to_string());
        let of_x = Some("x".to_string());
        assert_eq!(found("min(u, p) - x", &[1.0]), of_u);
        assert_eq!(found("min(u, p) - x", &[3.0]), None);
        assert_eq!(found("(if u > p then u else 0) - x", &[1.0]), of_u);
        assert_eq!(found("u - p*sign(x)", &[1.0]), of_x);
        assert_eq!(found("u - abs(q)", &[1.0]), of_x);
        assert_eq!(found("u - max(x + 2, 0)", &[1.0]), None);
        // A limit that is reached and not exceeded.
        assert_eq!(found("min(u, p) - x", &[2.0]), None);
        assert_eq!(found("max(0, u) - x", &[1.0]), None);
    }

    #[test]
    fn memory_always_counts() {
        assert_eq!(found("play(u, p) - x", &[0.0]), Some("u".to_string()));
    }

    #[test]
    fn what_no_controller_drives_does_not_count() {
        for right in [
            "min(w, 1) - x",
            "play(w, 1) - x",
            "(if time > 1 then 2 else 1)*x",
            "quantise(u, 0.1) - x",
            "u - sin(x)^3",
            "u - p*x*abs(x)",
            "if p > 0.5 then u - x else abs(x)",
        ] {
            assert_eq!(found(right, &[1.0]), None, "{right}");
        }
    }
}
