//! The model file of a user's own model, and its records.

mod parse;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ct_model::effects::OwnCandidate;
use ct_model::{About, Model, ModelSpec};
use ct_signals::{
    Channel, ColumnFault, Columns, Conversion, Heading, Hold, OutOfRange, ReadSummary, Reading,
    Record, Unit, csv_header, quoted, read_csv, read_file,
};
use effect_search::{Diagnosis, Kept, MendedGaps, PriorKnowledge, Whole, mend};
use greybox::PriorValue;
use serde::{Deserialize, Serialize};

use super::controller::OwnController;
use super::effects::{self, OwnEffects, RecordNumbers};
use crate::Error;
use crate::edit::own::Findings;
use crate::input::Files;
use crate::look::Look;
use crate::model_file::{self, ModelFile};

/// A model file with `model = "x.mo"`, and the model.
#[derive(Clone)]
pub struct OwnModelFile {
    /// The file's name.
    pub name: String,
    /// The model as written in its text.
    pub base: ModelSpec,
    /// The model; after [`OwnModelFile::mended`], the model with its effects.
    pub model: Model,
    /// Values from a record (ranges, means, durations) that the equations of the effects in the model contain.
    pub effects: OwnEffects,
    /// What of a record the effects in the model are written in.
    pub record_numbers: RecordNumbers,
    /// Path of the model text.
    pub text: PathBuf,
    /// Columns of the inputs and outputs, in the order of the model.
    pub columns: Columns,
    /// Seconds in one unit of the model's time, if it is not that of the time column.
    pub time_unit: Option<f64>,
    /// Parameters that are not fitted.
    pub known: BTreeMap<String, f64>,
    /// Side measurements of parameters.
    pub priors: BTreeMap<String, PriorValue>,
    /// Hold of the inputs between rows.
    pub hold: Hold,
    /// Effects of the user's own.
    pub candidates: BTreeMap<String, OwnCandidate>,
    /// Controllers that drive inputs.
    pub(crate) controllers: Vec<OwnController>,
    /// Entries of the file that are not used.
    pub unused: Vec<String>,
}

/// Settings for a model without a model file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct OwnSettings {
    /// Columns of the inputs and outputs, in the order of the model; the time.
    pub columns: Columns,
    /// Seconds in one unit of the model's time; `None`: that of the time column.
    pub time_unit: Option<f64>,
    /// Parameters that are not fitted \[unit of the text\].
    pub known: BTreeMap<String, f64>,
    /// Side measurements of parameters.
    pub priors: BTreeMap<String, PriorValue>,
    /// Hold of the inputs between rows.
    pub hold: Hold,
    /// Identifiers of the effects that are in the model, in order.
    pub effects: Vec<String>,
    /// Kept values of the effects.
    pub kept: BTreeMap<String, Kept>,
    /// Effects of the user's own.
    pub candidates: BTreeMap<String, OwnCandidate>,
    /// Controllers of the model file that these settings are from.
    pub controllers: Vec<OwnController>,
}

/// Records in the order and units of the model.
#[derive(Debug, Clone)]
pub struct Records {
    /// Fitted records, or their parts if they were cut at gaps.
    pub records: Vec<Record>,
    /// Held-out records, or their parts.
    pub test: Vec<Record>,
    /// Handling of the gaps; `None` if there are none.
    pub gaps: Option<MendedGaps>,
    /// Seconds in one unit of the model's time.
    pub time_unit: f64,
    /// Summary of each record that was read, fitted ones first.
    pub summaries: Vec<ReadSummary>,
}

/// A model file of a plant or of a user's own model.
pub enum AnyModelFile {
    /// The file names one of the plants.
    Plant(Box<ModelFile>),
    /// The file names a model text.
    Own(Box<OwnModelFile>),
}

impl AnyModelFile {
    /// Reads the model file once: it may be a pipe.
    ///
    /// # Errors
    /// As [`model_file::read`]; one line that names the file, the line, what is wrong and the correction.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = model_file::read_text(path)?;
        let table = text.parse::<toml::Table>().ok();
        Ok(if table.is_some_and(|table| table.contains_key("model")) {
            Self::Own(Box::new(OwnModelFile::parse(path, &text)?))
        } else {
            Self::Plant(Box::new(model_file::of_text(path, &text)?))
        })
    }
}

impl AnyModelFile {
    /// The path of the model text that the file names.
    pub(crate) fn text(&self) -> Option<&Path> {
        match self {
            Self::Plant(_) => None,
            Self::Own(file) => Some(&file.text),
        }
    }

