//! Parser of the model file of a user's own model: keys, columns, and their errors.

use ct_model::{Model, ModelSpec};
use ct_signals::{Columns, Hold, Zone, quoted};
use greybox::PriorValue;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Spanned;

use super::super::{candidates, controller, effects, time_unit};
use super::{OwnModelFile, OwnSettings, read_model};
use crate::model_file::Source;
use crate::own_model::candidates::RawCandidates;
use crate::own_model::controller::RawControllers;
use crate::own_model::effects::{OwnEffects, RecordNumbers};
use crate::own_model::raw_effects::RawEffects;
use crate::{Error, names};

/// The keys of `[columns]` that are no signals of the model.
const OTHER_COLUMNS: [&str; 5] = ["time", "time_unit", "time_format", "time_zone", "missing"];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Raw {
    model: Spanned<String>,
    #[serde(default)]
    effects: Vec<Spanned<String>>,
    #[serde(default)]
    effect: RawEffects,
    #[serde(default)]
    columns: BTreeMap<Spanned<String>, Spanned<Column>>,
    #[serde(default)]
    known: BTreeMap<Spanned<String>, f64>,
    #[serde(default)]
    prior: BTreeMap<Spanned<String>, [f64; 2]>,
    #[serde(default)]
    candidates: RawCandidates,
    #[serde(default)]
    controller: RawControllers,
    #[serde(default)]
    hold: Hold,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "a column's name in quotes, such as \"y [degC]\", or for `missing` a list of words"
)]
pub(super) enum Column {
    Name(String),
    Words(Vec<String>),
}

impl OwnModelFile {
    /// Reads the text of a model file, and the model that it names, with a path relative to the file.
    ///
    /// # Errors
    /// One line that names the file, the line, what is wrong and the correction.
    pub(super) fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        Self::parse_with(path, text, |named| {
            read_model(&path.parent().unwrap_or(Path::new("")).join(named))
        })
    }

    /// Parses a model file; `read` provides the model text for the name in the file.
    ///
    /// # Errors
    /// One line that names the file, the line, what is wrong and the correction.
    pub fn parse_with(
        path: &Path,
        text: &str,
        read: impl FnOnce(&Path) -> Result<ModelSpec, Error>,
    ) -> Result<Self, Error> {
        let file = path.display().to_string();
        let source = Source { file: &file, text };
        let raw: Result<Raw, _> = toml::from_str(text);
        let raw = raw.map_err(|error| match unnamed_controller(text) {
            Some(at) => source.at(
                at,
                "[controller] does not say which input it drives: write [controller.u], with the name of the input for u",
            ),
            None => source.syntax(&error),
        })?;
        let spec = read(Path::new(raw.model.as_ref()))?;
        let own_candidates = candidates::read(&spec, &raw.candidates, &source)?;
        let listed = (&raw.effects[..], &raw.effect);
        let effects = effects::read(&spec, &own_candidates, listed, &source)?;
        let is_parameter = |name: &str| is_parameter(&spec, &effects, name);
        for name in raw.known.keys().chain(raw.prior.keys()) {
            is_parameter(name.as_ref()).map_err(|what| source.at(name.span().start, what))?;
        }
        let columns = columns(&spec, &raw, &source)?;
        let time_unit = declared_time_unit(&raw, &source)?;
        let own = |name: Spanned<String>| name.into_inner();
        let candidates = raw.candidates.keys().map(AsRef::as_ref);
        let candidates = candidates
            .filter(|name: &&String| !effects.on.contains(name))
            .map(|name| format!("candidates.{name}"));
        let waiting = effects.waiting.iter();
        let waiting = waiting.map(|id| format!("effect.\"{id}\""));
        let unused = candidates.chain(waiting).collect();
        let controllers = controller::read(&spec, &raw.controller, &source)?;
        let known = raw.known.into_iter();
        let known = known.map(|(name, value)| (own(name), value));
        Ok(Self {
            name: file.clone(),
            model: Model::new(spec.clone()),
            base: spec,
            record_numbers: RecordNumbers::new(),
            text: path
                .parent()
                .unwrap_or(Path::new(""))
                .join(raw.model.as_ref()),
            columns,
            time_unit,
            known: known.chain(effects.fixed.clone()).collect(),
            priors: raw
                .prior
                .into_iter()
                .map(|(name, [value, std_error])| (own(name), PriorValue { value, std_error }))
                .collect(),
            hold: raw.hold,
            candidates: own_candidates,
            effects,
            controllers,
            unused,
        })
    }

    /// A model with settings instead of a model file; `name` is its name in messages. Columns without a name have the names of the model's
    /// signals.
    ///
    /// # Errors
    /// If a name is not that of a parameter, an effect cannot act in the model, or the numbers of columns are not those of its signals.
    pub fn new(name: &str, spec: ModelSpec, settings: OwnSettings) -> Result<Self, Error> {
        let OwnSettings {
            mut columns,
            time_unit,
            known,
            priors,
            hold,
            effects,
            kept,
            candidates,
            controllers,
        } = settings;
        let effects = effects::of_ids(&spec, &candidates, (&effects, &kept))?;
        for parameter in known.keys().chain(priors.keys()) {
            is_parameter(&spec, &effects, parameter).map_err(Error::Usage)?;
        }
        let inputs: Vec<String> = spec.about_inputs().map(|u| u.name.clone()).collect();
        let outputs: Vec<String> = spec.about_outputs().map(|y| y.name.clone()).collect();
        let own = [
            (&mut columns.inputs, inputs, "inputs"),
            (&mut columns.outputs, outputs, "outputs"),
        ];
        for (given, signals, role) in own {
            if given.is_empty() {
                given.clone_from(&signals);
            }
            if given.len() != signals.len() {
                return Err(Error::Usage(format!(
                    "{} {role} are given, and {} has {} ({}): name a column for each, in this order",
                    given.len(),
                    spec.name,
                    signals.len(),
                    signals.join(", ")
                )));
            }
        }
        columns.without_inputs = spec.inputs.is_empty();
        Ok(Self {
            name: name.to_string(),
            model: Model::new(spec.clone()),
            base: spec,
            record_numbers: RecordNumbers::new(),
            text: PathBuf::from(name),
            columns,
            time_unit,
            known,
            priors,
            hold,
            candidates,
            effects,
            controllers,
            unused: Vec::new(),
        })
    }
}

