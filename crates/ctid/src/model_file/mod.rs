//! The model file: plant, effects, columns, known constants.
//!
//! ```
//! let model = ctid::model_file::parse("tank.toml", r#"
//!     plant = "cascaded-tanks"
//!     effects = ["overflow"]
//!
//!     [start]
//!     pump_gain = 4.0
//!
//!     [effect.overflow]
//!     where = "upper"
//!     rim = 8.2
//!     fixed = ["rim"]
//! "#)?;
//! assert_eq!(model.start["overflow.rim"], 8.2);
//! assert_eq!(model.fixed, ["overflow.rim"]);
//!
//! let error = ctid::model_file::parse("tank.toml", "plant = \"single-tank\"\neffects = [\"overflw\"]");
//! assert_eq!(
//!     error.unwrap_err().to_string(),
//!     "tank.toml:2: unknown effect \"overflw\": `ctid effects` lists the catalogue; did you mean overflow?"
//! );
//! # Ok::<(), ctid::Error>(())
//! ```

mod controller;
mod effects;
mod guesses;
mod raw;
mod source;

use std::collections::BTreeMap;
use std::path::Path;

use ct_signals::{Columns, Hold, read_file};
use greybox::PriorValue;
use plants::{Domain, Known, Placed, Plant, Scales, Structure, Term};

use crate::Error;

pub use controller::{ControllerLaw, ControllerSettings};
pub(crate) use effects::{any_structure, vessel};
use raw::Raw;
pub(crate) use raw::RawController;
pub(crate) use source::Source;

/// The largest model file, and the largest file of a term \[bytes\].
pub(crate) const LARGEST: usize = 1024 * 1024;

/// Checked content of a model file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// The plant.
    pub plant: Plant,
    /// The effects that have been added, in the file's order.
    pub effects: Vec<Placed>,
    /// The terms of the user's own that have been added, in the file's order.
    pub terms: Vec<OwnTerm>,
    /// Columns of the records.
    pub columns: Columns,
    /// Constants that are not fitted.
    pub known: Known,
    /// First guesses by name, as [`Structure::parameter_names`] writes it: `alpha`, `overflow.rim`.
    pub start: BTreeMap<String, f64>,
    /// Names of the parameters that keep their value in `start`.
    pub fixed: Vec<String>,
    /// Prior knowledge of parameters, by the same names.
    pub priors: BTreeMap<String, PriorValue>,
    /// The controller of the loop, if known.
    pub controller: Option<ControllerSettings>,
    /// Hold of the input between samples.
    pub hold: Hold,
    /// Tables of effects and terms that are not in the model: `effect.overflow`.
    pub waiting: Vec<String>,
}

/// A user's own term, and its units; empty if the file does not give them.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnTerm {
    /// The term.
    pub term: Term,
    /// Unit of its knots.
    pub at_unit: String,
    /// Unit of its values.
    pub unit: String,
}

impl ModelFile {
    /// The domain of the model, derived from the output's unit.
    #[must_use]
    pub fn domain(&self) -> Domain {
        Domain::of(self.plant, self.columns.output_unit())
    }

    /// The plant with its effects, for the ranges of the data.
    ///
    /// # Errors
    /// None for a model that [`parse`] has returned.
    pub fn structure(&self, scales: Scales) -> Result<Structure, plants::Error> {
        let plant = Structure::new(self.plant, self.known.clone(), scales);
        self.effects
            .iter()
            .try_fold(plant, |structure, &placed| structure.with(placed))
            .and_then(|structure| {
                let mut terms = self.terms.iter();
                terms.try_fold(structure, |structure, own| {
                    structure.with_term(own.term.clone())
                })
            })
    }
}

/// Reads a model file.
///
/// # Errors
/// One line that names the file, the line, what is wrong and the correction.
pub fn read(path: &Path) -> Result<ModelFile, Error> {
    of_text(path, &read_text(path)?)
}

