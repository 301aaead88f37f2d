//! Input of `compare` and `diagnose`: read and checked completely before the computation.

mod checks;
pub mod excitation;
mod faults;

use std::path::{Path, PathBuf};

use clap::Args;
use ct_signals::{Hold, ReadOptions, ReadSummary, Reading, Record, escaped, quoted, read_csv};
use missing_effect::Problem;

pub(crate) use self::faults::faults;

use self::checks::{
    check_height, check_input, check_levels, check_movement, check_rows, check_terms, check_units,
    controller,
};
use crate::look::Look;
use crate::model_file::{self, ModelFile};
use crate::output::same_file;
use crate::{Error, MessageNames};

/// Error of a record whose file name suggests that it is a model.
fn perhaps_a_model(path: &Path, error: ct_signals::Error) -> Error {
    let named_as_model = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    if named_as_model {
        Error::Usage(format!(
            "{}; is this the model file? DATA takes the record, a .csv",
            error.worded(&MessageNames::PROGRAM.fit.records)
        ))
    } else {
        error.into()
    }
}

/// The files of a problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Files {
    /// Records that are fitted together, at least one.
    pub data: Vec<PathBuf>,
    /// Records that are only scored.
    pub test: Vec<PathBuf>,
    /// The model file.
    pub model: PathBuf,
    /// Options for reading the records, except the hold, which the model gives.
    pub options: ReadOptions,
}

/// Options for reading a record: its part and its format.
#[derive(Debug, Clone, Default, Args)]
pub struct ReadArguments {
    /// Leave out rows before this: a date such as "2026-01-31 14:25", or a number in the unit of the time column
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    from: Option<String>,
    /// Leave out rows after this
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    to: Option<String>,
    /// Refuse missing samples and missing rows
    #[arg(long)]
    strict: bool,
    /// Resample the records on an even grid of this interval [s]
    #[arg(long, value_name = "S", value_parser = interval, allow_negative_numbers = true)]
    resample: Option<f64>,
}

/// A number of seconds above zero.
fn interval(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        _ => Err("it has to be a number of seconds above zero".to_string()),
    }
}

/// Notes on samples that were missing, converted or left out in records, and on dates, one line each; empty if the records were read
/// unchanged.
pub(crate) fn notes(summaries: &[ReadSummary], look: Look) -> String {
    let worth = |summary: &&ReadSummary| !summary.is_plain() || summary.calendar.is_some();
    let noted = summaries.iter().filter(worth);
    let note = |summary: &ReadSummary| {
        let said = summary.worded(&MessageNames::PROGRAM.fit.records);
        look.paragraph("", &format!("note: {said}"))
    };
    let notes = noted.map(note);
    let warnings = summaries.iter().flat_map(|summary| {
        let lines = faults(summary);
        lines.map(|line| look.warning(format!("warning: {line}")) + "\n")
    });
    notes.chain(warnings).collect()
}

impl ReadArguments {
    /// Options for the reader; the hold of the inputs is set elsewhere.
    #[must_use]
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            hold: Hold::Zero,
            from: self.from.clone(),
            to: self.to.clone(),
            strict: self.strict,
            resample: self.resample,
        }
    }
}

/// A problem, and the summaries of its records.
#[derive(Debug, Clone)]
pub struct Input {
    /// Model and records.
    pub problem: Problem,
    /// Summary of each record, fitted ones first.
    pub summaries: Vec<ReadSummary>,
}

impl Files {
    /// All records.
    #[must_use]
    pub fn all(&self) -> Vec<&Path> {
        let records = self.data.iter().chain(&self.test);
        records.chain([&self.model]).map(PathBuf::as_path).collect()
    }

    /// Reads and checks everything.
    ///
    /// # Errors
    /// One line that names the file, the place and the correction.
    pub fn read(&self) -> Result<Input, Error> {
        self.read_with(self.read_model()?)
    }

    /// Reads the model file, and checks that no record is given twice.
    ///
    /// # Errors
    /// As [`Files::read`].
    pub(crate) fn read_model(&self) -> Result<ModelFile, Error> {
        self.check_repetition()?;
        model_file::read(&self.model)
    }

    /// Reads the rest after the model file: a pipe can be read only once.
    ///
    /// # Errors
    /// As [`Files::read`].
    pub(crate) fn read_with(&self, model: ModelFile) -> Result<Input, Error> {
        let options = ReadOptions {
            hold: model.hold,
            ..self.options.clone()
        };
        let read = |path: &PathBuf| -> Result<Reading, Error> {
            let mut reading = read_csv(path, &model.columns, &options)
                .map_err(|error| perhaps_a_model(path, error))?;
            reading.record.name = self.name_of(path);
            reading.summary.file.clone_from(&reading.record.name);
            Ok(reading)
        };
        let all = self.data.iter().chain(&self.test).map(read);
        let (mut records, summaries): (Vec<Record>, Vec<ReadSummary>) = all
            .collect::<Result<Vec<Reading>, Error>>()?
            .into_iter()
            .map(|reading| (reading.record, reading.summary))
            .unzip();
        on_one_clock(&mut records);
        check_clocks(&records[..self.data.len()], &summaries)?;
        let test = records.split_off(self.data.len());
        Ok(Input {
            problem: problem(&self.model.display().to_string(), model, records, test)?,
            summaries,
        })
    }

