//! Declarations: attributes, values and initial values.

use std::collections::{BTreeMap, BTreeSet};

use super::{Builder, Holds};
use crate::expression::{Expression, Variable};
use crate::spec::{About, Given, Input, Parameter};
use crate::text::error::{TextError, shown};
use crate::text::syntax::{Attribute, Declaration, Equation, Kept, Kind, Node};

impl Builder<'_> {
    pub(super) fn about(
        &mut self,
        declaration: &Declaration,
        more: &[&str],
    ) -> Result<About, TextError> {
        let mut about = About {
            name: declaration.name.clone(),
            unit: String::new(),
            description: declaration.description.clone(),
            quantity: String::new(),
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
                ("quantity", Attribute::Text(quantity)) => about.quantity.clone_from(quantity),
                ("displayUnit", Attribute::Text(_)) => {}
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
                        "{name} is an attribute of states, and {} is not a state: write its value behind `=`, or delete {name}",
                        shown(&declaration.name)
                    );
                    return self.error(*from, what);
                }
                _ => {
                    let what = format!(
                        "{} is not an attribute of the subset: unit, displayUnit, quantity, min, max, nominal, start and fixed are",
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
    pub(super) fn known_value(&mut self, node: &Node) -> Result<f64, TextError> {
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

    pub(super) fn parameter(&mut self, declaration: &Declaration) -> Result<(), TextError> {
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
        // For a fitted parameter the value is the start of a fit, and not part of the model.
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

    pub(super) fn input(&mut self, declaration: &Declaration) -> Result<(), TextError> {
        let about = self.about(declaration, &[])?;
        self.spec.inputs.push(Input { about });
        Ok(())
    }

    /// The initial value of a state, and whether it is known.
    pub(super) fn start(
        &mut self,
        declaration: &Declaration,
    ) -> Result<(Expression, bool), TextError> {
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
    pub(super) fn initial<'n>(
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
                let what =
                    "the left side of an initial equation must be one state: write `x = ...;`";
                return self.error(left.from, what);
            }
            if all.insert(name, right).is_some() {
                let what = format!("{} has two initial equations: keep one", shown(name));
                return self.error(left.from, what);
            }
        }
        Ok(all)
    }

    /// As [`Self::start`], for an initial equation.
    pub(super) fn initial_value(
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
}
