//! `ctid add` and `ctid remove`: they edit the `effects = [...]` line of a model file and do not change anything else, including comments
//! and layout.

mod kept;
mod layout;
pub(crate) mod own;
mod term;

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use plants::{Domain, Place, Placed};
use toml_edit::{DocumentMut, Item};

pub(crate) use self::layout::document;
use self::layout::{push, set_place, take_out};
pub use self::term::with_term;
use self::term::with_waiting_term;
use crate::model_file::{self, ModelFile};
use crate::term_file;
use crate::{Error, MessageNames, atomic, names};

/// Adds an effect to a model file; `place` is a vessel or a pump, if there is a choice. Returns a description of the change, in one line.
///
/// # Errors
/// If the effect is unknown, is in the model already, or cannot act on this plant or at this place. The file is not changed then.
pub fn add(path: &Path, effect: &str, place: Option<&str>) -> Result<String, Error> {
    let name = path.display().to_string();
    change(path, |text| {
        match (own::is_own(text), place) {
        (false, _) => with_effect(&name, text, effect, place),
        (true, None) => own::with_effect(path, text, effect, None, &own::beside(path)),
        (true, Some(_)) => Err(Error::Usage(
            "--where is for the built-in plants only: for your own model the effect names its port, as lag(u)"
                .to_string(),
        )),
    }
    })
}

/// Adds a user's own term to a plant, with its shape read from a CSV file; to a user's own model an effect, with its values from a result
/// in JSON, or the missing term of the result under this name. Returns a description of the change, in one line.
///
/// # Errors
/// Where the name is taken or the shape cannot act on this plant, or the result is not one of this model and effect; the file is then as it
/// was.
pub fn add_from(path: &Path, name: &str, from: &Path) -> Result<String, Error> {
    if own::is_own(&model_file::read_text(path)?) {
        let found = own::Findings::read(from)?;
        return change(path, |text| {
            own::with_effect(path, text, name, Some(&found), &own::beside(path))
        });
    }
    let file = path.display().to_string();
    let read = term_file::read(from)?;
    let from = from.display().to_string();
    change(path, |text| with_term(&file, text, name, &from, &read))
}

/// Removes an effect or a term from a model file. Returns a description of the change, in one line.
///
/// # Errors
/// Where the effect is unknown or not on; the file is then as it was.
pub fn remove(path: &Path, effect: &str) -> Result<String, Error> {
    let name = path.display().to_string();
    change(path, |text| {
        if own::is_own(text) {
            own::without_effect(path, text, effect, &own::beside(path))
        } else {
            without_effect(&name, text, effect)
        }
    })
}

/// A changed text and a description of the change, in one line.
pub struct Edited {
    /// The model file's new text.
    pub text: String,
    /// Description of the change.
    pub done: String,
}

/// Serialises changes: of two simultaneous changes, as from two tabs of `ctid serve`, one would be lost.
static CHANGING: Mutex<()> = Mutex::new(());

/// Number of attempts if another program, such as an editor, writes to the file at the same time.
const READINGS: usize = 5;

/// Changes a file's text; its kind of line ends stays. What others have written there meanwhile is kept: the change is then made to
/// that. Returns what was done, in one line.
///
/// # Errors
/// Those of `edit`, those of the file, and [`Error::Changed`] where the file is another at every reading.
pub(crate) fn change(
    path: &Path,
    edit: impl Fn(&str) -> Result<Edited, Error>,
) -> Result<String, Error> {
    let _turn = CHANGING.lock().unwrap_or_else(PoisonError::into_inner);
    let _lock = atomic::lock_beside(path);
    for _ in 0..READINGS {
        let text = model_file::read_text(path)?;
        let edited = edit(&text)?;
        // The editor writes LF; a file with CRLF keeps CRLF.
        let written = if text.contains("\r\n") {
            edited.text.replace("\r\n", "\n").replace('\n', "\r\n")
        } else {
            edited.text
        };
        if atomic::write_if(path, written.as_bytes(), || still(path, &text))? {
            return Ok(edited.done);
        }
    }
    Err(changed(
        &path.display().to_string(),
        "another program keeps writing to it",
    ))
}

/// Replaces the text `from` by a new one, or creates the file.
///
/// # Errors
/// [`Error::Changed`] if the file has another text than `from`.
pub(crate) fn replace(path: &Path, from: &str, text: &str) -> Result<(), Error> {
    let _turn = CHANGING.lock().unwrap_or_else(PoisonError::into_inner);
    let _lock = atomic::lock_beside(path);
    let as_it_was = || !path.exists() || still(path, from);
    if atomic::write_if(path, text.as_bytes(), as_it_was)? {
        return Ok(());
    }
    Err(changed(
        &path.display().to_string(),
        "it has been changed since it was shown",
    ))
}

fn still(path: &Path, text: &str) -> bool {
    model_file::read_text(path).is_ok_and(|now| now == text)
}

/// Error: the file has changed since it was shown.
pub(crate) fn changed(file: &str, what: &str) -> Error {
    Error::Changed {
        file: file.to_string(),
        what: format!("{what}; nothing was written; check the present content and try again"),
    }
}