    /// An error of the computation, with the file in question if known.
    pub(crate) fn blame(&self, error: missing_effect::Error) -> Error {
        use missing_effect::Error::{ControlledOutput, Design, Structure, UnstableLoop};
        if matches!(
            error,
            UnstableLoop { .. } | ControlledOutput { .. } | Structure(_)
        ) {
            return Error::file(&self.model, error.worded(&MessageNames::PROGRAM.fit));
        }
        let error = match error {
            Design(refused) => return refused.into(),
            error => error,
        };
        let what = error.worded(&MessageNames::PROGRAM.fit);
        let named = |path: &PathBuf| what.contains(&self.name_of(path));
        if self.data.iter().chain(&self.test).any(named) {
            return error.into();
        }
        let fitted: Vec<String> = self.data.iter().map(|p| p.display().to_string()).collect();
        Error::File {
            file: fitted.join(", "),
            what,
        }
    }

    /// Name of a record in messages: its file name, or its path if another record has the same file name; in printable text.
    pub(crate) fn name_of(&self, path: &Path) -> String {
        let records = self.data.iter().chain(&self.test);
        let same = records.filter(|other| other.file_name() == path.file_name());
        let name = match path.file_name() {
            Some(name) if same.count() <= 1 => name.to_string_lossy().into_owned(),
            _ => path.display().to_string(),
        };
        escaped(&name).into_owned()
    }

    /// The file of a fitted record.
    pub(crate) fn path_of(&self, record: &str) -> Option<&Path> {
        let mut paths = self.data.iter().map(PathBuf::as_path);
        paths.find(|path| self.name_of(path) == record)
    }

    /// Checks that no record is given twice: a fitted record cannot be held out, and a repeated record adds no information.
    ///
    /// # Errors
    /// Where one is.
    pub(crate) fn check_repetition(&self) -> Result<(), Error> {
        let records: Vec<(&PathBuf, bool)> = self
            .data
            .iter()
            .map(|path| (path, false))
            .chain(self.test.iter().map(|path| (path, true)))
            .collect();
        for (index, (path, held_out)) in records.iter().enumerate() {
            let Some((_, before)) = records[..index]
                .iter()
                .find(|(other, _)| same_file(other, path))
            else {
                continue;
            };
            let what = if *held_out && !before {
                "it is both fitted and held out by --test; held-out data have to be another record"
            } else {
                "it is given twice; give it once"
            };
            return Err(Error::file(path, what));
        }
        Ok(())
    }
}

/// Measures the times of all records with dates from the first of these dates.
pub fn on_one_clock(records: &mut [Record]) {
    let starts = records.iter().filter_map(|record| record.calendar.as_ref());
    let Some(first) = starts.map(|calendar| calendar.start).min() else {
        return;
    };
    for record in records {
        if let Some(calendar) = &mut record.calendar {
            let later = calendar.start.seconds_since(first);
            record.time.iter_mut().for_each(|time| *time += later);
            calendar.start = first;
        }
    }
}

/// Fitted records with dates are given in the order of their dates, and do not overlap: with a clock that runs backwards between files,
/// drifts cannot be found. `summaries`: summaries of the records, if known.
pub(crate) fn check_clocks(records: &[Record], summaries: &[ReadSummary]) -> Result<(), Error> {
    for (k, pair) in records.windows(2).enumerate() {
        let [before, after] = pair else { continue };
        let (Some(calendar), Some(_)) = (&before.calendar, &after.calendar) else {
            continue;
        };
        let (Some(&end), Some(&begin)) = (before.time.last(), after.time.first()) else {
            continue;
        };
        if begin <= end {
            let place = summaries.get(k + 1).map_or_else(
                || ": the first row, column of the time".to_string(),
                |s| {
                    let column = quoted(&s.time_header);
                    format!(", row {}, column \"{column}\"", s.first_row)
                },
            );
            return Err(Error::Usage(format!(
                "{}{place}: it begins at {}, before {} ends at {}; give the files in the order of their dates, and once what they share (--from, --to), or correct time_zone under [columns]",
                after.name,
                calendar.at(begin),
                before.name,
                calendar.at(end)
            )));
        }
    }
    Ok(())
}

/// A problem from records and a model that were read; `model_name` is the name of the model file in messages.
///
/// # Errors
/// Where the records do not fit each other or the model.
pub fn problem(
    model_name: &str,
    model: ModelFile,
    records: Vec<Record>,
    test: Vec<Record>,
) -> Result<Problem, Error> {
    check_clocks(&records, &[])?;
    check_units(model.plant.pumps(), &records, &test)?;
    check_movement(&records)?;
    check_height(model_name, &model, records.iter().chain(&test))?;
    check_input(model_name, &model, records.iter().chain(&test))?;
    check_levels(&model, records.iter().chain(&test))?;
    check_rows(&model, &records)?;
    check_terms(model_name, &model, &records[0])?;
    let controller = model
        .controller
        .as_ref()
        .map(|settings| controller(model_name, settings, &records))
        .transpose()?;
    Ok(Problem {
        plant: model.plant,
        known: model.known,
        effects: model.effects,
        terms: model.terms.into_iter().map(|own| own.term).collect(),
        start: model.start,
        fixed: model.fixed,
        priors: model.priors,
        controller,
        records,
        test,
    })
}

#[cfg(test)]
mod tests;
