//! `effects = [...]` of a model file with a user's own model, and the kept values in `[effect."lag(u)"]`.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_model::effects::{Candidate, OwnCandidate, Visited, all_effects, apply};
use ct_signals::quoted;
use effect_search::{Kept, all_candidates};
use toml::Spanned;

use super::raw_effects::{RawEffects, Setting, plain};
use super::term::{self, FUNCTION};
use crate::model_file::Source;
use crate::{Error, names};

/// Key of the numbers of the record, next to the names of parameters.
pub(crate) const RECORD: &str = "record";
/// The key of the parameters that are not fitted.
const FIXED: &str = "fixed";

/// Values from a record (ranges, means, durations) that the effects' equations contain: by the effect's identifier, then by name.
pub type RecordNumbers = BTreeMap<String, BTreeMap<String, f64>>;

/// The effects of a model file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OwnEffects {
    /// Identifiers of the effects in the model, in order.
    pub on: Vec<String>,
    /// Values kept from earlier results.
    pub kept: BTreeMap<String, Kept>,
    /// Fixed parameters of the effects, and their values.
    pub fixed: BTreeMap<String, f64>,
    /// Parameters of all effects by their names in the extended model, with the effect of each.
    pub parameters: BTreeMap<String, String>,
    /// Tables of effects that are not in the model.
    pub waiting: Vec<String>,
    /// Smooth functions that have names of the user's choice, in the model or not, by these names: `shape(T,u)`.
    pub functions: BTreeMap<String, String>,
}

/// Reads and checks the effects of a model file.
///
/// # Errors
/// One line that names the file, the line, what is wrong and the correction.
pub(super) fn read(
    spec: &ModelSpec,
    own: &BTreeMap<String, OwnCandidate>,
    (listed, tables): (&[Spanned<String>], &RawEffects),
    source: &Source,
) -> Result<OwnEffects, Error> {
    let mut effects = OwnEffects::default();
    if listed.is_empty() && tables.is_empty() {
        return Ok(effects);
    }
    let mut all = every_candidate(spec, own, &BTreeMap::new())?;
    effects.functions = term::functions(spec, &all, tables, source)?;
    term::append(spec, &mut all, &effects.functions);
    let mut on: Vec<&Candidate> = Vec::new();
    for written in listed {
        let at = written.span().start;
        let candidate = find(spec, &all, written.as_ref()).map_err(|what| source.at(at, what))?;
        if let Some(what) = term::listed_already(&on, candidate) {
            return Err(source.at(at, what));
        }
        on.push(candidate);
    }
    if let (Err(error), Some(first)) = (apply(spec, &on), listed.first()) {
        return Err(source.at(first.span().start, error.to_string()));
    }
    for (written, table) in tables {
        let at = written.span().start;
        let candidate = find(spec, &all, written.as_ref()).map_err(|what| source.at(at, what))?;
        let (mut kept, fixed) = settings(candidate, table, source)?;
        kept.function = effects.functions.get(&candidate.id).cloned();
        if !on.iter().any(|other| other.id == candidate.id) {
            effects.waiting.push(candidate.id.clone());
            continue;
        }
        effects.kept.insert(candidate.id.clone(), kept);
        effects.fixed.extend(fixed);
    }
    effects.parameters = parameters_of(&on);
    effects.on = on.iter().map(|candidate| candidate.id.clone()).collect();
    Ok(effects)
}

/// The effects of these identifiers, each with its kept values.
///
/// # Errors
/// If an effect cannot act in the model, or is listed twice.
pub(super) fn of_ids(
    spec: &ModelSpec,
    own: &BTreeMap<String, OwnCandidate>,
    (ids, kept): (&[String], &BTreeMap<String, Kept>),
) -> Result<OwnEffects, Error> {
    let mut effects = OwnEffects::default();
    if ids.is_empty() {
        return Ok(effects);
    }
    let named = kept.iter().filter_map(|(name, kept)| {
        let function = kept.function.clone()?;
        Some((name.clone(), function))
    });
    effects.functions = named.collect();
    let all = every_candidate(spec, own, &effects.functions)?;
    let mut on: Vec<&Candidate> = Vec::new();
    for written in ids {
        let candidate = find(spec, &all, written).map_err(Error::UnknownEffect)?;
        if let Some(what) = term::listed_already(&on, candidate) {
            return Err(Error::Usage(what));
        }
        on.push(candidate);
    }
    apply(spec, &on).map_err(|error| Error::Usage(error.to_string()))?;
    effects.on = on.iter().map(|candidate| candidate.id.clone()).collect();
    effects.parameters = parameters_of(&on);
    effects.kept = kept.clone();
    Ok(effects)
}

/// Parameters of effects, with the effect of each.
fn parameters_of(on: &[&Candidate]) -> BTreeMap<String, String> {
    let parameters = on.iter().flat_map(|candidate| {
        let names = candidate.parameters.iter().map(|p| p.name.clone());
        names.map(|name| (name, candidate.id.clone()))
    });
    parameters.collect()
}

