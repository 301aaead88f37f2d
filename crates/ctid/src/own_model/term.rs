//! Terms under a name of the user's choice: `[effect.heat_loss]` with `function = "shape(T,u)"`, a smooth function at a port.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_model::effects::{Candidate, check_term_name};
use ct_signals::quoted;

use super::raw_effects::{RawEffects, Setting, plain};
use crate::model_file::Source;
use crate::{Error, names};

/// Key of the function in the table of a term.
pub(crate) const FUNCTION: &str = "function";

/// The functions of the terms in a model file, by the terms' names. `all`: all effects that can act in the model.
///
/// # Errors
/// One line that names the file, the line, what is wrong and the correction.
pub(super) fn functions(
    spec: &ModelSpec,
    all: &[Candidate],
    tables: &RawEffects,
    source: &Source,
) -> Result<BTreeMap<String, String>, Error> {
    let (mut functions, mut all) = (BTreeMap::new(), all.to_vec());
    for (name, table) in tables {
        let mut settings = table.iter();
        let Some((key, setting)) = settings.find(|(key, _)| key.as_ref() == FUNCTION) else {
            continue;
        };
        let Setting::Function(written) = setting else {
            let what = "function of a term: write function = \"shape(x,u)\"";
            return Err(source.at(key.span().start, what.to_string()));
        };
        let function = function(spec, &all, written);
        let function = function.map_err(|what| source.at(key.span().start, what))?;
        let function = function.clone();
        let term = name.as_ref();
        check_term_name(spec, &all, &function, term)
            .map_err(|what| source.at(name.span().start, format!("{}: {what}", quoted(term))))?;
        functions.insert(term.clone(), function.id.clone());
        all.push(function.named(spec, term));
    }
    Ok(functions)
}

/// The smooth function with this identifier.
///
/// # Errors
/// What is wrong, with the identifier that may have been meant.
pub(crate) fn function<'c>(
    spec: &ModelSpec,
    all: &'c [Candidate],
    written: &str,
) -> Result<&'c Candidate, String> {
    let id = plain(written);
    let shapes = || all.iter().filter(|candidate| candidate.is_shape());
    shapes()
        .find(|candidate| candidate.id == id)
        .ok_or_else(|| {
            let near = names::suggestion(&id, shapes().map(|candidate| candidate.id.as_str()));
            format!(
                "\"{}\" is not a smooth function at a port of {}: take the one that `ctid diagnose` names{near}",
                quoted(written),
                spec.name
            )
        })
}

/// Appends the terms to the effects that can act in a model.
pub(super) fn append(
    spec: &ModelSpec,
    all: &mut Vec<Candidate>,
    functions: &BTreeMap<String, String>,
) {
    let terms = functions.iter().filter_map(|(name, function)| {
        let shape = all.iter().find(|candidate| candidate.id == *function)?;
        Some(shape.clone().named(spec, name))
    });
    let terms: Vec<Candidate> = terms.collect();
    all.extend(terms);
}

/// Why an effect cannot be added to those that are already in the model: it is one of them, under its own name or under that of a term.
pub(super) fn listed_already(on: &[&Candidate], candidate: &Candidate) -> Option<String> {
    let same = |other: &&&Candidate| {
        other.is_shape() && other.effect == candidate.effect && other.port == candidate.port
    };
    if on.iter().any(|other| other.id == candidate.id) {
        return Some(format!("{} is listed twice: once is enough", candidate.id));
    }
    let other = on.iter().find(same)?;
    Some(format!(
        "{} and {} are the same function at the same port: remove one of them",
        other.id, candidate.id
    ))
}
