//! Models as text: reading and writing.

mod error;
mod lexer;
mod names;
mod parser;
mod resolve;
mod sort;
mod syntax;
mod writer;

pub use error::{Position, TextError};

use crate::ModelSpec;

impl ModelSpec {
    /// Reads a model from its text, a flat subset of Modelica (the crate's head says which).
    ///
    /// # Errors
    /// One line with the place in the text, what is wrong and the mend.
    pub fn parse(text: &str) -> Result<Self, TextError> {
        resolve::resolve(text, parser::parse(text)?)
    }
}
