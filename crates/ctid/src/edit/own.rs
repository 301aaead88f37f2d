//! `ctid add` and `ctid remove` of effects at the ports of a user's own model.

use std::collections::BTreeMap;
use std::path::Path;

use ct_model::ModelSpec;
use ct_model::effects::Candidate;
use ct_signals::quoted;
use effect_search::{Diagnosis, Estimate, Kept};
use serde::Deserialize;
use toml_edit::{DocumentMut, InlineTable, Item, Table, value};

use super::Edited;
use super::layout::{document, push, take_out};
use crate::model_file::read_text;
use crate::own_model::effects::{RECORD, every_candidate, find};
use crate::own_model::raw_effects::plain;
use crate::own_model::term::FUNCTION;
use crate::own_model::{OwnModelFile, read_model};
use crate::{Error, term_file};

/// Reads the text that a model file names.
pub(crate) type ReadText<'r> = &'r dyn Fn(&Path) -> Result<ModelSpec, Error>;

/// The parts of the JSON results of `ctid diagnose` and `ctid compare`, for a user's own model, that a model file can keep.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Findings {
    pub(super) model: String,
    steps: Vec<FoundStep>,
    pub(super) unknown: Option<FoundStep>,
    #[serde(default)]
    singles: Vec<FoundSingle>,
    pub(super) record_numbers: BTreeMap<String, BTreeMap<String, f64>>,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct FoundStep {
    /// The effect, of the unexplained function.
    #[serde(default)]
    pub(super) effect: Option<String>,
    parameters: Vec<FoundParameter>,
}

/// Result of one effect added alone to the believed model.
#[derive(Debug, Clone, Deserialize)]
struct FoundSingle {
    sizes: Vec<FoundParameter>,
}

#[derive(Debug, Clone, Deserialize)]
struct FoundParameter {
    name: String,
    value: Option<f64>,
}

impl Findings {
    /// Reads a result.
    ///
    /// # Errors
    /// If the file is not the result of a diagnosis or a comparison of a user's own model.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::of_text(&read_text(path)?).map_err(|what| Error::file(path, what))
    }

    /// Reads the findings from a JSON text.
    ///
    /// # Errors
    /// What is wrong and the correction.
    pub fn of_text(text: &str) -> Result<Self, String> {
        if term_file::is_own(text) {
            // The effect is in quotes, as a comma separates the names of its port.
            let effect = text.lines().nth(1).and_then(|row| row.split('"').nth(1));
            return Err(format!(
                "this is the table of {} that `ctid diagnose --unknown` wrote, without the numbers that a model of your own keeps: write the result with `ctid diagnose --json RESULT.json`, then `ctid add NAME --from RESULT.json`",
                quoted(effect.unwrap_or("shape(x,u)"))
            ));
        }
        serde_json::from_str(text).map_err(|error| {
            format!(
                "this is not a result of a model of your own: give what `ctid diagnose --json` wrote ({error})"
            )
        })
    }

    /// Whether the result contains an effect.
    pub fn has(&self, id: &str) -> bool {
        self.record_numbers.contains_key(id)
    }

    /// The value of a parameter in the last model with this parameter, of the unexplained function, or, for an effect that is in no model,
    /// from its single fit.
    pub(super) fn value(&self, name: &str) -> Option<f64> {
        let steps = self.steps.iter().rev().chain(&self.unknown);
        let steps = steps.flat_map(|step| &step.parameters);
        let singles = self.singles.iter().flat_map(|single| &single.sizes);
        let mut named = steps
            .chain(singles)
            .filter(|parameter| parameter.name == name);
        named.find_map(|parameter| parameter.value)
    }
}

impl From<&Diagnosis> for Findings {
    fn from(found: &Diagnosis) -> Self {
        let all = |parameters: &[Estimate]| -> Vec<FoundParameter> {
            let found = parameters.iter().map(|parameter| FoundParameter {
                name: parameter.name.clone(),
                value: Some(parameter.value).filter(|value| value.is_finite()),
            });
            found.collect()
        };
        let step = |parameters: &[Estimate]| FoundStep {
            effect: None,
            parameters: all(parameters),
        };
        let singles = found.singles.iter().map(|single| FoundSingle {
            sizes: all(&single.sizes),
        });
        Self {
            model: found.model.clone(),
            steps: found.steps.iter().map(|s| step(&s.parameters)).collect(),
            unknown: found.unknown.as_ref().map(|u| FoundStep {
                effect: Some(u.effect.clone()),
                parameters: all(&u.parameters),
            }),
            singles: singles.collect(),
            record_numbers: found.record_numbers.clone(),
        }
    }
}

/// Whether a text is the model file of a user's own model.
pub(super) fn is_own(text: &str) -> bool {
    let table = text.parse::<toml::Table>();
    table.is_ok_and(|table| table.contains_key("model"))
}

/// Finds the text that the model file at this path names.
pub(super) fn beside(path: &Path) -> impl Fn(&Path) -> Result<ModelSpec, Error> {
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    move |named| read_model(&folder.join(named))
}

