//! Names looked up, equations matched to their variables, and everything checked that can be.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    error::{TextError, shown},
    names::{Names, differentiated, is_near},
    sort::sorted,
    start_division::start_division,
    syntax::{Attribute, Declaration, Equation, Kept, Kind, Node, Syntax},
};
use crate::expression::{Condition, Expression, Function, Variable};
use crate::spec::{About, Flow, Given, Input, ModelSpec, Output, Parameter, State};

pub(crate) fn resolve(text: &str, syntax: Syntax) -> Result<ModelSpec, TextError> {
    resolve_with(text, syntax, true, false)
}

/// The same, and what cannot be simulated from its declared starts is refused.
pub(crate) fn resolve_to_simulate(text: &str, syntax: Syntax) -> Result<ModelSpec, TextError> {
    resolve_with(text, syntax, true, true)
}

/// The text of an effect: it may declare what it does not use.
pub(crate) fn resolve_effect(text: &str, syntax: Syntax) -> Result<ModelSpec, TextError> {
    resolve_with(text, syntax, false, false)
}

fn resolve_with(
    text: &str,
    syntax: Syntax,
    all_used: bool,
    begins: bool,
) -> Result<ModelSpec, TextError> {
    let names = Names::of(text, &syntax)?;
    let builder = Builder {
        text,
        names,
        used: BTreeSet::new(),
        all_used,
        begins,
        spec: ModelSpec {
            name: syntax.name,
            description: syntax.description,
            parameters: Vec::new(),
            inputs: Vec::new(),
            states: Vec::new(),
            flows: Vec::new(),
            order: Vec::new(),
            outputs: Vec::new(),
        },
    };
    builder.build(&syntax.declarations, syntax.equations, &syntax.initial)
}

struct Builder<'a> {
    text: &'a str,
    names: Names,
    used: BTreeSet<Variable>,
    /// What is declared has to be used.
    all_used: bool,
    /// A simulation has to begin at the declared starts.
    begins: bool,
    spec: ModelSpec,
}

/// Expressions that stand outside a text, in the words of a model.
pub(crate) struct Scope<'a> {
    spec: &'a ModelSpec,
}

impl<'a> Scope<'a> {
    /// The variables of a model.
    pub fn new(spec: &'a ModelSpec) -> Self {
        Self { spec }
    }

    fn builder<'b>(&self, text: &'b str) -> Builder<'b> {
        Builder {
            text,
            names: Names::of_model(self.spec),
            used: BTreeSet::new(),
            all_used: false,
            begins: false,
            spec: self.spec.clone(),
        }
    }

    /// An expression.
    pub fn expression(&self, text: &str) -> Result<Expression, TextError> {
        let node = super::parser::parse_expression(text)?;
        self.builder(text).expression(&node, Holds::Everything)
    }

    /// The equation of a state, `c*der(x) = e`: its coefficient and its right-hand side.
    pub fn equation(
        &self,
        text: &str,
        state: &str,
    ) -> Result<(Option<Expression>, Expression), TextError> {
        let Equation { left, right } = super::parser::parse_equation(text)?;
        let mut builder = self.builder(text);
        let Some((_, coefficient)) = differentiated(&left).filter(|(name, _)| *name == state)
        else {
            let what =
                format!("on the left of this equation stands `der({state})` or `c*der({state})`");
            return builder.error(left.from, what);
        };
        let coefficient = coefficient
            .map(|node| builder.expression(node, Holds::Everything))
            .transpose()?;
        Ok((coefficient, builder.expression(&right, Holds::Everything)?))
    }
}

impl ModelSpec {
    /// The flows that each flow needs; a delayed one too, as its present value goes into the delay.
    fn needs(&self) -> Vec<Vec<usize>> {
        let of = |flow: &Flow| {
            let mut needed = Vec::new();
            flow.value.each_variable(&mut |variable| {
                if let Variable::Flow(i) = variable {
                    needed.push(i);
                }
            });
            needed.sort_unstable();
            needed.dedup();
            needed
        };
        self.flows.iter().map(of).collect()
    }

    /// Sorts the flows anew, after equations have changed; the flows of a circle where there is one.
    pub(crate) fn sort_flows(&mut self) -> Result<(), Vec<usize>> {
        self.order = sorted(&self.needs())?;
        Ok(())
    }
}

