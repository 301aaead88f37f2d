//! The model file of one of the plants, as text from Python.

use ct_signals::Heading;
use ctid::model_file::{self, ModelFile};

/// What stands for the model file in messages.
pub const NAME: &str = "the model";

/// Reads and checks the model file.
pub fn parsed(text: &str) -> Result<ModelFile, ctid::Error> {
    model_file::parse(NAME, text)
}

/// Name and unit of a column.
pub fn heading(column: &str) -> (String, String) {
    let Heading { name, unit, .. } = Heading::of(column);
    (name, unit)
}