/// Position of a `[controller]` table without the name of an input. Only built-in plants have such a table.
fn unnamed_controller(text: &str) -> Option<usize> {
    let table = text.parse::<toml::Table>().ok()?;
    let controller = table.get("controller")?.as_table()?;
    let is_setting = |value: &toml::Value| !value.is_table();
    let at = text
        .find("[controller]")
        .or_else(|| text.find("controller"));
    at.filter(|_| controller.values().any(is_setting))
}

/// Checks that a model, or an effect in it, has a parameter of this name.
fn is_parameter(spec: &ModelSpec, effects: &OwnEffects, name: &str) -> Result<(), String> {
    let parameters = spec.parameters.iter().map(|p| p.about.name.as_str());
    let parameters: Vec<&str> = parameters
        .chain(effects.parameters.keys().map(String::as_str))
        .collect();
    if parameters.contains(&name) {
        return Ok(());
    }
    Err(format!(
        "{} is not a parameter of {}: it has {}{}",
        quoted(name),
        spec.name,
        parameters.join(", "),
        names::suggestion(name, parameters.iter().copied())
    ))
}

/// Seconds in the unit of time that `[columns]` gives.
fn declared_time_unit(raw: &Raw, source: &Source) -> Result<Option<f64>, Error> {
    let mut columns = raw.columns.iter();
    let Some((_, unit)) = columns.find(|(key, _)| key.as_ref() == "time_unit") else {
        return Ok(None);
    };
    let seconds = match unit.as_ref() {
        Column::Name(name) => time_unit::seconds(name),
        Column::Words(_) => None,
    };
    let refused = || {
        let what = "the unit of time of the model is none: write time_unit = \"s\", \"ms\", \"min\", \"h\" or \"d\"";
        source.at(unit.span().start, what)
    };
    seconds.ok_or_else(refused).map(Some)
}

/// The columns of the model's signals: those named by `[columns]`, else columns with the signals' names.
pub(super) fn columns(spec: &ModelSpec, raw: &Raw, source: &Source) -> Result<Columns, Error> {
    let inputs: Vec<&str> = spec.about_inputs().map(|u| u.name.as_str()).collect();
    let outputs: Vec<&str> = spec.about_outputs().map(|y| y.name.as_str()).collect();
    for key in raw.columns.keys() {
        let name = key.as_ref().as_str();
        let known = || inputs.iter().chain(&outputs).chain(&OTHER_COLUMNS).copied();
        if !known().any(|known| known == name) {
            return Err(source.at(
                key.span().start,
                format!(
                    "{} is neither an input nor an output of {}: {} may stand under [columns]{}",
                    quoted(name),
                    spec.name,
                    known().collect::<Vec<_>>().join(", "),
                    names::suggestion(name, known())
                ),
            ));
        }
    }
    let given = |name: &str| raw.columns.iter().find(|(key, _)| key.as_ref() == name);
    let one = |name: &str| match given(name) {
        None => Ok(None),
        Some((_, column)) => match column.as_ref() {
            Column::Name(column) => Ok(Some(column.clone())),
            Column::Words(_) => Err(source.at(
                column.span().start,
                format!(
                    "{} is one column: write {} = \"its name\"",
                    quoted(name),
                    quoted(name)
                ),
            )),
        },
    };
    let signals = |names: &[&str]| -> Result<Vec<String>, Error> {
        let all = names
            .iter()
            .map(|name| Ok(one(name)?.unwrap_or_else(|| (*name).to_string())));
        all.collect()
    };
    let time_zone = one("time_zone")?;
    if let (Some(name), Some((_, column))) = (&time_zone, given("time_zone")) {
        Zone::named(name).map_err(|error| source.at(column.span().start, error.to_string()))?;
    }
    let missing = match given("missing").map(|(_, column)| column.as_ref()) {
        None => Vec::new(),
        Some(Column::Name(word)) => vec![word.clone()],
        Some(Column::Words(words)) => words.clone(),
    };
    Ok(Columns {
        time: one("time")?,
        inputs: signals(&inputs)?,
        outputs: signals(&outputs)?,
        references: Vec::new(),
        time_format: one("time_format")?,
        time_zone,
        missing,
        without_inputs: inputs.is_empty(),
    })
}
