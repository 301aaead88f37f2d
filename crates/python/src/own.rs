//! A user's own model with its values, and frames as its records.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_signals::{Columns, Heading, ReadOptions, Reading};
use ctid::own_model::{OwnModelFile, OwnSettings, Records};
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error;
use crate::frame::Content;

/// A model and, after a fit, its values.
pub struct Inner {
    /// Text for the user.
    pub text: String,
    pub file: OwnModelFile,
    /// Fitted values by name, of parameters and of `x(0)`; empty where nothing was fitted.
    pub values: BTreeMap<String, f64>,
}

/// The model in its pickled form.
#[derive(Serialize, Deserialize)]
pub struct Kept {
    name: String,
    text: String,
    pub settings: OwnSettings,
    values: BTreeMap<String, f64>,
}

impl Inner {
    pub fn kept(&self) -> Kept {
        Kept {
            name: self.file.name.clone(),
            text: self.text.clone(),
            settings: self.file.settings(),
            values: self.values.clone(),
        }
    }

    pub fn of_kept(kept: Kept) -> PyResult<Self> {
        let Kept {
            name,
            text,
            settings,
            values,
        } = kept;
        let spec = parsed(&name, &text)?;
        let file = OwnModelFile::new(&name, spec, settings).map_err(|e| error::of(&e))?;
        Ok(Self { text, file, values })
    }

    /// Frames as records of the model; the fitted ones come first, and `fitted` is their number.
    pub fn records(&self, frames: &[Content], fitted: usize) -> Result<Records, ctid::Error> {
        records(&self.file, frames, fitted)
    }

    /// The model with its effects in it and all values that are known of it.
    pub fn valued(&self) -> Result<ModelSpec, ctid::Error> {
        let mut spec = self.file.mended(None)?.model.spec().clone();
        for parameter in &mut spec.parameters {
            let name = &parameter.about.name;
            let value = self.file.known.get(name).or(self.values.get(name));
            parameter.value = *value.unwrap_or(&parameter.value);
        }
        Ok(spec)
    }
}

/// Frames as records of a model; the fitted ones come first, and `fitted` is their number.
pub fn records(
    file: &OwnModelFile,
    frames: &[Content],
    fitted: usize,
) -> Result<Records, ctid::Error> {
    let options = ReadOptions::from(file.hold);
    let read = |frame: &Content| {
        let headings: Vec<Heading> = frame.headers.iter().map(|h| Heading::of(h)).collect();
        frame.record(&file.columns_of_fit(&headings), &options)
    };
    let all = frames.iter().map(read);
    let all = all.collect::<Result<Vec<Reading>, _>>()?;
    let unit = file.time_unit.unwrap_or_else(|| time_unit(frames));
    file.gathered(all, fitted, unit)
}

/// Seconds in one unit of the time of at least one frame.
fn time_unit(frames: &[Content]) -> f64 {
    let time = frames.first().map(|frame| frame.time.clone());
    let columns = Columns {
        time,
        ..Columns::default()
    };
    columns.time_header().1
}

/// Reads a model text; `name` is its name in messages.
pub fn parsed(name: &str, text: &str) -> PyResult<ModelSpec> {
    ModelSpec::parse_to_simulate(text).map_err(|source| {
        error::of(&ctid::Error::Text {
            file: name.to_string(),
            source,
        })
    })
}
