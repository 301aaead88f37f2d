//! Names looked up, equations matched to their variables, and everything checked that can be.

mod declaration;
mod expression;
mod scope;

use std::collections::{BTreeMap, BTreeSet};

pub(crate) use self::scope::Scope;
use super::{
    error::TextError, error::shown, names::Names, names::differentiated, sort::sorted,
    start_division::start_division, syntax::Declaration, syntax::Equation, syntax::Kept,
    syntax::Kind, syntax::Node, syntax::Syntax,
};
use crate::expression::Variable;
use crate::spec::{Flow, ModelSpec, Output, State};

pub(crate) fn resolve(text: &str, syntax: Syntax) -> Result<ModelSpec, TextError> {
    resolve_with(text, syntax, true, false)
}

/// Resolves a model for simulation: models that cannot be simulated from their declared starts are an error.
pub(crate) fn resolve_to_simulate(text: &str, syntax: Syntax) -> Result<ModelSpec, TextError> {
    resolve_with(text, syntax, true, true)
}

/// The text of an effect: unused declarations are allowed.
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
    /// Whether every declared variable has to be used.
    all_used: bool,
    /// The simulation has to begin at the declared starts.
    begins: bool,
    spec: ModelSpec,
}

impl ModelSpec {
    /// For each flow, the flows that it depends on; a delay depends on the present value of its argument.
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

    /// Sorts the flows again after a change of equations; returns the flows of a loop if there is one.
    pub(crate) fn sort_flows(&mut self) -> Result<(), Vec<usize>> {
        self.order = sorted(&self.needs())?;
        Ok(())
    }
}

/// Kinds of variables that an expression may contain.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Holds {
    /// Constants and earlier parameters; the parameters do not count as used.
    Numbers,
    /// Constants and earlier parameters.
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
        // Parameters first: a later declaration may use an earlier one.
        for declaration in declarations {
            match self.names.all[&declaration.name] {
                Variable::Parameter(_) => self.parameter(declaration)?,
                Variable::Input(_) => self.input(declaration)?,
                Variable::State(_) | Variable::Flow(_) => {}
            }
        }
        for index in self.names.states.clone() {
            let declaration = &declarations[index];
            // A variable with a derivative is a state.
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

    /// For a simulation, no state that starts at zero may be a divisor.
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
                    "the left side must be one variable, or `der(x)`, or `c*der(x)`: solve the equation for it",
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

    /// A declared variable that is not used is usually a mistake.
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
                    "{} form an algebraic loop: make one of them a state, or solve the equations for it",
                    names.join(" -> ")
                );
                self.error(froms[circle[0]], what)
            }
        }
    }
}
