//! Models as text: reading and writing.

mod error;
mod lexer;
mod names;
mod parser;
mod resolve;
mod sort;
mod start_division;
mod syntax;
mod unit_words;
mod writer;

pub use error::{Position, TextError};
pub use unit_words::check_units;

pub(crate) use names::is_reserved;
pub(crate) use resolve::Scope;

use std::collections::BTreeMap;

use crate::ModelSpec;
use syntax::{Kept, Kind, Node};

/// Reads the text of an effect, with these values of constants that it declares.
pub(crate) fn parse_effect(
    text: &str,
    constants: &BTreeMap<&str, f64>,
) -> Result<ModelSpec, TextError> {
    let mut syntax = parser::parse(text)?;
    for declaration in &mut syntax.declarations {
        if declaration.kept != Kept::Constant {
            continue;
        }
        if let Some(value) = constants.get(declaration.name.as_str()) {
            let size = Node::new(Kind::Number(value.abs()), declaration.from);
            declaration.binding = Some(if *value < 0.0 {
                Node::new(Kind::Negative(Box::new(size)), declaration.from)
            } else {
                size
            });
        }
    }
    resolve::resolve_effect(text, syntax)
}

impl ModelSpec {
    /// Reads a model from its text, a flat subset of Modelica (the crate's head says which).
    ///
    /// # Errors
    /// One line with the place in the text, what is wrong and the correction.
    pub fn parse(text: &str) -> Result<Self, TextError> {
        resolve::resolve(text, parser::parse(text)?)
    }

    /// Parses a model that is to be simulated from its declared starts: a division by a state that starts at zero is an error.
    ///
    /// # Errors
    /// As [`ModelSpec::parse`].
    pub fn parse_to_simulate(text: &str) -> Result<Self, TextError> {
        resolve::resolve_to_simulate(text, parser::parse(text)?)
    }
}
