//! Where effects can act in a model.

use crate::expression::{Expression, Operator, Variable};
use crate::spec::{Given, ModelSpec, Output};

/// A port of a model; positions are those of [`ModelSpec`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Port {
    /// An input.
    Input(usize),
    /// An output, by its position in [`ModelSpec::outputs`].
    Output(usize),
    /// The equation of a state.
    Balance(usize),
    /// A parameter or a named flow.
    Value(Variable),
    /// A parameter or a named flow, and what it depends on.
    Dependence(Variable, Variable),
    /// Two states.
    Between(usize, usize),
    /// An input, and the equation of a state.
    InputAndBalance(usize, usize),
    /// The equation of a state, and another variable in the effect.
    BalanceAnd(usize, Variable),
    /// An output, and another variable in the effect.
    OutputAnd(usize, Variable),
    /// Several places: a candidate of the model file.
    Own,
}

/// Parts of a model that have ports.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ports {
    /// Inputs, outputs and the balance equations of states. An equation that only defines a velocity as the derivative of a position is not
    /// a balance.
    pub single: Vec<Port>,
    /// Parameters that are fitted, and named flows that no fitted parameter scales alone.
    pub values: Vec<Port>,
}

impl Port {
    /// Names of the port's variables, as in an identifier: `u`, `k,T`.
    #[must_use]
    pub fn names(self, spec: &ModelSpec) -> String {
        let of = |variable| spec.about(variable).name.as_str();
        let output = |i: usize| of(spec.outputs[i].variable);
        match self {
            Self::Input(i) => of(Variable::Input(i)).to_string(),
            Self::Output(i) => output(i).to_string(),
            Self::Balance(i) => of(Variable::State(i)).to_string(),
            Self::Value(p) => of(p).to_string(),
            Self::Dependence(p, x) => format!("{},{}", of(p), of(x)),
            Self::Between(a, b) => {
                format!("{},{}", of(Variable::State(a)), of(Variable::State(b)))
            }
            Self::InputAndBalance(u, x) => {
                format!("{},{}", of(Variable::Input(u)), of(Variable::State(x)))
            }
            Self::BalanceAnd(x, a) => format!("{},{}", of(Variable::State(x)), of(a)),
            Self::OutputAnd(y, a) => format!("{},{}", output(y), of(a)),
            Self::Own => String::new(),
        }
    }
}

impl ModelSpec {
    /// Ports of the model.
    #[must_use]
    pub fn ports(&self) -> Ports {
        let inputs = (0..self.inputs.len()).map(Port::Input);
        let outputs = (0..self.outputs.len()).map(Port::Output);
        let balances = (0..self.states.len()).map(Port::Balance);
        let fitted = (0..self.parameters.len())
            .filter(|&i| {
                let variable = Variable::Parameter(i);
                self.parameters[i].given == Given::Fitted
                    && self.occurrences(variable) > 0
                    && !self.is_in_dead_time(variable)
            })
            .map(Variable::Parameter);
        let flows = (0..self.flows.len())
            .filter(|&i| self.is_own_flow(i))
            .map(Variable::Flow);
        Ports {
            single: inputs.chain(outputs).chain(balances).collect(),
            values: fitted.chain(flows).map(Port::Value).collect(),
        }
    }

    /// Coefficients of derivatives that are measured, each with its own state: a measured cross-section or heat capacity is exact at one
    /// value of the state and may differ at others. Coefficients that occur elsewhere too are left out.
    pub(super) fn measured_capacities(&self) -> impl Iterator<Item = Port> {
        let of = |x: usize| match self.states[x].coefficient {
            Some(Expression::Variable(p @ Variable::Parameter(k)))
                if self.parameters[k].given == Given::Measured && self.occurrences(p) == 1 =>
            {
                Some(Port::Dependence(p, Variable::State(x)))
            }
            _ => None,
        };
        (0..self.states.len()).filter_map(of)
    }

    /// The state whose derivative a state is: the position of a speed.
    pub(super) fn speed_of(&self, position: usize) -> Option<usize> {
        let state = &self.states[position];
        match (&state.coefficient, self.behind(&state.right)) {
            (None, Expression::Variable(Variable::State(speed))) => Some(*speed),
            _ => None,
        }
    }

    /// Resolves an expression that is a single flow to the definition of the flow; for an output that equals a state, the result is that
    /// state.
    #[must_use]
    pub fn behind<'a>(&'a self, mut expression: &'a Expression) -> &'a Expression {
        // Flows are sorted, so there is no loop.
        while let Expression::Variable(Variable::Flow(i)) = expression {
            expression = &self.flows[*i].value;
        }
        expression
    }

    /// Number of times that a variable occurs in the equations.
    pub(super) fn occurrences(&self, of: Variable) -> usize {
        let mut count = 0;
        for expression in self.expressions() {
            expression.each_variable(&mut |variable| count += usize::from(variable == of));
        }
        count
    }

    /// Whether the dead time of a delay contains a variable. An effect at it would change the dead time while the model runs, which no
    /// simulation supports.
    fn is_in_dead_time(&self, of: Variable) -> bool {
        let contains = |part: &Expression| {
            let mut found = false;
            if let Expression::Delay(_, by) = part {
                by.each_variable(&mut |variable| found |= variable == of);
            }
            found
        };
        self.expressions()
            .any(|expression| expression.any(&contains))
    }