/// The text of a model file with one more effect; with a result its numbers and its sizes are kept in `[effect."..."]`.
///
/// # Errors
/// If no effect of this name can act in the model, if the model contains it already and no result is given, or if the result does not
/// contain it.
pub(crate) fn with_effect(
    path: &Path,
    text: &str,
    effect: &str,
    from: Option<&Findings>,
    read: ReadText,
) -> Result<Edited, Error> {
    let file = path.display().to_string();
    let refuse = |what: String| Error::File {
        file: file.clone(),
        what,
    };
    let model = OwnModelFile::parse_with(path, text, read)?;
    let (candidate, values) = match from {
        Some(found) => {
            let (candidate, values) = found.kept(&model, effect)?;
            (candidate, Some(values))
        }
        None => {
            let functions = &model.effects.functions;
            let all = every_candidate(&model.base, &model.candidates, functions)?;
            let candidate = find(&model.base, &all, effect).map_err(Error::UnknownEffect)?;
            (candidate.clone(), None)
        }
    };
    let id = &candidate.id;
    let is_on = model.effects.on.contains(id);
    if is_on && from.is_none() {
        return Err(refuse(format!(
            "{id} is in the model already; `ctid remove '{id}'` takes it out, and --from RESULT.json keeps what a result found of it"
        )));
    }
    let mut document = document(&file, text)?;
    if !is_on {
        push(&mut document, id);
    }
    let mut kept = String::new();
    if let Some(values) = &values {
        kept = keep(&mut document, &candidate, values).map_err(&refuse)?;
    }
    let text = document.to_string();
    let model = OwnModelFile::parse_with(path, &text, read)?;
    let verb = if is_on { "kept" } else { "added" };
    let done = format!(
        "{file}: {verb} {id}{kept}; effects = {:?}",
        model.effects.on
    );
    Ok(Edited { text, done })
}

/// Writes a result's values of an effect into its table. Returns a description of them.
fn keep(document: &mut DocumentMut, candidate: &Candidate, kept: &Kept) -> Result<String, String> {
    let id = &candidate.id;
    if kept.start.is_empty() && kept.numbers.is_empty() && kept.function.is_none() {
        return Ok(", of which the result has no size".to_string());
    }
    let no_table = || format!("[effect.\"{id}\"] is not a table; make it one");
    let mut tables = Table::new();
    tables.set_implicit(true);
    let mut own = Table::new();
    own.decor_mut().set_prefix("\n");
    let table = document
        .entry("effect")
        .or_insert(Item::Table(tables))
        .as_table_like_mut()
        .ok_or_else(no_table)?
        .entry(id)
        .or_insert(Item::Table(own))
        .as_table_like_mut()
        .ok_or_else(no_table)?;
    if let Some(function) = &kept.function {
        set(table, FUNCTION, value(function));
    }
    let mut said = Vec::new();
    for parameter in &candidate.parameters {
        let Some(&size) = kept.start.get(&parameter.short) else {
            continue;
        };
        said.push(format!("{} = {size}", parameter.short));
        set(table, &parameter.short, value(size));
    }
    if !kept.numbers.is_empty() {
        let mut inline = InlineTable::new();
        for (name, number) in &kept.numbers {
            inline.insert(name, (*number).into());
        }
        set(table, RECORD, value(inline));
    }
    let of = kept.function.as_ref();
    let of = of.map_or(String::new(), |function| format!(", {function},"));
    Ok(match said.as_slice() {
        [] => format!("{of} with the numbers of its record"),
        said => format!("{of} with {}", said.join(", ")),
    })
}

/// Sets a key; a comment after it stays.
fn set(table: &mut dyn toml_edit::TableLike, key: &str, mut item: Item) {
    let before = table.get(key).and_then(Item::as_value);
    if let (Some(before), Some(new)) = (before, item.as_value_mut()) {
        *new.decor_mut() = before.decor().clone();
    }
    table.insert(key, item);
}

/// The text of a model file without an effect; its `[effect."..."]` table is kept for later use.
///
/// # Errors
/// Where it is not on.
pub(crate) fn without_effect(
    path: &Path,
    text: &str,
    effect: &str,
    read: ReadText,
) -> Result<Edited, Error> {
    let file = path.display().to_string();
    let mut document = document(&file, text)?;
    let wanted = plain(effect);
    // The entry as written in the file, with or without blanks.
    let listed = document.get_mut("effects").and_then(Item::as_array_mut);
    let removed = listed.is_some_and(|effects| {
        let written = effects.iter().filter_map(|on| on.as_str());
        let written = written.map(str::to_string).find(|on| plain(on) == wanted);
        written.is_some_and(|written| take_out(effects, &written))
    });
    if !removed {
        let model = OwnModelFile::parse_with(path, text, read)?;
        return Err(Error::File {
            file,
            what: format!(
                "{wanted} is not in the model, so it cannot be removed; effects = {:?}",
                model.effects.on
            ),
        });
    }
    let text = document.to_string();
    let model = OwnModelFile::parse_with(path, &text, read)?;
    let waits = model.effects.waiting.contains(&wanted);
    let kept = if waits {
        format!("; [effect.\"{wanted}\"] is kept in the file for when it is added again")
    } else {
        String::new()
    };
    let done = format!(
        "{file}: removed {wanted}; effects = {:?}{kept}",
        model.effects.on
    );
    Ok(Edited { text, done })
}
