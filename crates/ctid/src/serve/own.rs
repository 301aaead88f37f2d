//! A user's own model on the page: its text and its model file are kept for the tab, and checked as they are typed.
//!
//! Nothing of it reaches the file system: the `model` that a model file names is the text that the page holds, whatever name stands there.

use std::path::Path;
use std::sync::Arc;

use axum::body::Bytes;
use ct_model::{ModelSpec, TextError};
use ct_signals::{Columns, ReadOptions};
use serde_json::{Value, json};

use super::guard::Refusal;
use super::held::of_diagnosis;
use super::own_design::Designed;
use super::own_findings::{self, Diagnosed};
use crate::look::Look;
use crate::model_file::read_text;
use crate::own_model::{OwnModelFile, report, units};
use crate::{Error, check};

/// Name of the model file in messages and downloads.
pub(super) const FILE: &str = "model.toml";

/// The model of a tab.
#[derive(Debug, Clone, Default)]
pub(super) struct Own {
    /// The text of the model.
    pub text: String,
    /// The model file: columns, known parameters, side measurements.
    pub file: String,
    /// Latest fit.
    pub fit: Option<Fit>,
    /// Latest diagnosis.
    pub diagnosis: Option<Diagnosed>,
    /// The experiment that was designed last.
    pub design: Option<Designed>,
    /// Content of the report: the latest of both.
    pub shown: Option<Arc<report::Document>>,
    /// Columns and hold from the last valid model: a text that is being typed is invalid for a while.
    read: (Columns, ReadOptions),
}

/// A fit.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub id: u64,
    /// Texts and records of the result.
    pub text: String,
    pub file: String,
    pub data: u64,
    /// JSON for the page.
    pub body: Bytes,
}

impl Own {
    /// A model of these texts, without results.
    pub(super) fn of(text: &str, file: &str) -> Self {
        Self {
            text: text.to_string(),
            file: file.to_string(),
            ..Self::default()
        }
    }

    /// The model file from the command line, and its text.
    pub(super) fn read(path: &Path) -> Result<Self, Error> {
        let file = read_text(path)?;
        let table: toml::Table = file.parse().unwrap_or_default();
        let named = table.get("model").and_then(toml::Value::as_str);
        let beside = path.parent().unwrap_or(Path::new(""));
        let beside = beside.join(named.unwrap_or_default());
        let own = Self {
            text: read_text(&beside)?,
            file,
            ..Self::default()
        };
        Ok(own.looked_at())
    }

    fn spec(&self) -> Result<ModelSpec, TextError> {
        ModelSpec::parse(&self.text)
    }

    /// Text and file together.
    ///
    /// # Errors
    /// One line that names the place and the correction.
    pub(super) fn model(&self) -> Result<OwnModelFile, Error> {
        OwnModelFile::parse_with(Path::new(FILE), &self.file, self.named_text())
    }

    /// Columns and hold.
    pub(super) fn layout(&self) -> (Columns, ReadOptions) {
        self.read.clone()
    }

    /// Adds the columns of the texts, if they can be read.
    pub(super) fn looked_at(mut self) -> Self {
        if let Ok(model) = self.model() {
            self.read = (model.columns.clone(), model.hold.into());
        }
        self
    }

    pub(super) fn held(&self) -> usize {
        let fit = self.fit.as_ref();
        let of_fit = |fit: &Fit| fit.body.len() + fit.text.len() + fit.file.len();
        let shown = self
            .shown
            .as_ref()
            .map_or(0, |shown| of_diagnosis(&shown.diagnosis));
        let design = self.design.as_ref().map_or(0, Designed::held);
        self.text.len() + self.file.len() + fit.map_or(0, of_fit) + shown + design
    }

    /// The text instead of the file that a model file names.
    pub(super) fn named_text(&self) -> impl Fn(&Path) -> Result<ModelSpec, Error> {
        |named: &Path| {
            self.spec().map_err(|source| Error::Text {
                file: named.display().to_string(),
                source,
            })
        }
    }

    /// State of the model for the page.
    pub(super) fn state(&self, data: u64) -> Value {
        let spec = self.spec();
        let model = self.model();
        let columns = model.as_ref().ok().map(|model| &model.columns);
        let signals = spec.as_ref().ok().map(|spec| {
            let inputs = spec.about_inputs().map(|about| ("input", about));
            let outputs = spec.about_outputs().map(|about| ("output", about));
            let names = columns
                .iter()
                .flat_map(|c| c.inputs.iter().chain(&c.outputs));
            let mut names = names.map(String::as_str);
            let signals = inputs.chain(outputs).map(|(role, about)| {
                json!({
                    "role": role,
                    "name": about.name,
                    "unit": about.unit,
                    "description": about.description,
                    "column": names.next(),
                })
            });
            signals.collect::<Vec<_>>()
        });
        // An error of the text is also an error of the file, and is reported once.
        let file_error = match (&spec, &model) {
            (Ok(_), Err(error)) => Some(error.to_string()),
            _ => None,
        };
        let unused = model.as_ref().ok().map(|model| model.unused.clone());
        let found = self.diagnosis.as_ref();
        let effects = found.map_or(&[][..], |found| &found.effects);
        let ports = model
            .as_ref()
            .ok()
            .map(|model| own_findings::ports(model, effects));
        let diagnosis = found.map(|found| {
            let mut body = found.body.clone();
            body["id"] = json!(found.id);
            body["of_this_model"] =
                json!(found.text == self.text && found.file == self.file && found.data == data);
            body
        });
        let of_time = model.as_ref().ok().and_then(|model| {
            let unit = model.declared_time_unit()?;
            Some(model.time_unit_warning(unit, Look::plain()))
        });
        let of_time = of_time.unwrap_or_default();
        json!({
            "text": self.text,
            "file": self.file,
            "text_error": spec.as_ref().err().map(ToString::to_string),
            "file_error": file_error,
            "check": spec.as_ref().ok().map(|spec| {
                let look = Look::plain();
                check::said(spec, look)
                    + &units::warnings(None, &self.text, spec, look)
                    + &of_time
            }),
            "time": columns.and_then(|columns| columns.time.clone()),
            "signals": signals,
            "unused": unused,
            "effects": model.as_ref().ok().map(|model| model.effects.on.clone()),
            "functions": model.as_ref().ok().map(|model| model.effects.functions.clone()),
            "ports": ports,
            "diagnosis": diagnosis,
            "design": self.design.as_ref().map(|design| &design.body),
            "fit": self.fit.as_ref().map(|fit| fit.id),
            "fitted": self.fit.as_ref().is_some_and(|fit| {
                fit.text == self.text && fit.file == self.file && fit.data == data
            }),
        })
    }
}

/// The refusal where a tab has none.
pub(super) fn no_model() -> Refusal {
    Refusal::input("there is no model of your own yet")
}