    /// Whether a flow is more than a reading, an alias, or a product with a fitted parameter that occurs nowhere else.
    fn is_own_flow(&self, i: usize) -> bool {
        let flow = &self.flows[i];
        let variable = Variable::Flow(i);
        if flow.of_parameters || self.is_output(variable) || self.occurrences(variable) == 0 {
            return false;
        }
        let is_read = |output: &Output| match output.variable {
            Variable::Flow(o) => self.flows[o].value == Expression::Variable(variable),
            _ => false,
        };
        // A flow that equals a state is kept: its drift and its steps have no other port.
        let is_alias = match flow.value {
            Expression::Variable(variable) => !matches!(variable, Variable::State(_)),
            _ => false,
        };
        if is_alias || self.outputs.iter().any(is_read) {
            return false;
        }
        let mut factors = Vec::new();
        factors_of(&flow.value, &mut factors);
        let scales = |factor: &&Expression| match factor {
            Expression::Variable(p @ Variable::Parameter(k)) => {
                self.parameters[*k].given == Given::Fitted && self.occurrences(*p) == 1
            }
            _ => false,
        };
        !factors.iter().any(scales)
    }

    /// Whether the equation of a state contains a variable, directly or through flows.
    pub(super) fn depends_on(&self, state: usize, on: Variable) -> bool {
        let mut seen = vec![false; self.flows.len()];
        self.holds(&self.states[state].right, on, &mut seen)
    }

    /// Whether an output contains a variable without a state in between.
    pub(super) fn is_read_directly(&self, variable: Variable) -> bool {
        let mut seen = vec![false; self.flows.len()];
        let mut outputs = self.outputs.iter();
        outputs.any(|output| {
            let reading = Expression::Variable(output.variable);
            self.holds(&reading, variable, &mut seen)
        })
    }

    /// Whether a state, flow or input is a variable or contains it without a state or a delay in between.
    #[must_use]
    pub fn is_direct(&self, read: Variable, on: Variable) -> bool {
        let mut present = self.clone();
        for flow in &mut present.flows {
            flow.value = flow.value.without_delayed();
        }
        let mut seen = vec![false; self.flows.len()];
        present.holds(&Expression::Variable(read), on, &mut seen)
    }

    fn holds(&self, expression: &Expression, on: Variable, seen: &mut [bool]) -> bool {
        let mut found = false;
        let mut flows = Vec::new();
        expression.each_variable(&mut |variable| {
            found |= variable == on;
            if let Variable::Flow(i) = variable {
                flows.push(i);
            }
        });
        found
            || flows.into_iter().any(|i| {
                !std::mem::replace(&mut seen[i], true) && self.holds(&self.flows[i].value, on, seen)
            })
    }
}

/// The factors of a product.
fn factors_of<'a>(expression: &'a Expression, all: &mut Vec<&'a Expression>) {
    match expression {
        Expression::Binary(Operator::Multiply, a, b) => {
            factors_of(a, all);
            factors_of(b, all);
        }
        Expression::Binary(Operator::Divide, a, _) | Expression::Negative(a) => factors_of(a, all),
        other => all.push(other),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn nothing_acts_at_a_dead_time() {
        let spec = ModelSpec::parse(
            "model Late
               parameter Real k = 1;
               parameter Real tau = 3;
               parameter Real share = 0.5;
               input Real u;
               output Real y = x;
               Real x(start=0);
             equation
               der(x) = k*delay(u, share*tau) - x;
             end Late;",
        )
        .unwrap();
        let values = spec.ports().values.into_iter();
        let values: Vec<String> = values.map(|port| port.names(&spec)).collect();
        assert_eq!(values, ["k"]);
    }

    #[test]
    fn a_measured_capacity_varies_with_its_own_state_only() {
        let tanks = |upper: &str, lower: &str| {
            let measured = ["A", "B"].into_iter();
            let used = measured.filter(|name| upper.contains(name) || lower.contains(name));
            let measured: String = used
                .map(|name| format!("final parameter Real {name} = 2;"))
                .collect();
            ModelSpec::parse(&format!(
                "model Tanks
                   {measured}
                   parameter Real k = 1;
                   input Real u;
                   Real h(start=1);
                   output Real y(start=1);
                 equation
                   {upper}*der(h) = u - k*h;
                   {lower}*der(y) = k*h - y;
                 end Tanks;"
            ))
            .unwrap()
        };
        let names = |spec: &ModelSpec| -> Vec<String> {
            let ports = spec.measured_capacities();
            ports.map(|port| port.names(spec)).collect()
        };
        assert_eq!(names(&tanks("A", "B")), ["A,h", "B,y"]);
        // One capacity of two balances, a product, and a fitted one.
        assert!(names(&tanks("A", "A")).is_empty());
        assert_eq!(names(&tanks("2*A", "B")), ["B,y"]);
        assert_eq!(names(&tanks("k", "B")), ["B,y"]);
    }
}
