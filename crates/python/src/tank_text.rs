//! One of the plants as the text of a model.

use std::collections::BTreeMap;

use ct_model::{Expression, Given, ModelSpec};
use ctid::model_file::ModelFile;
use pyo3::prelude::*;

use crate::error;

/// The plant's text with what is known, these values of its parameters and initial levels, and the outputs that are read.
pub fn spec(file: &ModelFile, values: &BTreeMap<String, f64>) -> PyResult<ModelSpec> {
    let plant = file.plant;
    let on: Vec<&str> = file.effects.iter().map(|placed| placed.effect.id).collect();
    let terms = file.terms.iter().map(|own| own.term.name.as_str());
    let on = on.into_iter().chain(terms).collect::<Vec<_>>();
    if !on.is_empty() {
        return Err(error::of_model(format!(
            "the text of {} has no {}: an effect of a tank has neither text nor matrices; write the balance as a model of your own, or take the tank without it",
            plant.id(),
            on.join(", ")
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
