//! The input record of a simulation: read and checked for completeness.

use std::path::{Path, PathBuf};

use ct_signals::{
    Channel, Clock, Columns, ReadOptions, ReadSummary, Reading, Record, escaped, quoted,
    read_inputs_csv,
};
use greybox::InitialStates;

use super::TimeColumn;
use crate::Error;

/// Requested inputs.
#[derive(Debug, Clone)]
pub(crate) struct Inputs {
    /// The file of the inputs.
    pub path: PathBuf,
    /// Options for reading, except the hold.
    pub options: ReadOptions,
    /// Number of first readings of each output for the fit of initial states.
    pub first: usize,
}

/// A record of inputs as it was read.
pub(crate) struct ReadInputs {
    pub record: Record,
    pub summary: ReadSummary,
    pub time: TimeColumn,
}

/// Reads the inputs; those outputs that the file has come with them. `named`: what a column that is not there is named in the error on.
///
/// # Errors
/// One line that names the file, the place and the correction: where a column is not there, a sample of an input is missing, or rows are.
pub(crate) fn read_inputs(
    path: &Path,
    columns: &Columns,
    options: &ReadOptions,
    named: impl Fn(ct_signals::Error) -> Error,
) -> Result<ReadInputs, Error> {
    let reading = read_inputs_csv(path, columns, options).map_err(named)?;
    ReadInputs::of(path, reading, columns)
}

impl ReadInputs {
    /// Inputs that were read, which have to be complete; `path` is their name in messages.
    ///
    /// # Errors
    /// Where a sample of an input is missing, or rows are, with the place and the correction.
    pub fn of(path: &Path, reading: Reading, columns: &Columns) -> Result<Self, Error> {
        let (mut record, summary) = (reading.record, reading.summary);
        record.name = escaped(&record.name).into_owned();
        check_whole(path, &record)?;
        if record.outputs.is_empty() {
            let none = vec![f64::NAN; record.len()];
            record.outputs.push(Channel::new("y", "", none));
        }
        let time = TimeColumn::of(path, columns, &record)?;
        Ok(Self {
            record,
            summary,
            time,
        })
    }
}

/// The input inside a gap is not known.
fn check_whole(path: &Path, record: &Record) -> Result<(), Error> {
    let clock = Clock::of([record]);
    const MEND: &str =
        "a simulation needs every input: fill them in, or choose a part with --from and --to";
    if let Some(input) = record.inputs.iter().find(|input| input.missing() > 0) {
        let first = input.values.iter().position(|value| value.is_nan());
        let at = first.map_or(f64::NAN, |k| record.time[k]);
        return Err(Error::file(
            path,
            format!(
                "column \"{}\": {} of {} samples are missing, the first at {}; {MEND}",
                quoted(&input.header()),
                input.missing(),
                record.len(),
                clock.at(at)
            ),
        ));
    }
    let rows = record.missing_rows();
    if rows > 0 {
        let before = clock.at(record.before_missing_row().unwrap_or(f64::NAN));
        let what = match rows {
            1 => format!("1 row is missing after {before}"),
            rows => format!("{rows} rows are missing, the first after {before}"),
        };
        return Err(Error::file(path, format!("{what}; {MEND}")));
    }
    Ok(())
}

/// Whether some output has readings.
pub(crate) fn begins_with_readings(record: &Record) -> bool {
    let has = |output: &Channel| output.missing() < output.values.len();
    record.outputs.iter().any(has)
}

/// Initial states fitted to the first readings of a record or, if these do not determine them, to twice as many, and so on; `None` if all
/// do not. `fit`: the fit to a part of the record.
pub(crate) fn of_first_readings(
    (record, first): (&Record, usize),
    fit: impl Fn(&[Record]) -> Result<Option<InitialStates>, greybox::Error>,
) -> Result<Option<InitialStates>, greybox::Error> {
    let mut rows = first;
    while begins_with_readings(record) {
        let begun = [first_readings(record, rows)];
        if let Some(states) = fit(&begun)? {
            return Ok(Some(states));
        }
        if begun[0].len() >= record.len() {
            break;
        }
        rows *= 2;
    }
    Ok(None)
}

/// A record up to the row where each of its outputs has this number of readings, without further readings.
fn first_readings(record: &Record, count: usize) -> Record {
    let end = |output: &Channel| {
        let present = output.values.iter().enumerate();
        let mut present = present.filter(|(_, value)| !value.is_nan()).map(|(k, _)| k);
        let last = present.clone().next_back().map_or(0, |last| last + 1);
        present.nth(count - 1).map_or(last, |k| k + 1)
    };
    let rows = record.outputs.iter().map(end).max().unwrap_or(0).max(1);
    let mut begun = record.rows(0..rows);
    for (output, whole) in begun.outputs.iter_mut().zip(&record.outputs) {
        let end = end(whole).min(rows);
        output.values[end..].fill(f64::NAN);
    }
    begun
}
