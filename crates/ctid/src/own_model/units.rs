//! Warnings about the units of a model's text.

use std::path::Path;

use ct_model::{ModelSpec, check_units, unit_warnings};

use super::OwnModelFile;
use crate::look::Look;
use crate::model_file;

/// Unknown units, and equations whose sides have different dimensions, each with its place in the text; then the equations that effects
/// change, which have none. `file`: the text's file if it has one. `model`: that of the text with its effects.
pub(crate) fn warnings(file: Option<&Path>, text: &str, model: &ModelSpec, look: Look) -> String {
    let in_text = check_units(text).unwrap_or_default();
    let in_text = in_text.iter().map(|found| match file {
        Some(file) => format!("{}:{found}", file.display()),
        None => found.to_string(),
    });
    let base = ModelSpec::parse(text).map(|base| unit_warnings(&base));
    let base = base.unwrap_or_default();
    let with_effects = unit_warnings(model).into_iter();
    let with_effects = with_effects
        .filter(|warning| !base.contains(warning))
        .map(|warning| {
            let (of, what) = (warning.of, warning.what);
            format!("units in the equation of {of} with its effects: {what}: correct the unit of a parameter of an effect or candidate")
        });
    in_text
        .chain(with_effects)
        .map(|what| look.warning(format!("warning: {what}")) + "\n")
        .collect()
}

impl OwnModelFile {
    /// [`warnings`] about the text and the effects of this file. A text that cannot be read twice, such as a pipe, was read as a model.
    pub(crate) fn unit_warnings(&self, look: Look) -> String {
        let text = model_file::read_text(&self.text).unwrap_or_default();
        warnings(Some(&self.text), &text, self.model.spec(), look)
    }
}
