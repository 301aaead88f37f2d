//! One of the plants as the text of a model.

use std::collections::BTreeMap;

use ct_model::{Expression, Given, ModelSpec};
use ctid::model_file::ModelFile;
use pyo3::prelude::*;

use crate::error;

/// What to do with an effect that a plant's text cannot have.
pub const WITHOUT_TEXT: &str =
    "write the balance as a model of your own, or take the tank without this effect";

/// The plant's text with the known constants, the given values of its parameters and initial levels, and its measured outputs.
///
/// Effects at the ports of a text have other parameters than those of the catalogue: a plant with effects needs records
/// ([`crate::tank::TankFit`]).
pub fn spec(file: &ModelFile, values: &BTreeMap<String, f64>) -> PyResult<ModelSpec> {
    let plant = file.plant;
    let terms = file.terms.iter().map(|own| own.term.name.as_str());
    let terms: Vec<&str> = terms.collect();
    let effects = file.effects.iter().map(|placed| placed.effect.id);
    let effects: Vec<&str> = effects.collect();
    if !terms.is_empty() {
        return Err(error::of_model(format!(
            "the text of {} has no place for the term {}; {WITHOUT_TEXT}",
            plant.id(),
            terms.join(", ")
        )));
    }
    if !effects.is_empty() {
        return Err(error::of_model(format!(
            "the text of {} has other parameters for {} than the tank, which have to be fitted: fit it to records first, fit(...).model",
            plant.id(),
            effects.join(", ")
        )));
    }
    let mut spec = plant.spec(&file.known).map_err(error::of_model)?;
    let fitted = spec.parameters.iter().filter(|p| p.given == Given::Fitted);
    let names = fitted.map(|parameter| parameter.about.name.as_str());
    let lacking: Vec<&str> = names.filter(|name| !values.contains_key(*name)).collect();
    if !lacking.is_empty() {
        return Err(error::of_model(format!(
            "{} has no values of {}: fit it first, fit(...).model, or give them as start={{...}}",
            plant.id(),
            lacking.join(", ")
        )));
    }
    for parameter in &mut spec.parameters {
        let value = values.get(parameter.about.name.as_str()).copied();
        parameter.value = value.unwrap_or(parameter.value);
    }
    for state in &mut spec.states {
        if let Some(level) = values.get(&format!("{}(0)", state.about.name)) {
            state.start = Expression::number(*level);
        }
    }
    Ok(spec)
}