/// Reads the text of the model file at a path.
pub(crate) fn of_text(path: &Path, text: &str) -> Result<ModelFile, Error> {
    let read = parse(&path.display().to_string(), text);
    let named_as_record = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    read.map_err(|error| match error {
        Error::AtLine { file, line, what } if named_as_record => Error::AtLine {
            file,
            line,
            what: format!("{what}; is this the record? --model takes the .toml"),
        },
        error => error,
    })
}

/// The text of a model file.
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    let cannot = |what: String| Error::file(path, what);
    let bytes = read_file(path, LARGEST as u64).map_err(|error| match error {
        ct_signals::Error::Read(ct_signals::ReadError::CannotOpen { source, .. }) => {
            cannot(format!(
                "the model file cannot be opened: {source}; check the path and the permissions"
            ))
        }
        error => error.into(),
    })?;
    let text = String::from_utf8(bytes)
        .map_err(|_| cannot("the model file is not UTF-8 text; save it as UTF-8".to_string()))?;
    // Some editors write a byte-order mark at the beginning.
    Ok(text
        .strip_prefix('\u{feff}')
        .map(str::to_string)
        .unwrap_or(text))
}

/// Reads the text of a model file; `file` names it in messages.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &str, text: &str) -> Result<ModelFile, Error> {
    if text.len() > LARGEST {
        return Err(Error::File {
            file: file.to_string(),
            what: format!(
                "a model file of {} bytes, and {LARGEST} are the most; check that it is the right file",
                text.len()
            ),
        });
    }
    let source = Source { file, text };
    let raw: Raw = toml::from_str(text).map_err(|error| source.syntax(&error))?;
    let plant = source.plant(raw.plant.as_ref())?;
    let known = source.known(plant, &raw.known, raw.columns.outputs.len())?;
    source.check_input_2(
        plant,
        &raw.columns,
        (&known, raw.known.disturbance.as_ref()),
    )?;
    let controller = raw
        .controller
        .as_ref()
        .map(|controller| source.controller(controller))
        .transpose()?;
    let mut model = ModelFile {
        plant,
        effects: Vec::new(),
        terms: Vec::new(),
        columns: raw.columns,
        known,
        start: BTreeMap::new(),
        fixed: Vec::new(),
        priors: BTreeMap::new(),
        controller,
        hold: raw.hold,
        waiting: Vec::new(),
    };
    let settings = source.effect_tables((plant, &model.known), &raw.effect)?;
    let terms = source.terms((plant, &model.known), &raw.term)?;
    for name in &raw.effects {
        if let Some((term, fixed)) = terms.get(name.as_ref().as_str()) {
            if model.terms.iter().any(|on| on.term.name == term.term.name) {
                let what = format!("{} is given twice; keep one of the two", name.as_ref());
                return Err(source.at(name.span().start, what));
            }
            if *fixed {
                let scale = format!("{}.scale", term.term.name);
                model.start.insert(scale.clone(), 1.0);
                model.fixed.push(scale);
            }
            model.terms.push(term.clone());
            continue;
        }
        let site = (plant, &model.known, model.columns.inputs.len() > 1);
        let placed = source.placed(site, &model.effects, name, &settings)?;
        model.effects.push(placed);
    }
    source.start(&mut model, &raw.start)?;
    for placed in &model.effects {
        let Some(setting) = settings.get(placed.effect.id) else {
            continue;
        };
        for (parameter, (value, at)) in &setting.values {
            let name = format!("{}.{parameter}", placed.effect.id);
            if model.start.insert(name.clone(), *value).is_some() {
                return Err(source.at(
                    *at,
                    format!("{name} is given here and under [start]; keep one of the two"),
                ));
            }
            if setting.fixed.contains(parameter) {
                model.fixed.push(name);
            }
        }
    }
    source.priors(&mut model, &raw.prior)?;
    let on = |name: &str| raw.effects.iter().any(|effect| effect.as_ref() == name);
    let effects = settings.keys().map(|name| ("effect", *name));
    let own = terms.keys().map(|name| ("term", name.as_str()));
    let tables = effects.chain(own).filter(|(_, name)| !on(name));
    let tables = tables.map(|(kind, name)| format!("{kind}.{name}"));
    model.waiting.extend(tables);
    Ok(model)
}
