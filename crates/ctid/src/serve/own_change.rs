//! Changes of a user's own model on the page: begun, typed, loaded from an example, and with more or fewer effects.

use std::path::Path;

use ct_model::ModelSpec;

use super::guard::Refusal;
use super::own::{FILE, Own, no_model};
use super::session::Session;
use super::upload::Upload;
use crate::edit;

/// Initial text of the page.
static TEMPLATE: &str = include_str!("page/template.mo");

/// An example: name, text, model file, record.
type Example = (&'static str, &'static str, &'static str, &'static str);

macro_rules! examples {
    ($($name:literal),*) => {
        [$((
            $name,
            include_str!(concat!("../../models/", $name, ".mo")),
            include_str!(concat!("../../models/", $name, ".toml")),
            include_str!(concat!("../../models/", $name, ".csv")),
        )),*]
    };
}

static EXAMPLES: [Example; 8] = examples!(
    "heated-block",
    "coupled-heaters",
    "quadruple-tank",
    "house",
    "dc-motor",
    "mass-spring",
    "battery",
    "bioreactor"
);

/// A change of the model.
#[derive(Debug, serde::Deserialize)]
#[serde(tag = "do", rename_all = "lowercase")]
pub(super) enum Change {
    /// A user's own model instead of a plant.
    Begin,
    /// Return to the built-in plants.
    End,
    /// Loads an example in place of the present model and records.
    Example { name: String },
    /// Text, model file, or both.
    Write {
        text: Option<String>,
        file: Option<String>,
    },
    /// Sets the column of a signal or of the time.
    Column { signal: String, column: String },
    /// Adds an effect to the model file, with its values from the diagnosis.
    Add { effect: String },
    /// Removes an effect from the model file.
    Remove { effect: String },
}

/// Names of the examples.
pub(super) fn examples() -> Vec<&'static str> {
    EXAMPLES.iter().map(|(name, ..)| *name).collect()
}

/// A minimal model file that only names its text.
fn bare_file(text: &str) -> String {
    let name = ModelSpec::parse(text).map_or("model".to_string(), |spec| spec.name);
    format!("model = \"{name}.mo\"\n\n[columns]\n")
}

/// Changes the model of a tab.
///
/// # Errors
/// Where an example or a signal is not there, or the model file cannot be changed.
pub(super) fn change(session: &mut Session, change: Change) -> Result<(), Refusal> {
    session.stop();
    match change {
        Change::End => session.own = None,
        Change::Begin => {
            let template = || Own::of(TEMPLATE, &bare_file(TEMPLATE));
            session.own.get_or_insert_with(template);
        }
        Change::Example { name } => {
            let example = EXAMPLES.iter().find(|(known, ..)| *known == name);
            let (name, text, file, record) = example.ok_or_else(|| {
                Refusal::input(format!(
                    "there is no example of this name; there are {}",
                    examples().join(", ")
                ))
            })?;
            let upload = Upload::new(&format!("{name}.csv"), false, record.as_bytes().into())?;
            session.own = Some(Own::of(text, file));
            session.take_alone(upload);
        }
        Change::Write { text, file } => {
            let own = session.own.get_or_insert_with(Own::default);
            if let Some(text) = text {
                own.text = text;
            }
            match file {
                Some(file) => own.file = file,
                None if own.file.trim().is_empty() => own.file = bare_file(&own.text),
                None => {}
            }
        }
        Change::Column { signal, column } => {
            let own = session.own.as_mut().ok_or_else(no_model)?;
            own.file = edit::with_column(FILE, &own.file, &signal, &column)?;
        }
        Change::Add { effect } => {
            let own = session.own.as_mut().ok_or_else(no_model)?;
            let model = own.model()?;
            let found = own.diagnosis.as_ref().map(|found| &found.findings);
            let found = found.filter(|found| found.keeps(&model, &effect));
            let path = Path::new(FILE);
            let edited =
                edit::own::with_effect(path, &own.file, &effect, found, &own.named_text())?;
            own.file = edited.text;
        }
        Change::Remove { effect } => {
            let own = session.own.as_mut().ok_or_else(no_model)?;
            let path = Path::new(FILE);
            let edited = edit::own::without_effect(path, &own.file, &effect, &own.named_text())?;
            own.file = edited.text;
        }
    }
    session.own = session.own.take().map(Own::looked_at);
    session.failure = None;
    session.version += 1;
    Ok(())
}

#[cfg(test)]
mod tests;
