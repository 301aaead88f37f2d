//! Specification of a model: its variables, their definitions and their attributes.

use crate::expression::{Expression, Variable};

/// Attributes of every variable.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct About {
    /// Name of the variable.
    pub name: String,
    /// Unit as written, `W/K`; empty if the text gives none.
    pub unit: String,
    /// Physical quantity as written, `Level`; empty if the text gives none.
    pub quantity: String,
    /// Description of the variable in a few words.
    pub description: String,
    /// Smallest value; minus infinity where the text gives none.
    pub min: f64,
    /// Largest value; infinity where the text gives none.
    pub max: f64,
}

/// Source of a parameter's value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Given {
    /// The parameter is fitted, and its value is the start of a fit.
    Fitted,
    /// The value is measured (`final parameter`).
    Measured,
    /// The value is a constant of nature or of the construction (`constant`).
    Constant,
}

/// A parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name, unit, bounds.
    pub about: About,
    /// Value \[`about.unit`\].
    pub value: f64,
    /// Formula of the value in terms of earlier parameters; `None` for a number.
    pub definition: Option<Expression>,
    /// Whether the parameter is fitted.
    pub given: Given,
}

/// An input: a command, or a measured disturbance.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Name, unit, bounds.
    pub about: About,
}

/// A state, `coefficient der(x) = right`.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Name, unit, bounds.
    pub about: About,
    /// Coefficient of the derivative; `None` if the derivative has no coefficient.
    pub coefficient: Option<Expression>,
    /// The other side of the equation.
    pub right: Expression,
    /// Start of the initial value, in terms of parameters alone; or the value at the first row from an `initial equation`
    /// ([`ModelSpec::is_settled`]).
    pub start: Expression,
    /// The initial value is known, and not fitted.
    pub fixed: bool,
}

/// A named flow: a variable that an expression defines.
#[derive(Debug, Clone, PartialEq)]
pub struct Flow {
    /// Name, unit, bounds.
    pub about: About,
    /// Right-hand side.
    pub value: Expression,
    /// A parameter that depends on other parameters (`final parameter b = 2*a`): it does not change with time.
    pub of_parameters: bool,
}

/// An output: a state or a flow that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Output {
    /// The state or the flow.
    pub variable: Variable,
}

/// A model. Expressions refer to variables by their position here.
///
/// Every expression holds variables by their position here.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSpec {
    /// Name of the model.
    pub name: String,
    /// Description of the model in a few words.
    pub description: String,
    /// Parameters in the order of the text.
    pub parameters: Vec<Parameter>,
    /// Inputs in the order of the text.
    pub inputs: Vec<Input>,
    /// States in the order of the text.
    pub states: Vec<State>,
    /// Flows: those of parameters alone, then the others, each in the order of the text.
    pub flows: Vec<Flow>,
    /// Positions of the flows in an order in which each needs only those before it.
    pub order: Vec<usize>,
    /// Outputs in the order of the text.
    pub outputs: Vec<Output>,
}

impl ModelSpec {
    /// Attributes of a variable.
    ///
    /// # Panics
    /// For a variable of another model.
    #[must_use]
    pub fn about(&self, variable: Variable) -> &About {
        match variable {
            Variable::Parameter(i) => &self.parameters[i].about,
            Variable::Input(i) => &self.inputs[i].about,
            Variable::State(i) => &self.states[i].about,
            Variable::Flow(i) => &self.flows[i].about,
        }
    }

    /// Attributes of the inputs, in order.
    pub fn about_inputs(&self) -> impl Iterator<Item = &About> + Clone {
        self.inputs.iter().map(|input| &input.about)
    }

    /// Attributes of the outputs, in order.
    pub fn about_outputs(&self) -> impl Iterator<Item = &About> + Clone {
        self.outputs
            .iter()
            .map(|output| self.about(output.variable))
    }

    /// All variables: parameters, inputs, states, flows.
    pub fn variables(&self) -> impl Iterator<Item = Variable> + use<> {
        let parameters = (0..self.parameters.len()).map(Variable::Parameter);
        let inputs = (0..self.inputs.len()).map(Variable::Input);
        let states = (0..self.states.len()).map(Variable::State);
        let flows = (0..self.flows.len()).map(Variable::Flow);
        parameters.chain(inputs).chain(states).chain(flows)
    }

    /// The variable of a name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<Variable> {
        self.variables()
            .find(|&variable| self.about(variable).name == name)
    }

    /// Whether a state or a flow is an output.
    #[must_use]
    pub fn is_output(&self, variable: Variable) -> bool {
        self.outputs
            .iter()
            .any(|output| output.variable == variable)
    }

    /// Whether an `initial equation` gives the initial value of a state from inputs, states or flows of the first row: the simulation
    /// computes it, whatever initial value it is given.
    ///
    /// # Panics
    /// For a state of another model.
    #[must_use]
    pub fn is_settled(&self, state: usize) -> bool {
        let mut settled = false;
        self.states[state]
            .start
            .each_variable(&mut |variable| match variable {
                Variable::Parameter(_) => {}
                Variable::Input(_) | Variable::State(_) => settled = true,
                Variable::Flow(i) => settled |= !self.flows[i].of_parameters,
            });
        settled
    }

    /// Whether an equation is an explicit function of time.
    #[must_use]
    pub fn reads_time(&self) -> bool {
        let mut expressions = self.expressions();
        expressions.any(|of| of.any(&|part| *part == Expression::Time))
    }

    /// All expressions that are evaluated over time: flows, then coefficients and right-hand sides of the states.
    pub fn expressions(&self) -> impl Iterator<Item = &Expression> {
        let flows = self.flows.iter().map(|flow| &flow.value);
        let states = self
            .states
            .iter()
            .flat_map(|state| state.coefficient.iter().chain([&state.right]));
        flows.chain(states)
    }
}