/// All effects that can act in a model, from the catalogue and from the model file; then the terms of `functions`
/// ([`OwnEffects::functions`]).
///
/// # Errors
/// As [`all_candidates`], which a model file passes first.
pub(crate) fn every_candidate(
    spec: &ModelSpec,
    own: &BTreeMap<String, OwnCandidate>,
    functions: &BTreeMap<String, String>,
) -> Result<Vec<Candidate>, Error> {
    let mut all = all_candidates(spec, &Visited::nominal(spec), &BTreeMap::new(), own)
        .map_err(|error| Error::Columns(error.to_string()))?;
    term::append(spec, &mut all, functions);
    Ok(all)
}

/// The candidate with this identifier.
///
/// # Errors
/// In one line where there is none, with the identifiers that may have been meant.
pub(crate) fn find<'c>(
    spec: &ModelSpec,
    all: &'c [Candidate],
    written: &str,
) -> Result<&'c Candidate, String> {
    let id = plain(written);
    if let Some(found) = all.iter().find(|candidate| candidate.id == id) {
        return Ok(found);
    }
    let name = id.split('(').next().unwrap_or_default();
    let ids = || all.iter().map(|candidate| candidate.id.as_str());
    let ports: Vec<&str> = ids()
        .filter(|id| id.split('(').next() == Some(name))
        .collect();
    let mut near = names::suggestion(&id, ids());
    if near.is_empty() && ports.is_empty() {
        let without_ports = ids().filter_map(|id| id.split('(').next());
        near = names::suggestion(name, without_ports);
    }
    let where_it_acts = match ports.len() {
        0 if all_effects().any(|effect| effect.id == name) => {
            format!("; {name} acts nowhere in {}", spec.name)
        }
        0 => String::new(),
        1..=4 => format!("; {name} may act here: {}", ports.join(", ")),
        count => format!(
            "; {name} may act at {count} ports, such as {}",
            ports[..4].join(", ")
        ),
    };
    Err(format!(
        "\"{}\" is not an effect that can act in {}: `ctid effects --model` lists them{where_it_acts}{near}",
        quoted(written),
        spec.name
    ))
}

type Settings = (Kept, BTreeMap<String, f64>);

/// The table of an effect: its kept values, and its fixed parameters.
fn settings(
    candidate: &Candidate,
    table: &BTreeMap<Spanned<String>, Setting>,
    source: &Source,
) -> Result<Settings, Error> {
    let id = &candidate.id;
    let shorts = || candidate.parameters.iter().map(|p| p.short.as_str());
    let unknown = |at: usize, what: &str, name: &str, known: Vec<&str>| {
        let may = match known.as_slice() {
            [] => "there are none".to_string(),
            known => format!("there are {}", known.join(", ")),
        };
        let near = names::suggestion(name, known);
        Err(source.at(
            at,
            format!("{} is not a {what} of {id}: {may}{near}", quoted(name)),
        ))
    };
    let mut kept = Kept::default();
    let mut fixed_names: Vec<(usize, String)> = Vec::new();
    for (key, setting) in table {
        let (at, name) = (key.span().start, key.as_ref().as_str());
        match (name, setting) {
            (RECORD, Setting::Record(numbers)) => {
                let known = || candidate.record_numbers.keys().copied();
                if let Some(name) = numbers.keys().find(|n| !known().any(|k| k == **n)) {
                    return unknown(at, "number of the record", name, known().collect());
                }
                let mut infinite = numbers.iter().filter(|(_, value)| !value.is_finite());
                if let Some((name, _)) = infinite.next() {
                    return Err(source.at(at, format!("{name} has to be a finite number")));
                }
                kept.numbers.clone_from(numbers);
            }
            (FIXED, Setting::Fixed(names)) => {
                fixed_names.extend(names.iter().map(|name| (at, name.clone())));
            }
            // The terms of the file have been read before.
            (FUNCTION, Setting::Function(_)) => {}
            (RECORD | FIXED, _) => {
                let form = "write record = { duration = 600.0 }, fixed = [\"tau\"], and numbers for parameters";
                return Err(source.at(at, format!("{name} of {id}: {form}")));
            }
            (_, Setting::Start(value)) => {
                if !shorts().any(|short| short == name) {
                    return unknown(at, "parameter", name, shorts().collect());
                }
                if !value.is_finite() {
                    return Err(source.at(at, format!("{name} has to be a finite number")));
                }
                kept.start.insert(name.to_string(), *value);
            }
            _ => return unknown(at, "list or table", name, vec![RECORD, FIXED]),
        }
    }
    let mut fixed = BTreeMap::new();
    for (at, name) in fixed_names {
        let own = candidate.parameters.iter().find(|p| p.short == name);
        let Some(own) = own else {
            return unknown(at, "parameter", &name, shorts().collect());
        };
        let Some(value) = kept.start.get(&name) else {
            return Err(source.at(
                at,
                format!("{name} is fixed and has no value: write {name} = ... beside it"),
            ));
        };
        fixed.insert(own.name.clone(), *value);
    }
    Ok((kept, fixed))
}