/// What an expression may hold.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Holds {
    /// Numbers and parameters that stand before it; these are not used by it.
    Numbers,
    /// Numbers and parameters that stand before it.
    Parameters,
    Everything,
}

impl Builder<'_> {
    fn error<T>(&self, from: usize, what: impl Into<String>) -> Result<T, TextError> {
        Err(TextError::at(self.text, from, what))
    }

    fn build(
        mut self,
        declarations: &[Declaration],
        equations: Vec<Equation>,
        initial: &[Equation],
    ) -> Result<ModelSpec, TextError> {
        let mut initial = self.initial(initial)?;
        let (mut assigned, mut differential) = self.matched(declarations, &equations)?;
        // Parameters first: what is declared above may stand in what is declared below.
        for declaration in declarations {
            match self.names.all[&declaration.name] {
                Variable::Parameter(_) => self.parameter(declaration)?,
                Variable::Input(_) => self.input(declaration)?,
                Variable::State(_) | Variable::Flow(_) => {}
            }
        }
        for index in self.names.states.clone() {
            let declaration = &declarations[index];
            // A state is what a derivative is taken of.
            let Some((coefficient, right)) = differential.remove(&declaration.name) else {
                continue;
            };
            let about = self.about(declaration, &["start", "fixed"])?;
            let (start, fixed) = match initial.remove(declaration.name.as_str()) {
                Some(node) => self.initial_value(declaration, node)?,
                None => self.start(declaration)?,
            };
            let coefficient = coefficient
                .map(|node| self.expression(node, Holds::Everything))
                .transpose()?;
            let right = self.expression(right, Holds::Everything)?;
            self.spec.states.push(State {
                about,
                coefficient,
                right,
                start,
                fixed,
            });
        }
        let mut froms = Vec::new();
        for index in self.names.flows.clone() {
            let declaration = &declarations[index];
            let Some(node) = assigned.remove(declaration.name.as_str()) else {
                let name = shown(&declaration.name);
                return self.error(
                    declaration.from,
                    format!("nothing defines {name}: write `{} = ...;` or an equation with its derivative, or make it an input", declaration.name),
                );
            };
            let of_parameters = declaration.kept == Kept::FinalParameter;
            let about = self.about(declaration, &[])?;
            let holds = if of_parameters {
                Holds::Parameters
            } else {
                Holds::Everything
            };
            let value = self.expression(node, holds)?;
            froms.push(declaration.from);
            self.spec.flows.push(Flow {
                about,
                value,
                of_parameters,
            });
        }
        for declaration in declarations {
            if declaration.kept == Kept::Output {
                let variable = self.names.all[&declaration.name];
                self.spec.outputs.push(Output { variable });
            }
        }
        if self.spec.outputs.is_empty() {
            let what = "the model has no output: declare what is measured, `output Real y = ...;`";
            return self.error(0, what);
        }
        if self.all_used {
            self.unused(declarations)?;
        }
        self.sort(&froms)?;
        if self.begins {
            self.starts(declarations)?;
        }
        Ok(self.spec)
    }

    /// A simulation has to begin: no state that starts at zero may be a divisor.
    fn starts(&self, declarations: &[Declaration]) -> Result<(), TextError> {
        let Some(division) = start_division(&self.spec) else {
            return Ok(());
        };
        let name = &self.spec.states[division.state].about.name;
        let mut all = declarations.iter();
        let declaration = all.find(|declaration| declaration.name == *name);
        let from = declaration.map_or(0, |declaration| {
            let mut attributes = declaration.attributes.iter();
            let start = attributes.find(|(name, ..)| name == "start");
            start.map_or(declaration.from, |(_, from, _)| *from)
        });
        let what = format!(
            "{} starts at 0, and the equation of {} divides by it, {}: give it another start, `Real {name}(start=...)`",
            shown(name),
            shown(&division.of),
            shown(&division.quotient)
        );
        self.error(from, what)
    }

    /// The expression that defines each flow, and coefficient and right-hand side of each state, by name.
    #[allow(clippy::type_complexity, reason = "two tables of nodes")]
    fn matched<'n>(
        &self,
        declarations: &'n [Declaration],
        equations: &'n [Equation],
    ) -> Result<
        (
            BTreeMap<&'n str, &'n Node>,
            BTreeMap<String, (Option<&'n Node>, &'n Node)>,
        ),
        TextError,
    > {
        let mut assigned: BTreeMap<&str, &Node> = BTreeMap::new();
        let mut differential = BTreeMap::new();
        for declaration in declarations {
            let variable = self.names.all[&declaration.name];
            match (&declaration.binding, variable) {
                (Some(binding), Variable::Flow(_)) => {
                    assigned.insert(&declaration.name, binding);
                }
                (Some(binding), Variable::State(_)) => {
                    let what = format!(
                        "{} has an equation with its derivative and a value of its own: keep one of them (its initial value is `start`)",
                        shown(&declaration.name)
                    );
                    return self.error(binding.from, what);
                }
                (Some(binding), Variable::Input(_)) => {
                    let what = format!(
                        "{} is an input, which the records give: leave its value out",
                        shown(&declaration.name)
                    );
                    return self.error(binding.from, what);
                }
                _ => {}
            }
        }
        for Equation { left, right } in equations {
            let twice = |name: &str| {
                format!(
                    "{} is defined twice: keep one of the equations",
                    shown(name)
                )
            };
            if let Some((name, coefficient)) = differentiated(left) {
                match self.names.all.get(name) {
                    None => return self.error(left.from, self.unknown(name)),
                    Some(Variable::State(_)) => {}
                    Some(_) => {
                        let what = format!(
                            "{} has a derivative, but is a parameter or an input: declare it as `Real {name};`",
                            shown(name)
                        );
                        return self.error(left.from, what);
                    }
                }
                if differential
                    .insert(name.to_string(), (coefficient, right))
                    .is_some()
                {
                    return self.error(left.from, twice(name));
                }
                continue;
            }
            let Kind::Name(name) = &left.kind else {
                return self.error(
                    left.from,
                    "on the left stands one variable, or `der(x)`, or `c*der(x)`: solve the equation for it",
                );
            };
            match self.names.all.get(name) {
                None => return self.error(left.from, self.unknown(name)),
                Some(Variable::Flow(_)) => {
                    if assigned.insert(name, right).is_some() {
                        return self.error(left.from, twice(name));
                    }
                }
                Some(Variable::State(_)) => {
                    let what = format!(
                        "{} has an equation with its derivative already: keep one of the two",
                        shown(name)
                    );
                    return self.error(left.from, what);
                }
                Some(Variable::Parameter(_)) => {
                    let what = format!(
                        "{} is a parameter: give its value where it is declared",
                        shown(name)
                    );
                    return self.error(left.from, what);
                }
                Some(Variable::Input(_)) => {
                    let what = format!(
                        "{} is an input, which the records give: declare it as `Real {name};` if this defines it",
                        shown(name)
                    );
                    return self.error(left.from, what);
                }
            }
        }
        Ok((assigned, differential))
    }

    fn unknown(&self, name: &str) -> String {
        let near = self
            .names
            .all
            .keys()
            .filter(|own| is_near(own, name))
            .min_by_key(|own| own.len().abs_diff(name.len()));
        match near {
            Some(near) => format!(
                "{} is not declared: declare it, or did you mean {}?",
                shown(name),
                shown(near)
            ),
            None => format!(
                "{} is not declared: declare it, `parameter Real {name} = ...;` or `input Real {name};`",
                shown(name)
            ),
        }
    }

    fn about(&mut self, declaration: &Declaration, more: &[&str]) -> Result<About, TextError> {
        let mut about = About {
            name: declaration.name.clone(),
            unit: String::new(),
            description: declaration.description.clone(),
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
        };
        let mut seen = BTreeSet::new();
        for (name, from, attribute) in &declaration.attributes {
            if !seen.insert(name.as_str()) {
                return self.error(
                    *from,
                    format!("{} stands here twice: keep one", shown(name)),
                );
            }
            match (name.as_str(), attribute) {
                ("unit", Attribute::Text(unit)) => about.unit.clone_from(unit),
                ("displayUnit" | "quantity", Attribute::Text(_)) => {}
                ("unit" | "displayUnit" | "quantity", Attribute::Value(_)) => {
                    let what = format!("{name} is a text: write {name}=\"...\"");
                    return self.error(*from, what);
                }
                ("min", Attribute::Value(node)) => about.min = self.known_value(node)?,
                ("max", Attribute::Value(node)) => about.max = self.known_value(node)?,
                ("nominal", Attribute::Value(node)) => {
                    self.known_value(node)?;
                }
                (name, Attribute::Value(_)) if more.contains(&name) => {}
                (known @ ("min" | "max" | "nominal" | "start" | "fixed"), Attribute::Text(_)) => {
                    let what = format!("{known} is a value: write it without quotes");
                    return self.error(*from, what);
                }
                ("start" | "fixed", Attribute::Value(_)) => {
                    let what = format!(
                        "{name} is of states; {} is none: write its value behind `=`, or delete {name}",
                        shown(&declaration.name)
                    );
                    return self.error(*from, what);
                }
                _ => {
                    let what = format!(
                        "{} is no attribute of the subset: unit, displayUnit, quantity, min, max, nominal, start and fixed are",
                        shown(name)
                    );
                    return self.error(*from, what);
                }
            }
        }
        if about.min > about.max {
            let what = format!(
                "min = {} is above max = {}: exchange them",
                about.min, about.max
            );
            return self.error(declaration.from, what);
        }
        Ok(about)
    }

    /// The value of an expression of numbers and parameters, which are not used by it.
    fn known_value(&mut self, node: &Node) -> Result<f64, TextError> {
        let expression = self.expression(node, Holds::Numbers)?;
        self.value_of(&expression, node)
    }

    fn value_of(&self, expression: &Expression, node: &Node) -> Result<f64, TextError> {
        if expression.any(&|part| matches!(part, Expression::Variable(Variable::Flow(_)))) {
            let what = "it depends on parameters that are fitted: write numbers, or parameters that are measured";
            return self.error(node.from, what);
        }
        let value = expression.value(0.0, &|variable| self.parameter_value(variable));
        if value.is_finite() {
            return Ok(value);
        }
        self.error(
            node.from,
            format!("it has the value {value}: write an expression with a finite value"),
        )
    }

    /// The declared value of a parameter.
    fn parameter_value(&self, variable: Variable) -> f64 {
        match variable {
            Variable::Parameter(i) => self.spec.parameters[i].value,
            _ => f64::NAN,
        }
    }

    fn parameter(&mut self, declaration: &Declaration) -> Result<(), TextError> {
        let about = self.about(declaration, &["start"])?;
        let start =
            declaration
                .attributes
                .iter()
                .find_map(|(name, _, attribute)| match attribute {
                    Attribute::Value(node) if name == "start" => Some(node),
                    _ => None,
                });
        let Some(node) = declaration.binding.as_ref().or(start) else {
            let what = format!(
                "{} has no value: write `= ...`, where a fit starts",
                shown(&declaration.name)
            );
            return self.error(declaration.from, what);
        };
        let given = match declaration.kept {
            Kept::Constant => Given::Constant,
            Kept::FinalParameter => Given::Measured,
            _ => Given::Fitted,
        };
        // Of a fitted one it is where a fit starts, and no part of the model.
        let holds = match given {
            Given::Fitted => Holds::Numbers,
            Given::Measured | Given::Constant => Holds::Parameters,
        };
        let definition = self.expression(node, holds)?;
        let value = self.value_of(&definition, node)?;
        if value < about.min || value > about.max {
            let what = format!(
                "{} = {value} is outside its bounds {} to {}: correct one of them",
                declaration.name, about.min, about.max
            );
            return self.error(node.from, what);
        }
        let mut of_others = false;
        definition.each_variable(&mut |_| of_others = true);
        self.spec.parameters.push(Parameter {
            about,
            value,
            definition: of_others.then_some(definition),
            given,
        });
        Ok(())
    }

    fn input(&mut self, declaration: &Declaration) -> Result<(), TextError> {
        let about = self.about(declaration, &[])?;
        self.spec.inputs.push(Input { about });
        Ok(())
    }

    /// The initial value of a state, and whether it is known.
    fn start(&mut self, declaration: &Declaration) -> Result<(Expression, bool), TextError> {
        let (mut start, mut fixed) = (Expression::Number(0.0), false);
        for (name, from, attribute) in &declaration.attributes {
            match (name.as_str(), attribute) {
                ("start", Attribute::Value(node)) => {
                    start = self.expression(node, Holds::Parameters)?;
                }
                ("fixed", Attribute::Value(node)) => match node.kind {
                    Kind::Truth(value) => fixed = value,
                    _ => return self.error(*from, "fixed is true or false"),
                },
                _ => {}
            }
        }
        Ok((start, fixed))
    }

    /// The right-hand sides under `initial equation`, by state.
    fn initial<'n>(
        &self,
        equations: &'n [Equation],
    ) -> Result<BTreeMap<&'n str, &'n Node>, TextError> {
        let mut all = BTreeMap::new();
        for Equation { left, right } in equations {
            let name = match &left.kind {
                Kind::Name(name) => name.as_str(),
                _ => "",
            };
            if !matches!(self.names.all.get(name), Some(Variable::State(_))) {
                let what = "on the left of an initial equation stands one state: write `x = ...;`";
                return self.error(left.from, what);
            }
            if all.insert(name, right).is_some() {
                let what = format!("{} has two initial equations: keep one", shown(name));
                return self.error(left.from, what);
            }
        }
        Ok(all)
    }

    /// As [`Self::start`], from an initial equation.
    fn initial_value(
        &mut self,
        declaration: &Declaration,
        node: &Node,
    ) -> Result<(Expression, bool), TextError> {
        let is_start = |(name, ..): &&(String, usize, Attribute)| name == "start";
        if let Some((_, from, _)) = declaration.attributes.iter().find(is_start) {
            let what = format!(
                "{} has a start and an initial equation: keep one of them",
                shown(&declaration.name)
            );
            return self.error(*from, what);
        }
        Ok((self.expression(node, Holds::Everything)?, true))
    }

    fn expression(&mut self, node: &Node, holds: Holds) -> Result<Expression, TextError> {
        let mut part = |node: &Node| self.expression(node, holds).map(Box::new);
        Ok(match &node.kind {
            Kind::Number(value) => Expression::Number(*value),
            Kind::Negative(a) => Expression::Negative(part(a)?),
            Kind::Binary(operator, a, b) => Expression::Binary(*operator, part(a)?, part(b)?),
            Kind::If(condition, a, b) => {
                let (a, b) = (part(a)?, part(b)?);
                Expression::If(Box::new(self.condition(condition, holds)?), a, b)
            }
            Kind::Name(name) => return self.variable(name, node.from, holds),
            Kind::Call(name, arguments) => return self.call(name, arguments, node.from, holds),
            Kind::Truth(_) | Kind::Compare(..) | Kind::Not(_) | Kind::And(..) | Kind::Or(..) => {
                return self.error(
                    node.from,
                    "true or false where a number has to stand: write `if ... then 1 else 0`",
                );
            }
        })
    }

    fn condition(&mut self, node: &Node, holds: Holds) -> Result<Condition, TextError> {
        Ok(match &node.kind {
            Kind::Truth(value) => Condition::Constant(*value),
            Kind::Compare(comparison, a, b) => Condition::Compare(
                *comparison,
                Box::new(self.expression(a, holds)?),
                Box::new(self.expression(b, holds)?),
            ),
            Kind::Not(a) => Condition::Not(Box::new(self.condition(a, holds)?)),
            Kind::And(a, b) => Condition::And(
                Box::new(self.condition(a, holds)?),
                Box::new(self.condition(b, holds)?),
            ),
            Kind::Or(a, b) => Condition::Or(
                Box::new(self.condition(a, holds)?),
                Box::new(self.condition(b, holds)?),
            ),
            Kind::Call(name, arguments) if name == "noEvent" && arguments.len() == 1 => {
                self.condition(&arguments[0], holds)?
            }
            _ => {
                return self.error(
                    node.from,
                    "a number where a condition has to stand: compare it, `x > 0`",
                );
            }
        })
    }

    fn variable(&mut self, name: &str, from: usize, holds: Holds) -> Result<Expression, TextError> {
        if name == "time" {
            if holds != Holds::Everything {
                return self.error(from, "`time` where only numbers and parameters may stand");
            }
            return Ok(Expression::Time);
        }
        let Some(&variable) = self.names.all.get(name) else {
            return self.error(from, self.unknown(name));
        };
        if holds != Holds::Everything {
            let declared = match variable {
                Variable::Parameter(i) => i < self.spec.parameters.len(),
                Variable::Flow(i) if i < self.names.tied => true,
                _ => {
                    let what = format!(
                        "{} is no parameter: only numbers and parameters may stand here",
                        shown(name)
                    );
                    return self.error(from, what);
                }
            };
            if !declared {
                let what = format!(
                    "{} is declared below: declare it before it is used in another value",
                    shown(name)
                );
                return self.error(from, what);
            }
        }
        if holds != Holds::Numbers {
            self.used.insert(variable);
        }
        Ok(Expression::Variable(variable))
    }

    fn call(
        &mut self,
        name: &str,
        arguments: &[Node],
        from: usize,
        holds: Holds,
    ) -> Result<Expression, TextError> {
        let count = |wanted: usize, of: &str| {
            if arguments.len() == wanted {
                return Ok(());
            }
            let what = format!("{name} takes {of}, and {} stand here", arguments.len());
            Err(TextError::at(self.text, from, what))
        };
        match name {
            "der" => self.error(
                from,
                "a derivative stands alone on the left, `der(x) = ...` or `c*der(x) = ...`: name what it is equal to, and use that",
            ),
            "noEvent" => {
                count(1, "one argument")?;
                self.expression(&arguments[0], holds)
            }
            "smooth" => {
                count(2, "an order and an expression")?;
                self.known_value(&arguments[0])?;
                self.expression(&arguments[1], holds)
            }
            "delay" => {
                if holds != Holds::Everything {
                    return self.error(from, "a delay where only numbers and parameters may stand");
                }
                count(2, "an expression and a time")?;
                let delayed = self.expression(&arguments[0], holds)?;
                let by = self.delay_time(&arguments[1])?;
                Ok(Expression::Delay(Box::new(delayed), Box::new(by)))
            }
            _ => {
                let Some(function) = Function::ALL.into_iter().find(|f| f.name() == name) else {
                    let all: Vec<&str> = Function::ALL.iter().map(|f| f.name()).collect();
                    let what = format!(
                        "{} is no function of the subset: {}, delay, noEvent and smooth are",
                        shown(name),
                        all.join(", ")
                    );
                    return self.error(from, what);
                };
                count(
                    function.arguments(),
                    if function.arguments() == 1 {
                        "one argument"
                    } else {
                        "two arguments"
                    },
                )?;
                let arguments = arguments
                    .iter()
                    .map(|argument| self.expression(argument, holds))
                    .collect::<Result<_, _>>()?;
                Ok(Expression::Call(function, arguments))
            }
        }
    }

    /// A dead time: it does not change while the model runs.
    fn delay_time(&mut self, node: &Node) -> Result<Expression, TextError> {
        let by = self.expression(node, Holds::Everything)?;
        let mut constant =
            !by.any(&|part| matches!(part, Expression::Time | Expression::Delay(..)));
        by.each_variable(&mut |variable| constant &= matches!(variable, Variable::Parameter(_)));
        if constant {
            return Ok(by);
        }
        self.error(
            node.from,
            "a dead time of numbers and parameters alone: one that changes is outside the subset",
        )
    }

    /// What is declared and has no part in anything is a mistake more often than not.
    fn unused(&self, declarations: &[Declaration]) -> Result<(), TextError> {
        for declaration in declarations {
            let variable = self.names.all[&declaration.name];
            let kind = match (variable, declaration.kept) {
                (Variable::Parameter(_), _) => "parameter",
                (Variable::Input(_), _) => "input",
                _ => continue,
            };
            if !self.used.contains(&variable) {
                let what = format!(
                    "the {kind} {} is used nowhere: delete it, or write it into an equation",
                    shown(&declaration.name)
                );
                return self.error(declaration.from, what);
            }
        }
        Ok(())
    }

    /// Finds an order of the flows in which each needs only those before it, else as in the text.
    fn sort(&mut self, froms: &[usize]) -> Result<(), TextError> {
        match self.spec.sort_flows() {
            Ok(()) => Ok(()),
            Err(circle) => {
                let mut names: Vec<&str> = circle
                    .iter()
                    .map(|&i| self.spec.flows[i].about.name.as_str())
                    .collect();
                names.push(names[0]);
                let what = format!(
                    "{} depend on each other in a circle: make one of them a state, or solve the equations for it",
                    names.join(" -> ")
                );
                self.error(froms[circle[0]], what)
            }
        }
    }
}
