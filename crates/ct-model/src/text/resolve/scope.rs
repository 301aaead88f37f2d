//! Parses expressions outside a model text with the names of a model.

use std::collections::BTreeSet;

use super::{Builder, Holds};
use crate::expression::Expression;
use crate::spec::ModelSpec;
use crate::text::error::TextError;
use crate::text::names::{Names, differentiated};
use crate::text::syntax::Equation;

/// Parser for expressions outside a model text, with the names of a model.
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
        let node = super::super::parser::parse_expression(text)?;
        self.builder(text).expression(&node, Holds::Everything)
    }

    /// The equation of a state, `c*der(x) = e`: its coefficient and its right-hand side.
    pub fn equation(
        &self,
        text: &str,
        state: &str,
    ) -> Result<(Option<Expression>, Expression), TextError> {
        let Equation { left, right } = super::super::parser::parse_equation(text)?;
        let mut builder = self.builder(text);
        let Some((_, coefficient)) = differentiated(&left).filter(|(name, _)| *name == state)
        else {
            let what = format!(
                "the left side of this equation must be `der({state})` or `c*der({state})`"
            );
            return builder.error(left.from, what);
        };
        let coefficient = coefficient
            .map(|node| builder.expression(node, Holds::Everything))
            .transpose()?;
        Ok((coefficient, builder.expression(&right, Holds::Everything)?))
    }
}
