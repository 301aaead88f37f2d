//! Reads a record from a CSV file, says in one line what it read, what was missing and what it did, and in one line what is wrong with
//! one that it refuses.
//!
//! Understood: UTF-8, UTF-16 with a byte-order mark, and Latin-1; commas, semicolons or tabs (found from the header); a decimal comma where
//! commas do not separate; CRLF, blank lines, lines that begin with `#`, lines of text above the header, a row of units below it, and blanks
//! around a cell; times as numbers in a unit, or as dates and times; words such as `Bad` and `null`, and empty cells, where a sample is
//! missing; rows that are missing; units that are not those of the model. Only the columns in use are read. Nothing is ever written.

mod cells;
mod checks;
mod place;
mod rows;
mod start;
mod summary;
mod table;
mod text;
mod time;

use std::path::Path;

use serde::{Deserialize, Serialize};

use self::rows::Rows;
pub use self::summary::{Converted, MissingSamples, ReadSummary};
use self::table::read_table;
use self::text::decode;
pub(crate) use self::{
    cells::{Cell, CellFault, Numbers, TIME_AS_NUMBER, says_missing},
    rows::with_unit,
    start::are_units,
    text::{DELIMITER_KEY, check_width, delimiter, delimiter_name, is_number},
    time::Times,
};
use crate::columns::{Columns, Heading, Purpose};
use crate::{Error, Hold, LARGEST_RECORD, MIN_ROWS, ReadError, Record, read_file};

/// Options for reading a record.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReadOptions {
    /// Hold of the inputs between samples.
    pub hold: Hold,
    /// Rows before this are left out: a date, or a number in the unit of the time column.
    pub from: Option<String>,
    /// Rows after this are left out, as [`ReadOptions::from`].
    pub to: Option<String>,
    /// Refuses missing samples and missing rows.
    pub strict: bool,
    /// Interval of the even grid for resampling \[s\]; `None`: the record keeps its sampling.
    pub resample: Option<f64>,
}

impl From<Hold> for ReadOptions {
    fn from(hold: Hold) -> Self {
        Self {
            hold,
            ..Self::default()
        }
    }
}

/// A record and what was done to read it.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// The record.
    pub record: Record,
    /// Summary: rows read, samples missing, and corrections made.
    pub summary: ReadSummary,
}

/// Reads a record; `columns` says which column is what.
///
/// The time is converted to seconds. Its steps may vary. Samples may be missing, and are NaN then; rows may be missing
/// ([`Record::without_gaps`]). Row numbers in messages are line numbers of the file.
/// [`Record::require_moving_input`] checks whether the input changes.
///
/// # Errors
/// [`ReadError::CannotOpen`], [`ReadError::Folder`], [`ReadError::NotText`], [`ReadError::EmptyFile`],
/// [`ReadError::NoHeader`], [`ReadError::Column`], [`ReadError::UnknownTimeUnit`], [`ReadError::WrongFieldCount`],
/// [`ReadError::UnitRow`], [`ReadError::TextInCell`], [`ReadError::MixedDecimalMarks`], [`ReadError::Timestamp`],
/// [`ReadError::RepeatedTime`], [`ReadError::BackwardTime`], [`Error::Bound`], [`Error::EmptyPart`], [`Error::TooFewRows`] (below
/// [`MIN_ROWS`](crate::MIN_ROWS)), [`Error::NoSample`], [`Error::ConstantOutput`], [`Error::InvalidInterval`], [`Error::TooLarge`],
/// [`Error::TooSmall`], [`Error::Saturated`]; where it is to be strict [`ReadError::EmptyCell`], [`ReadError::NotFinite`] and [`Error::Gap`] too.
pub fn read_csv(path: &Path, columns: &Columns, options: &ReadOptions) -> Result<Reading, Error> {
    read(path, columns, options, Purpose::Fit)
}

/// Reads a record on whose inputs a model is simulated: an output whose column is not there has no sample, and two rows are enough. Outputs
/// that are present may be constant.
///
/// # Errors
/// As [`read_csv`], except for what is wrong with outputs alone.
pub fn read_inputs_csv(
    path: &Path,
    columns: &Columns,
    options: &ReadOptions,
) -> Result<Reading, Error> {
    read(path, columns, options, Purpose::Simulation)
}

fn read(
    path: &Path,
    columns: &Columns,
    options: &ReadOptions,
    purpose: Purpose,
) -> Result<Reading, Error> {
    let file = path.display().to_string();
    let bytes = read_file(path, LARGEST_RECORD)?;
    let mut reading = parse(&file, &bytes, columns, (options, purpose))?;
    if let Some(name) = path.file_name() {
        reading.record.name = name.to_string_lossy().into_owned();
        reading.summary.file.clone_from(&reading.record.name);
    }
    Ok(reading)
}

/// As [`read_csv`], from the content of a file; `file` names it in messages and is the record's name.
///
/// # Errors
/// As [`read_csv`], except for those of opening.
pub fn parse_csv(
    file: &str,
    content: &[u8],
    columns: &Columns,
    options: &ReadOptions,
) -> Result<Reading, Error> {
    parse(file, content, columns, (options, Purpose::Fit))
}

/// As [`read_inputs_csv`], from the content of a file; `file` names it in messages and is the record's name.
///
/// # Errors
/// As [`read_inputs_csv`], except for those of opening.
pub fn parse_inputs_csv(
    file: &str,
    content: &[u8],
    columns: &Columns,
    options: &ReadOptions,
) -> Result<Reading, Error> {
    parse(file, content, columns, (options, Purpose::Simulation))
}

fn parse(
    file: &str,
    content: &[u8],
    columns: &Columns,
    (options, purpose): (&ReadOptions, Purpose),
) -> Result<Reading, Error> {
    let decoded = decode(file, content)?;
    let (layout, table) = read_table(file, &decoded.text, columns, (options, purpose))?;
    table.check(file, &decoded.text, &layout, (options, purpose))?;
    table.into_reading(file, &decoded, layout, (options, purpose))
}

/// The header of a file, with the available columns, before the record is read.
///
/// # Errors
/// Where the file is not text, is empty, or has no header.
pub fn csv_header(file: &str, content: &[u8]) -> Result<Vec<Heading>, Error> {
    let decoded = decode(file, content)?;
    let header = Rows::new(file, &decoded.text).header()?;
    Ok(header.names.iter().map(|name| Heading::of(name)).collect())
}

/// The error of a file without a header.
fn empty(file: &str) -> Error {
    Error::Read(ReadError::EmptyFile { file: file.into() })
}

/// The fewest rows of a record.
fn fewest_rows(purpose: Purpose) -> usize {
    match purpose {
        Purpose::Fit => MIN_ROWS,
        Purpose::Simulation => 2,
    }
}
