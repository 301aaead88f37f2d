//! Whether a model is linear in its states and inputs, found from its text.

use crate::expression::{Expression, Function, Operator, Variable};
use crate::spec::ModelSpec;

/// Whether a model is linear in states and inputs for all values of its parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Linearity {
    /// Every equation is a sum of constants times states and inputs, and a constant.
    Linear,
    /// Some are not.
    Nonlinear {
        /// The variables whose own equations are not, in the order of the equations: flows, then states.
        equations: Vec<Variable>,
    },
}

/// How an expression depends on states, inputs and time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Degree {
    /// Parameters alone.
    Constant,
    Linear,
    Other,
}

impl ModelSpec {
    /// Whether the model is linear, so that it can be simulated exactly. An explicit function of time other than a delay is not linear.
    #[must_use]
    pub fn linearity(&self) -> Linearity {
        let mut flows = vec![Degree::Constant; self.flows.len()];
        let mut equations = Vec::new();
        for &i in &self.order {
            flows[i] = degree(&self.flows[i].value, &flows);
            if flows[i] == Degree::Other {
                equations.push(Variable::Flow(i));
                // Expressions that use this flow still count as linear: only the first nonlinear place is reported.
                flows[i] = Degree::Linear;
            }
        }
        for (i, state) in self.states.iter().enumerate() {
            let coefficient = state.coefficient.as_ref();
            let varies = |c| degree(c, &flows) != Degree::Constant;
            if coefficient.is_some_and(varies) || degree(&state.right, &flows) == Degree::Other {
                equations.push(Variable::State(i));
            }
        }
        if equations.is_empty() {
            Linearity::Linear
        } else {
            Linearity::Nonlinear { equations }
        }
    }
}

/// Whether the states can be computed exactly from row to row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ExactSteps {
    /// Not linear, or time-varying.
    No,
    /// A constant matrix, and any function of the inputs: linear while the inputs are held.
    HeldInputs,
    /// Linear in the inputs too.
    AllInputs,
}

impl ModelSpec {
    /// Condition for linearity of the state equations; the outputs may be nonlinear.
    pub(crate) fn exact_steps(&self) -> ExactSteps {
        let mut flows = vec![Part::Parameters; self.flows.len()];
        for &i in &self.order {
            flows[i] = part(&self.flows[i].value, &flows);
        }
        let mut worst = Part::Parameters;
        for state in &self.states {
            let coefficient = state.coefficient.as_ref();
            if coefficient.is_some_and(|c| part(c, &flows) != Part::Parameters) {
                return ExactSteps::No;
            }
            worst = worst.max(part(&state.right, &flows));
        }
        if worst == Part::Other {
            return ExactSteps::No;
        }
        if self.is_linear_in_states_and_inputs() {
            ExactSteps::AllInputs
        } else {
            ExactSteps::HeldInputs
        }
    }

    /// Whether every state equation is linear in states and inputs.
    fn is_linear_in_states_and_inputs(&self) -> bool {
        let mut flows = vec![Degree::Constant; self.flows.len()];
        for &i in &self.order {
            flows[i] = degree(&self.flows[i].value, &flows);
        }
        let mut states = self.states.iter();
        states.all(|state| degree(&state.right, &flows) != Degree::Other)
    }
}

/// Variables that a part of an equation depends on, with inputs held constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Parameters,
    /// Inputs and parameters.
    Inputs,
    /// Linear in states, with parameters as coefficients, plus any function of inputs.
    States,
    Other,
}

fn part(expression: &Expression, flows: &[Part]) -> Part {
    use Part::{Inputs, Other, Parameters, States};
    let of = |inner: &Expression| part(inner, flows);
    let of_inputs = |worst: Part| if worst <= Inputs { worst } else { Other };
    match expression {
        Expression::Number(_) => Parameters,
        Expression::Time | Expression::Delay(..) => Other,
        Expression::Variable(Variable::Parameter(_)) => Parameters,
        Expression::Variable(Variable::Input(_)) => Inputs,
        Expression::Variable(Variable::State(_)) => States,
        Expression::Variable(Variable::Flow(i)) => flows[*i],
        Expression::Negative(a) => of(a),
        Expression::Binary(operator, a, b) => {
            let (a, b) = (of(a), of(b));
            match operator {
                Operator::Add | Operator::Subtract => a.max(b),
                Operator::Multiply if a == Parameters => b,
                Operator::Multiply | Operator::Divide if b == Parameters => a,
                _ => of_inputs(a.max(b)),
            }
        }
        Expression::Call(_, arguments) => {
            of_inputs(arguments.iter().map(of).max().unwrap_or(Parameters))
        }
        Expression::If(condition, a, b) => {
            let mut worst = Parameters;
            condition.each_variable(&mut |variable| {
                worst = worst.max(of(&Expression::Variable(variable)));
            });
            let timed =
                condition.any(&|part| matches!(part, Expression::Time | Expression::Delay(..)));
            let branches = of(a).max(of(b));
            match worst {
                _ if timed => Other,
                Parameters => branches,
                // If inputs choose the branch, the matrix depends on inputs where the branches contain states.
                Inputs => of_inputs(branches.max(Inputs)),
                States | Other => Other,
            }
        }
    }
}

fn degree(expression: &Expression, flows: &[Degree]) -> Degree {
    use Degree::{Constant, Linear, Other};
    let of = |part: &Expression| degree(part, flows);
    // A function of constants is constant, and of anything else it is not linear.
    let constant_or_other = |worst: Degree| if worst == Constant { Constant } else { Other };
    match expression {
        Expression::Number(_) => Constant,
        Expression::Time => Other,
        Expression::Variable(Variable::Parameter(_)) => Constant,
        Expression::Variable(Variable::Input(_) | Variable::State(_)) => Linear,
        Expression::Variable(Variable::Flow(i)) => flows[*i],
        Expression::Negative(a) | Expression::Delay(a, _) => of(a),
        Expression::Binary(operator, a, b) => {
            let (a, b) = (of(a), of(b));
            match operator {
                Operator::Add | Operator::Subtract => a.max(b),
                Operator::Multiply if a == Constant => b,
                Operator::Multiply | Operator::Divide if b == Constant => a,
                _ => constant_or_other(a.max(b)),
            }
        }
        // The function has memory, whatever its arguments are.
        Expression::Call(Function::Play | Function::StickSlip | Function::StayBetween, _) => Other,
        Expression::Call(_, arguments) => {
            constant_or_other(arguments.iter().map(of).max().unwrap_or(Constant))
        }
        Expression::If(condition, a, b) => {
            let mut fixed = true;
            condition.each_variable(&mut |variable| match variable {
                Variable::Parameter(_) => {}
                Variable::Flow(i) => fixed &= flows[i] == Constant,
                Variable::Input(_) | Variable::State(_) => fixed = false,
            });
            fixed &= !condition.any(&|part| matches!(part, Expression::Time));
            if fixed { of(a).max(of(b)) } else { Other }
        }
    }
}