    /// Checks that there are records for a plant, whose file holds no values; `path`: its name, `option`: how records are given.
    pub(crate) fn require_records(
        &self,
        path: &Path,
        records: &[PathBuf],
        option: &str,
    ) -> Result<(), Error> {
        match (self, records) {
            (Self::Plant(_), []) => Err(Error::file(
                path,
                format!(
                    "a model file of a plant contains start values, not fitted ones: give the records to fit it to, {option}"
                ),
            )),
            _ => Ok(()),
        }
    }

    /// Warning about a loop that the file declares and that is not simulated; empty if there is none.
    pub fn loop_said(&self, look: Look) -> String {
        match self {
            Self::Plant(_) => String::new(),
            Self::Own(file) => file.loop_said(look),
        }
    }

    /// The model file with its effects inserted into the model.
    ///
    /// # Errors
    /// Where the file lacks a number that they need.
    pub fn with_effects(self) -> Result<Self, Error> {
        Ok(match self {
            Self::Own(file) => Self::Own(Box::new(file.mended(None)?)),
            plant => plant,
        })
    }
}

impl OwnModelFile {
    /// Settings of the model apart from its text.
    #[must_use]
    pub fn settings(&self) -> OwnSettings {
        OwnSettings {
            columns: self.columns.clone(),
            time_unit: self.time_unit,
            known: self.known.clone(),
            priors: self.priors.clone(),
            hold: self.hold,
            effects: self.effects.on.clone(),
            kept: self.effects.kept.clone(),
            candidates: self.candidates.clone(),
            controllers: self.controllers.clone(),
        }
    }

    /// The model file with one more effect, or with updated values of an effect that it has: sizes, start values, and the numbers of its
    /// records. A name that no effect has becomes that of the missing term of the diagnosis.
    ///
    /// # Errors
    /// Where it cannot act in the model, or the diagnosis contains no information about it.
    pub fn with_effect(&self, effect: &str, found: &Diagnosis) -> Result<Self, Error> {
        let (candidate, kept) = Findings::from(found).kept(self, effect)?;
        let mut ids = self.effects.on.clone();
        if !ids.contains(&candidate.id) {
            ids.push(candidate.id.clone());
        }
        let mut all_kept = self.effects.kept.clone();
        all_kept.insert(candidate.id.clone(), kept);
        let effects = effects::of_ids(&self.base, &self.candidates, (&ids, &all_kept))?;
        Ok(Self {
            effects: OwnEffects {
                fixed: self.effects.fixed.clone(),
                waiting: self.effects.waiting.clone(),
                ..effects
            },
            ..self.clone()
        })
    }

    /// Reads the records of a problem.
    ///
    /// # Errors
    /// One line that names the file, the place and the correction.
    pub fn records(&self, files: &Files) -> Result<Records, Error> {
        let options = ct_signals::ReadOptions {
            hold: self.hold,
            ..files.options.clone()
        };
        let read = |path: &PathBuf, columns: &Columns| -> Result<Reading, Error> {
            let mut reading = read_csv(path, columns, &options).map_err(|e| self.named(e))?;
            reading.record.name = files.name_of(path);
            reading.summary.file.clone_from(&reading.record.name);
            Ok(reading)
        };
        let all = files.data.iter().chain(&files.test).map(|path| {
            if self.controllers.is_empty() {
                return read(path, &self.columns);
            }
            read(path, &self.columns_of_fit(&headings(path)?))
        });
        let all = all.collect::<Result<Vec<Reading>, Error>>()?;
        self.gathered(all, files.data.len(), self.time_unit(&files.data[0])?)
    }

    /// Records in the form of the model, of which the first `fitted` ones are fitted; `time_unit`: seconds in one unit of the model's time.
    ///
    /// # Errors
    /// If the unit of a column has another dimension than its signal.
    pub fn gathered(
        &self,
        mut all: Vec<Reading>,
        fitted: usize,
        time_unit: f64,
    ) -> Result<Records, Error> {
        for reading in &mut all {
            self.convert(&mut reading.record, &mut reading.summary)?;
        }
        let (mut all, summaries): (Vec<Record>, Vec<_>) = all
            .into_iter()
            .map(|reading| (reading.record, reading.summary))
            .unzip();
        crate::input::on_one_clock(&mut all);
        crate::input::check_clocks(&all[..fitted], &summaries)?;
        let mut test = all.split_off(fitted);
        // Only a model that needs its loop runs in that of a held-out record: a gap in a reference does not cut the record.
        for record in &mut test {
            if record.references.iter().any(|r| r.missing() > 0) {
                record.references.clear();
            }
        }
        let prior = PriorKnowledge {
            model: &self.model,
            known: &self.known,
            priors: &self.priors,
            time_unit,
        };
        let Whole {
            records,
            test,
            gaps,
        } = mend((all, test), prior)?;
        Ok(Records {
            records,
            test,
            gaps,
            time_unit,
            summaries,
        })
    }

