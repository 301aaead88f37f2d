//! Reads a record from a CSV file, says in one line what it read, what was missing and what it did, and in one line what is wrong with
//! one that it refuses.
//!
//! Understood: commas, semicolons or tabs (found from the header); a decimal comma where commas do not separate; a byte-order mark, CRLF,
//! blank lines, lines that begin with `#`, and blanks around a cell; times as numbers in a unit, or as dates and times; words such as `Bad`
//! and `null`, and empty cells, where a sample is missing; rows that are missing; units that are not those of the model. Only the columns in
//! use are read. Nothing is ever written.

mod cells;
mod checks;
mod place;
mod summary;
mod text;
mod time;

use std::path::Path;

use csv::StringRecord;
use serde::{Deserialize, Serialize};

pub use self::summary::{Converted, MissingSamples, ReadSummary};
use self::{
    cells::is_word,
    place::Place,
    text::{check_header, decode, line_number, read as next_row, reader},
    time::Bounds,
};
pub(crate) use self::{
    cells::{Cell, CellFault, Numbers, THOUSANDS, TIME_AS_NUMBER, says_missing},
    checks::constant,
    text::{check_width, delimiter, delimiter_name, is_number},
    time::Times,
};
use crate::columns::{Columns, Found, Heading, Layout, Purpose};
use crate::{
    Calendar, Channel, Error, Hold, LARGEST_RECORD, MIN_ROWS, Record, escaped, quoted, read_file,
    unit,
};

/// How a record is read.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReadOptions {
    /// What the inputs do between samples.
    pub hold: Hold,
    /// Rows before this are left out: a date, or a number in the unit of the time column.
    pub from: Option<String>,
    /// Rows behind this are left out, as [`ReadOptions::from`].
    pub to: Option<String>,
    /// Refuses missing samples and missing rows.
    pub strict: bool,
    /// The record is put on an even grid of this interval \[s\]; `None`: it stays as it was sampled.
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
    /// What was read, what was missing and what was done.
    pub summary: ReadSummary,
}

/// Reads a record; `columns` says which column is what.
///
/// The time is converted to seconds. Its steps may vary. Samples may be missing, and are NaN then; rows may be missing
/// ([`Record::without_gaps`]). Row numbers in messages are line numbers of the file. Whether the input moves says
/// [`Record::require_moving_input`].
///
/// # Errors
/// [`Error::CannotOpen`], [`Error::Folder`], [`Error::NotText`], [`Error::EmptyFile`],
/// [`Error::NoHeader`], [`Error::Column`], [`Error::UnknownTimeUnit`], [`Error::WrongFieldCount`],
/// [`Error::UnitRow`], [`Error::TextInCell`], [`Error::MixedDecimalMarks`], [`Error::Timestamp`],
/// [`Error::RepeatedTime`], [`Error::BackwardTime`], [`Error::Bound`], [`Error::TooFewRows`] (below
/// [`MIN_ROWS`](crate::MIN_ROWS)), [`Error::NoSample`], [`Error::ConstantOutput`], [`Error::InvalidInterval`], [`Error::TooLarge`],
/// [`Error::TooSmall`], [`Error::Saturated`]; where it is to be strict [`Error::EmptyCell`], [`Error::NotFinite`] and [`Error::Gap`] too.
pub fn read_csv(path: &Path, columns: &Columns, options: &ReadOptions) -> Result<Reading, Error> {
    read(path, columns, options, Purpose::Fit)
}

/// Reads a record on whose inputs a model is simulated: an output whose column is not there has no sample, and two rows are enough.
/// Outputs that are there may stand still.
///
/// # Errors
/// As [`read_csv`], but for what is wrong with outputs alone.
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
/// As [`read_csv`], but for those of opening.
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
/// As [`read_inputs_csv`], but for those of opening.
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
    let text = decode(file, content)?;
    let (layout, table) = read_table(file, text, columns, (options, purpose))?;
    table.check(file, text, &layout, (options, purpose))?;
    table.into_reading(file, text, layout, (options, purpose))
}

/// The header of a file: what there is to choose from, before anything is read.
///
/// # Errors
/// Where the file is not text, is empty, or has no header.
pub fn csv_header(file: &str, content: &[u8]) -> Result<Vec<Heading>, Error> {
    let text = decode(file, content)?;
    let mut reader = reader(text);
    let mut record = StringRecord::new();
    while next_row(file, &mut reader, &mut record)? {
        if !record.iter().all(str::is_empty) {
            check_header(file, || line_number(text, end_of(&reader)), &record)?;
            return Ok(record.iter().map(Heading::of).collect());
        }
    }
    Err(Error::EmptyFile { file: file.into() })
}