/// The text of a model file with one more effect; `file` names it in messages.
///
/// # Errors
/// As [`add`].
pub fn with_effect(
    file: &str,
    text: &str,
    effect: &str,
    place: Option<&str>,
) -> Result<Edited, Error> {
    let model = model_file::parse(file, text)?;
    let refuse = |what: String| Error::File {
        file: file.to_string(),
        what,
    };
    if has_table(&document(file, text)?, effect) {
        return with_waiting_term(file, text, effect, &model);
    }
    let effect = names::effect(effect)?;
    if model.effects.iter().any(|on| on.effect.id == effect.id) {
        return Err(refuse(format!(
            "{} is in the model already; `ctid remove {0}` takes it out",
            effect.id
        )));
    }
    let wrong = |error: plants::Error| refuse(error.worded(&MessageNames::PROGRAM.fit.plants));
    Domain::check(effect, model.plant, model.columns.output_unit()).map_err(wrong)?;
    let vessel = place
        .map(|word| model_file::vessel(model.plant, &model.known, effect, word).map_err(&refuse))
        .transpose()?;
    let placed = Placed {
        effect,
        vessel: vessel.unwrap_or(effect.usual_site(model.plant, &model.known)),
    };
    model_file::any_structure(model.plant, &model.known, model.columns.inputs.len() > 1)
        .with(placed)
        .map_err(wrong)?;

    let mut document = document(file, text)?;
    push(&mut document, effect.id);
    if let Some(word) = place {
        set_place(&mut document, effect.id, word).ok_or_else(|| {
            refuse(format!(
                "[effect.{}] is not a table; make it one",
                effect.id
            ))
        })?;
    }
    let text = document.to_string();
    // The new text has to be a valid model file.
    let model = model_file::parse(file, &text)?;
    let placed = model.effects.last().copied().unwrap_or(placed);
    let done = format!(
        "{file}: added {}{}; effects = {}",
        effect.id,
        place_of(&model, placed, place.is_none()),
        list(&model)
    );
    Ok(Edited { text, done })
}

/// The text with a column for a signal under `[columns]`; an empty name removes the column.
///
/// # Errors
/// Where the text is no TOML, or `columns` is no table.
pub(crate) fn with_column(
    file: &str,
    text: &str,
    signal: &str,
    column: &str,
) -> Result<String, Error> {
    let mut document = document(file, text)?;
    let table = document
        .entry("columns")
        .or_insert_with(toml_edit::table)
        .as_table_like_mut()
        .ok_or_else(|| Error::File {
            file: file.to_string(),
            what: "columns has to be a table: write [columns], and a line for each signal below it"
                .to_string(),
        })?;
    match table
        .get_mut(signal)
        .and_then(toml_edit::Item::as_value_mut)
    {
        _ if column.is_empty() => drop(table.remove(signal)),
        Some(said) => {
            // A comment after the value stays.
            let decor = said.decor().clone();
            *said = column.into();
            *said.decor_mut() = decor;
        }
        None => drop(table.insert(signal, toml_edit::value(column))),
    }
    Ok(document.to_string())
}

/// Whether the document has a `[term.X]` table.
fn has_table(document: &DocumentMut, name: &str) -> bool {
    document
        .get("term")
        .and_then(Item::as_table_like)
        .is_some_and(|terms| terms.contains_key(name))
}

/// The text of a model file without an effect or a term; its `[effect.X]` table is kept for later use.
///
/// # Errors
/// As [`remove`].
pub fn without_effect(file: &str, text: &str, effect: &str) -> Result<Edited, Error> {
    let model = model_file::parse(file, text)?;
    let mut document = document(file, text)?;
    let (kind, id) = if has_table(&document, effect) {
        ("term", effect)
    } else {
        ("effect", names::effect(effect)?.id)
    };
    let removed = document
        .get_mut("effects")
        .and_then(Item::as_array_mut)
        .is_some_and(|effects| take_out(effects, id));
    if !removed {
        return Err(Error::File {
            file: file.to_string(),
            what: format!(
                "{} is not in the model, so it cannot be removed; effects = {}",
                id,
                list(&model)
            ),
        });
    }
    let text = document.to_string();
    let model = model_file::parse(file, &text)?;
    let kept = match document.get(kind).and_then(|table| table.get(id)) {
        Some(_) => format!("; [{kind}.{id}] is kept in the file for when it is added again"),
        None => String::new(),
    };
    let done = format!("{file}: removed {}; effects = {}{kept}", id, list(&model));
    Ok(Edited { text, done })
}

/// ` at the upper vessel`, ` at the sensor of the lower tank`, if the plant has several; `assumed` if the user did not name a place.
fn place_of(model: &ModelFile, placed: Placed, assumed: bool) -> String {
    let Some(name) = placed.place_name(model.plant, &model.known) else {
        return String::new();
    };
    let place = match (placed.effect.place, model.plant.joined()) {
        (Place::Vessel, false) => format!("the {name} vessel"),
        (Place::Sensor, _) => format!("the {}", model.domain().sensor_words(name)),
        _ => name.to_string(),
    };
    let other = if assumed {
        "; `--where` says another"
    } else {
        ""
    };
    format!(" at {place}{other}")
}

fn list(model: &ModelFile) -> String {
    let effects = model.effects.iter().map(|on| on.effect.id);
    let terms = model.terms.iter().map(|on| on.term.name.as_str());
    let ids: Vec<&str> = effects.chain(terms).collect();
    format!("{ids:?}")
}

#[cfg(test)]
mod tests;
