//! A user's own model with its fitted values as text, and the curves of its fit.

use ct_model::{Expression, Given, ModelSpec};
use ct_signals::{Heading, ReadSummary, record_names};
use greybox::FitOptions;
use serde::Serialize;

use super::blame::blame;
use super::file::{OwnModelFile, Records};
use super::fitted::{FitLimit, FittedModel};
use crate::Error;
use crate::input::Files;
use crate::numbers;
use crate::output::Found;
use crate::simulate::{Curves, FittedRecord};

/// Output of `ctid export`.
#[derive(Debug, Serialize)]
pub(crate) struct Exported {
    pub schema: u32,
    /// The model's name.
    pub model: String,
    /// The records of the fit; empty if the values are those of the text.
    pub fitted_to: Vec<String>,
    /// What the reader has to know of the fit.
    #[serde(skip)]
    pub warnings: Vec<String>,
    /// The text.
    #[serde(skip)]
    pub text: Option<String>,
    /// The curves.
    #[serde(skip)]
    pub curves: Option<Curves>,
}

impl Found for Exported {
    fn record(&self) -> Option<String> {
        self.curves.as_ref().map(Curves::csv)
    }

    fn model(&self) -> Option<String> {
        self.text.clone()
    }
}

/// The text of a model with its values, and those of `[known]`; `source`: origin, for the first line.
///
/// # Errors
/// Where the model file lacks a number that its effects need.
pub fn text(file: &OwnModelFile, source: &str) -> Result<String, Error> {
    let file = file.mended(None)?;
    let head = [format!(
        "Written by ctid export from {source}; nothing was fitted."
    )];
    Ok(commented(&head, &with_known(&file)))
}

/// A model whose known parameters have their values.
fn with_known(file: &OwnModelFile) -> ModelSpec {
    let mut spec = file.model.spec().clone();
    for parameter in &mut spec.parameters {
        if let Some(value) = file.known.get(&parameter.about.name) {
            parameter.value = *value;
        }
    }
    spec
}

impl FittedModel {
    /// The model's text with its fitted values, and their standard errors in comments; the initial states are those of the first record.
    /// `source`: origin of the model, for the first line.
    ///
    /// # Errors
    /// Where the simulation is not finite at the fit.
    pub fn text(&self, source: &str) -> Result<String, Error> {
        let setup = self.setup()?;
        let known = self.uncertainty(&setup)?;
        let file = self.model();
        let own = &self.records().records;
        let fit = self.estimate();
        let mut spec = with_known(file);
        let count = spec.parameters.len();
        for (parameter, value) in spec.parameters.iter_mut().zip(&fit.x) {
            parameter.value = *value;
        }
        // A simulation begins with the initial states of the first record.
        for (state, value) in spec.states.iter_mut().zip(&fit.x[count..]) {
            if !state.fixed {
                state.start = Expression::number(*value);
            }
        }
        let mut head = vec![format!(
            "Written by ctid export from {source}, fitted to {}.",
            record_names(own).join(", ")
        )];
        head.push("Standard errors (fitted values are below):".to_string());
        for (i, parameter) in spec.parameters.iter().enumerate() {
            let (name, unit) = (&parameter.about.name, &parameter.about.unit);
            let error = known.as_ref().and_then(|known| known.std_error(i));
            let said = match error {
                Some(error) => format!("{} {unit}", numbers::significant(error, 3)),
                None if parameter.given != Given::Fitted || file.known.contains_key(name) => {
                    "known, not fitted".to_string()
                }
                None => "none: at a bound, or not determined".to_string(),
            };
            head.push(format!("  {name}: {}", said.trim_end()));
        }
        if own.len() > 1 && !spec.states.is_empty() {
            let part = match own[0].part {
                0 => String::new(),
                part => format!("part {part} of "),
            };
            head.push(format!(
                "Initial states are those of {part}{}.",
                own[0].name
            ));
        }
        Ok(commented(&head, &spec))
    }
}

/// The model with the values of its text and of `[known]` or, with records, those of a fit to them.
///
/// # Errors
/// One line that names the file, the place and the correction.
pub(crate) fn export(
    file: &OwnModelFile,
    records: Option<(Records, &Files)>,
    options: &FitOptions,
    limit: FitLimit,
) -> Result<(Exported, Vec<ReadSummary>), Error> {
    let mut exported = Exported {
        schema: 1,
        model: file.base.name.clone(),
        fitted_to: Vec::new(),
        warnings: Vec::new(),
        text: None,
        curves: None,
    };
    let source = file.text.file_name().map_or_else(
        || file.text.display().to_string(),
        |name| name.to_string_lossy().into_owned(),
    );
    let Some((records, files)) = records else {
        exported.text = Some(text(file, &source)?);
        return Ok((exported, Vec::new()));
    };
    let fitted = FittedModel::fit(file, records, (options, true), limit)?;
    exported.warnings.extend(fitted.warnings());
    exported.text = Some(fitted.text(&source)?);
    let (file, records) = (fitted.model(), fitted.records());
    let spec = file.model.spec();
    let own = &records.records;
    let Some(model) = fitted.setup()?.simulate(&fitted.estimate().x) else {
        return Err(blame(own, greybox::Error::Stopped));
    };
    let name = |column: &String| Heading::of(column).name;
    let input_names = file.columns.inputs.iter().map(name);
    let output_names = file.columns.outputs.iter().map(name);
    let input_units = spec.about_inputs().map(|u| u.unit.clone());
    let output_units = spec.about_outputs().map(|y| y.unit.clone());
    exported.fitted_to = record_names(own).into_iter().map(String::from).collect();
    exported.curves = Some(Curves {
        inputs: input_names.zip(input_units).collect(),
        outputs: output_names.zip(output_units).collect(),
        records: FittedRecord::all(own, &model, (files, &file.columns))?,
    });
    let unit = records.time_unit;
    exported.warnings.extend(file.other_time_unit(unit));
    Ok((exported, records.summaries.clone()))
}

/// A model's text under comments.
pub(crate) fn commented(head: &[String], spec: &ModelSpec) -> String {
    let comments: String = head.iter().map(|line| format!("// {line}\n")).collect();
    comments + &spec.to_string()
}
