//! Diagnosis of a user's own model for the page: the effects, their ports in the model, and the fall of the error.

use ct_model::{About, ModelSpec};
use effect_search::{Diagnosis, Step};
use serde_json::{Value, json};

use crate::edit::own::Findings;
use crate::numbers;
use crate::own_model::report::missing_term;
use crate::own_model::words::{EffectWords, Site};
use crate::own_model::{OwnModelFile, diagnosis_heading, diagnosis_remaining, sizes};
use crate::report::COMPARED;

/// A diagnosis.
#[derive(Debug, Clone)]
pub(super) struct Diagnosed {
    pub id: u64,
    /// Texts and records of the result.
    pub text: String,
    pub file: String,
    pub data: u64,
    /// Values that the model file keeps.
    pub findings: Findings,
    /// The effects that were added.
    pub effects: Vec<String>,
    /// JSON for the page.
    pub body: Value,
}

/// JSON of a diagnosis for the page.
pub(super) fn body(model: &OwnModelFile, found: &Diagnosis) -> Value {
    let words = EffectWords::of(model);
    let one = |id: &String| json!({ "effect": id, "placed": words.placed(id), "physics": words.physics(id) });
    let groups = found.groups.iter().filter_map(|group| {
        let (first, others) = group.split_first()?;
        let mut shown = one(first);
        shown["sizes"] = json!(sizes(found, first));
        shown["others"] = others.iter().map(one).collect();
        Some(shown)
    });
    let errors = |step: &Step| -> Vec<String> {
        let values = step.rmse_per_output.values();
        values.map(|rmse| numbers::significant(*rmse, 3)).collect()
    };
    let steps = found.steps.iter().map(|step| {
        let name = step
            .added
            .as_ref()
            .map_or_else(|| found.model.clone(), |effect| format!("+ {effect}"));
        json!({ "name": name, "errors": errors(step) })
    });
    let outputs: Vec<&String> = found
        .steps
        .first()
        .map_or_else(Vec::new, |step| step.rmse_per_output.keys().collect());
    json!({
        "headline": diagnosis_heading(found),
        "sentences": diagnosis_remaining(model, found),
        "groups": groups.collect::<Vec<_>>(),
        "outputs": outputs.iter().map(|name| json!({ "name": name, "unit": model.unit_of(name) })).collect::<Vec<_>>(),
        "steps": steps.collect::<Vec<_>>(),
        "unknown": found.unknown.as_ref().map(|unknown| missing_term(&words, unknown)),
        "compared": COMPARED,
        "candidates": found.candidates,
        "seconds": found.seconds,
    })
}

/// The ports of a model, each with the effects that are in the model and those that were found.
pub(super) fn ports(model: &OwnModelFile, found: &[String]) -> Value {
    let spec = &model.base;
    let words = EffectWords::of(model);
    let ports = listed(spec);
    let ports = ports.iter().map(|(site, about)| {
        let here = |ids: &[String]| -> Vec<String> {
            let sits = |id: &&String| words.sites(id).contains(site);
            ids.iter().filter(sits).cloned().collect()
        };
        json!({
            "kind": site.kind(),
            "name": about.name,
            "unit": about.unit,
            "description": about.description,
            "on": here(&model.effects.on),
            "found": here(found),
        })
    });
    ports.collect()
}

fn listed(spec: &ModelSpec) -> Vec<(Site, &About)> {
    let inputs = spec.about_inputs();
    let inputs = inputs.map(|about| (Site::Input(about.name.clone()), about));
    let outputs = spec.about_outputs();
    let outputs = outputs.map(|about| (Site::Output(about.name.clone()), about));
    let states = spec.states.iter().map(|state| &state.about);
    let states = states.map(|about| (Site::Equation(about.name.clone()), about));
    let values = spec.ports().values;
    let values = values.into_iter().filter_map(|port| match port {
        ct_model::effects::Port::Value(v) => {
            Some((Site::Value(spec.about(v).name.clone()), spec.about(v)))
        }
        _ => None,
    });
    inputs.chain(outputs).chain(states).chain(values).collect()
}