/// The fewest rows of a record.
fn fewest_rows(purpose: Purpose) -> usize {
    match purpose {
        Purpose::Fit => MIN_ROWS,
        Purpose::Simulation => 2,
    }
}

fn end_of(reader: &csv::Reader<&[u8]>) -> usize {
    usize::try_from(reader.position().byte()).unwrap_or(usize::MAX)
}

/// The columns in use, with where each row ends in the file.
#[derive(Default)]
struct Table {
    ends: Vec<usize>,
    /// \[s\], from zero of the column, or from the first row where these are dates.
    time: Vec<f64>,
    /// Of every channel, in the order of [`Layout::channels`], its values in the units that are wanted.
    values: Vec<Vec<f64>>,
    /// Of every channel the words that stand in cells whose sample is missing, with their number.
    missing: Vec<Vec<(String, usize)>>,
    calendar: Option<Calendar>,
    /// Rows before or behind what is wanted.
    outside: usize,
    /// Rows without a time.
    without_time: usize,
    /// Where the first of them ends, and what stands in their cells.
    untimed: (usize, Vec<(String, usize)>),
}

fn read_table(
    file: &str,
    text: &str,
    columns: &Columns,
    (options, purpose): (&ReadOptions, Purpose),
) -> Result<(Layout, Table), Error> {
    let delimiter = delimiter(text);
    let mut reader = reader(text);
    let mut record = StringRecord::new();
    let mut header: Option<(Layout, usize)> = None;
    let mut times: Option<(Times, Bounds)> = None;
    let mut numbers = Numbers::new(delimiter != b',', options.strict, &columns.missing);
    let mut table = Table::default();

    while next_row(file, &mut reader, &mut record)? {
        let end = end_of(&reader);
        if record.iter().all(str::is_empty) {
            continue;
        }
        let Some((layout, fields)) = &header else {
            let row = || line_number(text, end);
            check_header(file, row, &record)?;
            let headers: Vec<String> = record.iter().map(str::to_string).collect();
            let layout = columns.resolve(file, row(), &headers, purpose)?;
            let channels = layout.channels().count();
            table.values.resize_with(channels, Vec::new);
            table.missing.resize_with(channels, Vec::new);
            header = Some((layout, record.len()));
            continue;
        };
        if record.len() != *fields {
            return Err(Error::WrongFieldCount {
                file: file.into(),
                row: line_number(text, end),
                expected: *fields,
                found: record.len(),
                delimiter: delimiter_name(delimiter),
            });
        }
        if table.time.is_empty() && table.outside == 0 && is_row_of_units(&record) {
            let (name, unit) = unit::split(&layout.time.header);
            let below = &record[layout.time.index];
            let unit = if below.is_empty() { unit } else { below };
            return Err(Error::UnitRow {
                file: file.into(),
                row: line_number(text, end),
                header: quoted(&format!("{name} [{unit}]")),
            });
        }
        let cell = &record[layout.time.index];
        let place = Place {
            name: file,
            text,
            end,
            header: &layout.time.header,
        };
        if !options.strict && says_missing(cell) {
            if table.without_time == 0 {
                table.untimed.0 = end;
            }
            table.without_time += 1;
            count_word(&mut table.untimed.1, cell);
            continue;
        }
        let (times, bounds) = match &mut times {
            Some(known) => known,
            none => {
                let all = || time::cells(place, layout.time.index);
                let found = Times::of(cell, all, layout.seconds, columns)
                    .map_err(|fault| fault.at(place, cell, options.strict))?;
                let bounds = Bounds::of(&found, layout.seconds, options)?;
                none.insert((found, bounds))
            }
        };
        let time = times
            .read(cell, &mut numbers)
            .map_err(|fault| fault.at(place, cell, options.strict))?;
        if !bounds.contain(time) {
            table.outside += 1;
            continue;
        }
        if let Some(&previous) = table.time.last() {
            times.check_order(place, previous, time)?;
        }
        table.time.push(time);
        table.ends.push(end);
        for (k, column) in layout.channels().enumerate() {
            let cell = &record[column.index];
            let place = Place {
                header: &column.header,
                ..place
            };
            let sample = numbers.sample(cell);
            let value = match sample.map_err(|fault| fault.at(place, cell, options.strict))? {
                Cell::Number(value) => match &column.converted {
                    Some((_, conversion)) => conversion.apply(value),
                    None => value,
                },
                Cell::Missing => {
                    count_word(&mut table.missing[k], cell);
                    f64::NAN
                }
            };
            table.values[k].push(value);
        }
    }
    table.calendar = times.and_then(|(times, _)| times.calendar());
    match header {
        Some((layout, _)) => Ok((layout, table)),
        None => Err(Error::EmptyFile { file: file.into() }),
    }
}

