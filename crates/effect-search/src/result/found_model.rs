//! The final model of a diagnosis.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_model::effects::{ApplyError, Candidate, Visited, apply};

use crate::{Diagnosis, Error, Kept, Problem, all_candidates};

/// A model with effects in it, in this order, and the parameters that `values` names at these values.
///
/// # Errors
/// If the effects cannot be combined.
pub fn with_effects(
    spec: &ModelSpec,
    effects: &[&Candidate],
    values: &BTreeMap<String, f64>,
) -> Result<ModelSpec, ApplyError> {
    let mut spec = apply(spec, effects)?;
    for parameter in &mut spec.parameters {
        if let Some(value) = values.get(&parameter.about.name) {
            parameter.value = *value;
        }
    }
    Ok(spec)
}

impl Diagnosis {
    /// The model with its effects in it, those that it had already and those that were found, at the values of the last step: to simulate
    /// ([`ct_model::Model::new`]), to print as text, to fit to another record. Initial states stay those of the text.
    ///
    /// `problem`: the one that was diagnosed.
    ///
    /// # Errors
    /// [`Error::UnknownEffect`], [`Error::Own`] and [`Error::Apply`], where it is another problem.
    pub fn model(&self, problem: &Problem) -> Result<ModelSpec, Error> {
        let kept = |id: &String, numbers: &BTreeMap<String, f64>| Kept {
            numbers: numbers.clone(),
            start: BTreeMap::new(),
            function: problem.kept.get(id).and_then(|kept| kept.function.clone()),
        };
        let numbers = self.record_numbers.iter();
        let numbers = numbers.map(|(id, numbers)| (id.clone(), kept(id, numbers)));
        let visited = Visited {
            time_unit: problem.time_unit_name.clone(),
            ..Visited::nominal(&problem.spec)
        };
        let all = all_candidates(
            &problem.spec,
            &visited,
            &numbers.collect(),
            &problem.candidates,
        )?;
        let find = |id: &String| {
            let found = all.iter().find(|candidate| candidate.id == *id);
            found.ok_or_else(|| Error::UnknownEffect { id: id.clone() })
        };
        let effects = problem.effects.iter().chain(&self.effects).map(find);
        let effects = effects.collect::<Result<Vec<&Candidate>, Error>>()?;
        let last = self.steps.last();
        let values = last.into_iter().flat_map(|step| &step.parameters);
        let values = values.map(|found| (found.name.clone(), found.value));
        Ok(with_effects(&problem.spec, &effects, &values.collect())?)
    }
}