    /// An error of the columns with the correction for this model, whose signals have names of their own under `[columns]`.
    pub fn named(&self, error: ct_signals::Error) -> Error {
        let ct_signals::Error::Read(ct_signals::ReadError::Column { file, row, fault }) = &error
        else {
            return error.into();
        };
        let ColumnFault::Missing { wanted, .. } = &**fault else {
            return error.into();
        };
        let columns = self.columns.inputs.iter().chain(&self.columns.outputs);
        let mut signals = columns.zip(self.signals());
        let own = signals.find(|(column, _)| *wanted == format!("\"{}\"", quoted(column)));
        match own {
            None => error.into(),
            Some((_, about)) => {
                let mend = format!("set {} = \"...\" under [columns]", about.name);
                Error::Columns(format!(
                    "{file}, row {row}{}",
                    fault.said("[columns]", &mend)
                ))
            }
        }
    }

    /// Converts the channels to the units of the model, if the model file gives other ones, and renames them: results have the names of the
    /// model's signals. The summary tells of the conversions, and of inputs outside the range that the model declares.
    ///
    /// # Errors
    /// Where a column is in a unit of another dimension.
    pub fn convert(&self, record: &mut Record, summary: &mut ReadSummary) -> Result<(), Error> {
        record.references = self.references_of(record, summary)?;
        let channels = record.inputs.iter_mut().chain(&mut record.outputs);
        for (channel, about) in channels.zip(self.signals()) {
            convert(summary, channel, about)?;
            channel.name.clone_from(&about.name);
        }
        let inputs = record.inputs.iter().zip(self.model.spec().about_inputs());
        let outside =
            inputs.filter_map(|(channel, about)| OutOfRange::find(channel, about.min, about.max));
        summary.out_of_range.extend(outside);
        Ok(())
    }

    /// Inputs and outputs in the order of the model.
    pub fn signals(&self) -> impl Iterator<Item = &About> {
        let spec = self.model.spec();
        spec.about_inputs().chain(spec.about_outputs())
    }

    /// Unit of an input or output; empty if none has this name.
    pub(crate) fn unit_of(&self, signal: &str) -> &str {
        let own = self.signals().find(|about| about.name == signal);
        own.map_or("", |about| about.unit.as_str())
    }
}

/// The columns of a record.
pub(super) fn headings(path: &Path) -> Result<Vec<Heading>, Error> {
    let content = read_file(path, ct_signals::LARGEST_RECORD)?;
    Ok(csv_header(&path.display().to_string(), &content)?)
}

/// Puts a channel of a record into the unit of the model's signal; the summary of the record tells of it.
///
/// # Errors
/// Where its unit is of another dimension.
pub(super) fn convert(
    summary: &mut ReadSummary,
    channel: &mut Channel,
    about: &About,
) -> Result<(), Error> {
    let blame = |what| Error::File {
        file: summary.file.clone(),
        what,
    };
    let conversion = conversion(about, &channel.name, &channel.unit).map_err(blame)?;
    if let Some(conversion) = conversion.filter(|conversion| !conversion.is_identity()) {
        let values = channel.values.iter_mut();
        values.for_each(|value| *value = conversion.apply(*value));
        summary.add_conversion(&channel.name, &channel.unit, &about.unit);
    }
    channel.unit.clone_from(&about.unit);
    Ok(())
}

/// Conversion of a column's values to the unit of a signal; `None` if the units are equal or one of them is not known.
///
/// # Errors
/// If the units cannot be converted; the message says why.
pub(crate) fn conversion(
    about: &About,
    column: &str,
    unit: &str,
) -> Result<Option<Conversion>, String> {
    if about.unit.is_empty() || unit.is_empty() || unit == about.unit {
        return Ok(None);
    }
    let units = Unit::parse(unit).zip(Unit::parse(&about.unit));
    let conversion = units.and_then(|(from, to)| from.conversion_to(&to));
    conversion.map(Some).ok_or_else(|| {
        format!(
            "column \"{column}\" is in {unit}, but {} of the model is in {}: correct the unit in the header, or in the model",
            about.name, about.unit
        )
    })
}

/// Reads the text of a model.
///
/// # Errors
/// One line that names the file, line and column, what is wrong and the correction.
pub(crate) fn read_model(path: &Path) -> Result<ModelSpec, Error> {
    let text = model_file::read_text(path)?;
    ModelSpec::parse_to_simulate(&text).map_err(|source| Error::Text {
        file: path.display().to_string(),
        source,
    })
}