/// Whether a row below the header holds units: words alone, and none that says that a sample is missing.
fn is_row_of_units(row: &StringRecord) -> bool {
    let says = |cell: &str| !cell.is_empty() && cell != "-" && says_missing(cell);
    row.iter().all(is_word) && !row.iter().any(says)
}

/// Counts what stands in a cell whose sample is missing: the first words that occur by themselves, the others together.
fn count_word(words: &mut Vec<(String, usize)>, cell: &str) {
    const MOST: usize = 6;
    const LONGEST: usize = 24;
    let end = cell
        .char_indices()
        .nth(LONGEST)
        .map_or(cell.len(), |(at, _)| at);
    let cell = &cell[..end];
    if let Some((_, count)) = words.iter_mut().find(|(word, _)| word == cell) {
        *count += 1;
    } else if words.len() < MOST {
        words.push((cell.to_string(), 1));
    } else {
        match words.get_mut(MOST) {
            Some((_, count)) => *count += 1,
            None => words.push(("...".to_string(), 1)),
        }
    }
}

impl Table {
    fn into_reading(
        mut self,
        file: &str,
        text: &str,
        layout: Layout,
        (options, purpose): (&ReadOptions, Purpose),
    ) -> Result<Reading, Error> {
        // Times begin at the first row in use where they are dates.
        if let (Some(calendar), Some(&first)) = (&mut self.calendar, self.time.first()) {
            calendar.start = calendar.start.after(first);
            self.time.iter_mut().for_each(|time| *time -= first);
        }
        // Names and units go into sentences, tables and files; none of them may steer a terminal.
        let printable = |text: &str| escaped(text).into_owned();
        let mut values = self.values.into_iter();
        let mut channels = |columns: &[Found]| -> Vec<Channel> {
            let channel = |(column, values): (&Found, Vec<f64>)| {
                Channel::new(printable(&column.name), printable(&column.unit), values)
            };
            columns.iter().zip(values.by_ref()).map(channel).collect()
        };
        let inputs = channels(&layout.inputs).into_iter();
        let mut record = Record {
            name: file.into(),
            time: self.time,
            inputs: inputs.map(|u| u.with_hold(options.hold)).collect(),
            outputs: channels(&layout.outputs),
            references: channels(&layout.references),
            calendar: self.calendar,
        };
        for (at, header) in &layout.absent {
            let (name, unit) = unit::split(header);
            let none = vec![f64::NAN; record.len()];
            let channel = Channel::new(printable(name), printable(unit), none);
            record.outputs.insert(*at, channel);
        }
        let named = layout.channels().zip(&self.missing);
        let missing = named
            .filter(|(_, words)| !words.is_empty())
            .map(|(column, words)| MissingSamples {
                column: printable(&column.name),
                samples: words.iter().map(|(_, count)| count).sum(),
                words: words
                    .iter()
                    .map(|(word, count)| (quoted(word), *count))
                    .collect(),
            });
        let missing: Vec<MissingSamples> = missing.collect();
        let converted = layout.channels().filter_map(|column| {
            let (from, _) = column.converted.as_ref()?;
            Some(Converted {
                column: printable(&column.name),
                from: printable(from),
                to: printable(&column.unit),
            })
        });
        let summary = ReadSummary {
            file: file.into(),
            rows: record.len(),
            first_row: self.ends.first().map_or(0, |&end| line_number(text, end)),
            time_header: printable(&layout.time.header),
            outside: self.outside,
            without_time: self.without_time,
            missing_rows: record.missing_rows(),
            interval: record.sample_interval(),
            duration: record.duration(),
            calendar: record.calendar.clone(),
            missing,
            converted: converted.collect(),
            resampled: options.resample,
        };
        if let Some(interval) = options.resample {
            record = record.resampled(interval)?;
            if record.len() < fewest_rows(purpose) {
                return Err(Error::TooFewRows {
                    record: file.into(),
                    rows: record.len(),
                    needed: fewest_rows(purpose),
                    why: " on the grid of --resample".into(),
                });
            }
        }
        Ok(Reading { record, summary })
    }
}
