//! Reads a record from a CSV file, and says in one line what is wrong with one that it refuses.
//!
//! Understood: commas, semicolons or tabs (found from the header); a decimal comma where commas do
//! not separate; a byte-order mark, CRLF, blank lines, lines that begin with `#`, and blanks
//! around a cell. Only the columns in use are read. Nothing is ever written.

use std::collections::HashMap;
use std::path::Path;

use csv::{Reader, ReaderBuilder, StringRecord, Trim};

use crate::columns::{Columns, Found, Heading, Layout};
use crate::record::{MIN_ROWS, median_step, quantile_of_steps};
use crate::{
    Error, Hold, LARGEST_RECORD, LONGEST_LINE, MOST_COLUMNS, Record, Signal, quoted, read_file,
    unit,
};

/// A step of the time above this many usual steps is a gap: half-way between one sample and two,
/// so that one missing sample does not pass where the steps are even.
const GAP: f64 = 1.5;

/// The usual step is the one that this share of them does not exceed: with even steps the interval itself, with uneven ones a
/// long one, so that a record is not called full of gaps because its clock is not a metronome.
const USUAL: f64 = 0.95;

/// A record is refused when more than this share of the output sits exactly at its limits ...
const SATURATED_SHARE: f64 = 1.0 / 3.0;

/// ... and that is more than this many times what the commonest other value has: a coarsely
/// quantised output has many samples at every level, a saturated one only at its limits.
const SATURATED_RATIO: usize = 4;

/// Inputs, outputs and sampling intervals between its inverse and this can be raised to the powers
/// that a fit takes, with many digits to spare.
const LARGEST: f64 = 1e15;

/// Reads a record; `columns` says which column is what, `hold` what the input does in between.
///
/// The time is converted to seconds. Its steps may vary, but no sample may be missing: a step half as long again as
/// 95 % of the steps is a gap. Row numbers in messages are line numbers of the file.
///
/// # Errors
/// [`Error::CannotOpen`], [`Error::Folder`], [`Error::NotText`], [`Error::EmptyFile`],
/// [`Error::NoHeader`], [`Error::Column`], [`Error::UnknownTimeUnit`], [`Error::WrongFieldCount`],
/// [`Error::UnitRow`], [`Error::EmptyCell`], [`Error::TextInCell`], [`Error::NotFinite`], [`Error::MixedDecimalMarks`],
/// [`Error::RepeatedTime`], [`Error::BackwardTime`], [`Error::TooFewRows`] (below
/// [`MIN_ROWS`]), [`Error::Gap`], [`Error::ConstantInput`],
/// [`Error::ConstantOutput`], [`Error::InvalidInterval`], [`Error::TooLarge`], [`Error::TooSmall`],
/// [`Error::Saturated`].
pub fn read_csv(path: &Path, columns: &Columns, hold: Hold) -> Result<Record, Error> {
    named_by_file(path, |file, bytes| parse_csv(file, bytes, columns, hold))
}

/// As [`read_csv`], and the input may be constant: for a record that is simulated beside others, or scored only. Whether a
/// record moves says [`Record::require_moving_input`].
///
/// # Errors
/// As [`read_csv`], but for [`Error::ConstantInput`].
pub fn read_csv_any_input(path: &Path, columns: &Columns, hold: Hold) -> Result<Record, Error> {
    named_by_file(path, |file, bytes| {
        parse_csv_any_input(file, bytes, columns, hold)
    })
}

/// A record from a file, which names it.
fn named_by_file(
    path: &Path,
    parse: impl FnOnce(&str, &[u8]) -> Result<Record, Error>,
) -> Result<Record, Error> {
    let file = path.display().to_string();
    let bytes = read_file(path, LARGEST_RECORD)?;
    let record = parse(&file, &bytes)?;
    let name = path.file_name().map(|name| name.to_string_lossy());
    Ok(Record {
        name: name.map_or(file, |name| name.into_owned()),
        ..record
    })
}

/// As [`read_csv`], from the content of a file; `file` names it in messages and is the record's name.
///
/// # Errors
/// As [`read_csv`], but for those of opening.
pub fn parse_csv(
    file: &str,
    content: &[u8],
    columns: &Columns,
    hold: Hold,
) -> Result<Record, Error> {
    let (layout, table) = read_table(file, decode(file, content)?, columns)?;
    table.check(file, &layout)?;
    table.check_input(file, &layout)?;
    Ok(table.into_record(file, layout, hold))
}

/// As [`read_csv_any_input`], from the content of a file.
///
/// # Errors
/// As [`read_csv_any_input`], but for those of opening.
pub fn parse_csv_any_input(
    file: &str,
    content: &[u8],
    columns: &Columns,
    hold: Hold,
) -> Result<Record, Error> {
    let (layout, table) = read_table(file, decode(file, content)?, columns)?;
    table.check(file, &layout)?;
    Ok(table.into_record(file, layout, hold))
}

/// The header of a file: what there is to choose from, before anything is read.
///
/// # Errors
/// Where the file is not text, is empty, or has no header.
pub fn csv_header(file: &str, content: &[u8]) -> Result<Vec<Heading>, Error> {
    let text = decode(file, content)?;
    let mut reader = reader(text);
    let mut lines = LineCounter::new(text);
    let mut record = StringRecord::new();
    while read(file, &mut reader, &mut record)? {
        let row = lines.advance(reader.position().byte());
        if !record.iter().all(str::is_empty) {
            check_header(file, row, &record)?;
            return Ok(record.iter().map(Heading::of).collect());
        }
    }
    Err(Error::EmptyFile { file: file.into() })
}

/// The columns in use, in the file's units, with the line number of each row.
#[derive(Default)]
struct Table {
    rows: Vec<u64>,
    time: Vec<f64>,
    input: Vec<f64>,
    input_2: Vec<f64>,
    output: Vec<f64>,
    reference: Vec<f64>,
}

fn decode<'a>(file: &str, bytes: &'a [u8]) -> Result<&'a str, Error> {
    let not_text = |found| Error::NotText {
        file: file.into(),
        found,
    };
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(not_text("UTF-16"));
    }
    if bytes.starts_with(b"PK\x03\x04") {
        return Err(not_text("a zip archive or a spreadsheet"));
    }
    if bytes.contains(&0) {
        return Err(not_text("binary data"));
    }
    let text = std::str::from_utf8(bytes).map_err(|_| not_text("in another encoding"))?;
    let long = text
        .split(['\n', '\r'])
        .find(|line| line.len() > LONGEST_LINE);
    if let Some(line) = long {
        let begin = line.as_ptr() as usize - text.as_ptr() as usize;
        return Err(Error::LongLine {
            file: file.into(),
            row: LineCounter::new(text).advance((begin + line.len()) as u64),
            longest: LONGEST_LINE,
        });
    }
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

fn read_table(file: &str, text: &str, columns: &Columns) -> Result<(Layout, Table), Error> {
    let delimiter = delimiter(text);
    let mut reader = reader(text);
    let mut lines = LineCounter::new(text);
    let mut record = StringRecord::new();
    let mut header: Option<(Layout, usize)> = None;
    let mut numbers = Numbers {
        file,
        decimal_comma_allowed: delimiter != b',',
        mark: None,
    };
    let mut table = Table::default();

    while read(file, &mut reader, &mut record)? {
        let row = lines.advance(reader.position().byte());
        if record.iter().all(str::is_empty) {
            continue;
        }
        let Some((layout, fields)) = &header else {
            header = Some((resolve(file, row, &record, columns)?, record.len()));
            continue;
        };
        if record.len() != *fields {
            return Err(Error::WrongFieldCount {
                file: file.into(),
                row,
                expected: *fields,
                found: record.len(),
                delimiter: match delimiter {
                    b';' => "semicolon",
                    b'\t' => "tab",
                    _ => "comma",
                },
            });
        }
        if table.time.is_empty() && record.iter().all(is_word) {
            let (name, unit) = unit::split(&layout.time.header);
            let below = &record[layout.time.index];
            let unit = if below.is_empty() { unit } else { below };
            return Err(Error::UnitRow {
                file: file.into(),
                row,
                header: quoted(&format!("{name} [{unit}]")),
            });
        }
        let mut cell = |column: &Found| numbers.parse(row, column, &record[column.index]);
        let time = numbers_time(&mut cell, &layout.time)?;
        table.input.push(cell(&layout.input)?);
        if let Some(input) = &layout.input_2 {
            table.input_2.push(cell(input)?);
        }
        table.output.push(cell(&layout.output)?);
        if let Some(reference) = &layout.reference {
            table.reference.push(cell(reference)?);
        }
        if let Some(&previous) = table.time.last() {
            check_order(file, row, &layout.time.header, previous, time)?;
        }
        table.time.push(time);
        table.rows.push(row);
    }
    match header {
        Some((layout, _)) => Ok((layout, table)),
        None => Err(Error::EmptyFile { file: file.into() }),
    }
}

/// Whether a cell may be a unit: no number, and nothing that begins as a date or a number does.
fn is_word(cell: &str) -> bool {
    let cell_is_number = cell.parse::<f64>().is_ok();
    cell.is_empty()
        || cell == "-"
        || !(cell_is_number || cell.starts_with(|c: char| c.is_ascii_digit() || "+-.,".contains(c)))
}

/// The time's cell; text there is most often a date, which has its own mend.
fn numbers_time(
    cell: &mut impl FnMut(&Found) -> Result<f64, Error>,
    column: &Found,
) -> Result<f64, Error> {
    cell(column).map_err(|error| match error {
        Error::TextInCell {
            file,
            row,
            column,
            text,
            ..
        } if text.contains(|c: char| c.is_ascii_digit()) => Error::TextInCell {
            file,
            row,
            column,
            text,
            mend: "give the time as a number, such as seconds from the start",
        },
        other => other,
    })
}

fn reader(text: &str) -> Reader<&[u8]> {
    ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter(text))
        .comment(Some(b'#'))
        .trim(Trim::All)
        .from_reader(text.as_bytes())
}

/// The next row, if there is one.
fn read(file: &str, reader: &mut Reader<&[u8]>, row: &mut StringRecord) -> Result<bool, Error> {
    reader.read_record(row).map_err(|error| Error::CannotOpen {
        file: file.into(),
        source: error.into(),
    })
}

fn resolve(
    file: &str,
    row: u64,
    record: &StringRecord,
    columns: &Columns,
) -> Result<Layout, Error> {
    check_header(file, row, record)?;
    let headers: Vec<String> = record.iter().map(str::to_string).collect();
    columns.resolve(file, row, &headers)
}

/// A header names so many columns at most.
pub(crate) fn check_width(file: &str, row: u64, found: usize) -> Result<(), Error> {
    if found > MOST_COLUMNS {
        return Err(Error::ManyColumns {
            file: file.into(),
            row,
            found,
            most: MOST_COLUMNS,
        });
    }
    Ok(())
}

/// A cell that names no column: a number, with a decimal comma too, or nothing.
pub(crate) fn is_number(cell: &str) -> bool {
    cell.is_empty() || cell.replace(',', ".").parse::<f64>().is_ok()
}

/// Numbers alone are no header, and neither are too many columns.
fn check_header(file: &str, row: u64, record: &StringRecord) -> Result<(), Error> {
    check_width(file, row, record.len())?;
    if record.iter().all(is_number) {
        return Err(Error::NoHeader {
            file: file.into(),
            row,
            first: quoted(&record.iter().collect::<Vec<_>>().join(", ")),
        });
    }
    Ok(())
}

/// The one of comma, semicolon and tab that the first row has most of.
pub(crate) fn delimiter(text: &str) -> u8 {
    let header = text
        .split(['\n', '\r'])
        .find(|line| !line.trim().is_empty() && !line.starts_with('#'))
        .unwrap_or_default();
    let count = |delimiter: &u8| header.bytes().filter(|byte| byte == delimiter).count();
    // `max_by_key` takes the last of equals: a comma, where none occurs.
    b";\t,".iter().copied().max_by_key(count).unwrap_or(b',')
}

/// Line numbers of the rows, past the blank lines and comments that the reader skips. A line ends as it does for the reader: at a line
/// feed, a carriage return, or the two together.
struct LineCounter<'a> {
    text: &'a str,
    byte: usize,
    ends: u64,
}

impl<'a> LineCounter<'a> {
    fn new(text: &'a str) -> Self {
        LineCounter {
            text,
            byte: 0,
            ends: 0,
        }
    }

    /// The line number of the row that the reader finished at `end`.
    fn advance(&mut self, end: u64) -> u64 {
        let end = usize::try_from(end).unwrap_or(usize::MAX);
        let read = self.text.get(self.byte..end).unwrap_or_default();
        let before = self.text.as_bytes()[..self.byte].last().copied();
        let count = |text: &str| {
            let pairs = text
                .bytes()
                .scan(before, |before, byte| Some((before.replace(byte), byte)));
            pairs
                .filter(|&(before, byte)| byte == b'\r' || byte == b'\n' && before != Some(b'\r'))
                .count() as u64
        };
        let line = self.ends + count(read.trim_end_matches(['\r', '\n'])) + 1;
        self.ends += count(read);
        self.byte += read.len();
        line
    }
}

/// Turns cells into numbers.
struct Numbers<'a> {
    file: &'a str,
    decimal_comma_allowed: bool,
    /// The decimal mark seen so far.
    mark: Option<char>,
}

impl Numbers<'_> {
    fn parse(&mut self, row: u64, column: &Found, cell: &str) -> Result<f64, Error> {
        let (file, header) = (self.file.to_string(), quoted(&column.header));
        if cell.is_empty() {
            return Err(Error::EmptyCell {
                file,
                row,
                column: header,
            });
        }
        let comma =
            self.decimal_comma_allowed && cell.matches(',').count() == 1 && !cell.contains('.');
        let value = if comma {
            cell.replace(',', ".").parse::<f64>()
        } else {
            cell.parse::<f64>()
        };
        let value = value.map_err(|_| Error::TextInCell {
            file: file.clone(),
            row,
            column: header.clone(),
            text: quoted(cell),
            mend: if cell.contains(',') {
                "write decimals with a point and without separators for thousands"
            } else {
                "correct the cell, or split the file there: each part is a record of its own"
            },
        })?;
        if !value.is_finite() {
            return Err(Error::NotFinite {
                file,
                row,
                column: header,
                text: quoted(cell),
            });
        }
        let mark = if comma {
            Some(',')
        } else {
            cell.contains('.').then_some('.')
        };
        if let (Some(here), Some(before)) = (mark, self.mark)
            && here != before
        {
            let word = |mark| if mark == ',' { "comma" } else { "point" };
            return Err(Error::MixedDecimalMarks {
                file,
                row,
                column: header,
                text: quoted(cell),
                here: word(here),
                before: word(before),
            });
        }
        self.mark = self.mark.or(mark);
        Ok(value)
    }
}

fn check_order(file: &str, row: u64, column: &str, previous: f64, time: f64) -> Result<(), Error> {
    let (file, column) = (file.to_string(), quoted(column));
    if time == previous {
        Err(Error::RepeatedTime {
            file,
            row,
            column,
            time,
        })
    } else if time < previous {
        Err(Error::BackwardTime {
            file,
            row,
            column,
            time,
            previous,
        })
    } else {
        Ok(())
    }
}

impl Table {
    fn into_record(self, file: &str, layout: Layout, hold: Hold) -> Record {
        let signal =
            |found: &Found, values: Vec<f64>| Signal::new(&*found.name, &*found.unit, values);
        Record {
            name: file.into(),
            time: self.time.iter().map(|t| t * layout.seconds).collect(),
            input: signal(&layout.input, self.input),
            output: signal(&layout.output, self.output),
            input_2: layout
                .input_2
                .as_ref()
                .map(|found| signal(found, self.input_2)),
            reference: layout
                .reference
                .as_ref()
                .map(|found| signal(found, self.reference)),
            hold,
        }
    }

    /// An input that never moves.
    fn check_input(&self, file: &str, layout: &Layout) -> Result<(), Error> {
        match constant(&self.input) {
            Some(value) => Err(Error::ConstantInput {
                file: file.into(),
                column: quoted(&layout.input.header),
                value,
                rows: self.time.len(),
            }),
            None => Ok(()),
        }
    }

    /// What can only be seen in the whole record.
    fn check(&self, file: &str, layout: &Layout) -> Result<(), Error> {
        let rows = self.time.len();
        if rows < MIN_ROWS {
            return Err(Error::TooFewRows {
                record: file.into(),
                rows,
                needed: MIN_ROWS,
                why: String::new(),
            });
        }
        self.check_gaps(file, &layout.time)?;
        if let Some(value) = constant(&self.output) {
            return Err(Error::ConstantOutput {
                file: file.into(),
                column: quoted(&layout.output.header),
                value,
                rows,
            });
        }
        self.check_scale(file, layout)?;
        self.check_saturation(file, &layout.output)
    }

    fn check_scale(&self, file: &str, layout: &Layout) -> Result<(), Error> {
        let interval = median_step(&self.time) * layout.seconds;
        if !(1.0 / LARGEST..=LARGEST).contains(&interval) {
            return Err(Error::InvalidInterval {
                file: file.into(),
                column: quoted(&layout.time.header),
                interval: rounded(interval),
                low: 1.0 / LARGEST,
                high: LARGEST,
            });
        }
        let second = layout.input_2.as_ref().map(|found| (found, &self.input_2));
        let first = [(&layout.input, &self.input), (&layout.output, &self.output)];
        for (column, values) in first.into_iter().chain(second) {
            if let Some(k) = values.iter().position(|value| value.abs() > LARGEST) {
                return Err(Error::TooLarge {
                    file: file.into(),
                    row: self.rows[k],
                    column: quoted(&column.header),
                    value: values[k],
                    limit: LARGEST,
                });
            }
            let largest = values.iter().fold(0.0, |high: f64, v| high.max(v.abs()));
            if largest < 1.0 / LARGEST {
                return Err(Error::TooSmall {
                    file: file.into(),
                    column: quoted(&column.header),
                    value: rounded(largest),
                    limit: 1.0 / LARGEST,
                });
            }
        }
        Ok(())
    }

    fn check_gaps(&self, file: &str, column: &Found) -> Result<(), Error> {
        let interval = median_step(&self.time);
        let usual = quantile_of_steps(&self.time, USUAL);
        for (k, pair) in self.time.windows(2).enumerate() {
            let step = pair[1] - pair[0];
            if step > GAP * usual {
                return Err(Error::Gap {
                    file: file.into(),
                    row: self.rows[k + 1],
                    column: quoted(&column.header),
                    missing: (step / interval).round() as u64 - 1,
                    previous: pair[0],
                    time: pair[1],
                    interval: rounded(interval),
                });
            }
        }
        Ok(())
    }

    fn check_saturation(&self, file: &str, column: &Found) -> Result<(), Error> {
        let mut counts: HashMap<u64, usize> = HashMap::new();
        for value in &self.output {
            // + 0.0 makes one zero of the two.
            *counts.entry((value + 0.0).to_bits()).or_default() += 1;
        }
        let low = self.output.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self
            .output
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        let mut at = |value: f64| counts.remove(&(value + 0.0).to_bits()).unwrap_or(0);
        // The one lowest or highest sample of any record is no limit.
        let mut limit = |value| Some(at(value)).filter(|samples| *samples > 1).unwrap_or(0);
        let (at_low, at_high) = (limit(low), limit(high));
        let count = at_low + at_high;
        let commonest = counts.values().copied().max().unwrap_or(0);
        let rows = self.output.len();
        if count as f64 <= SATURATED_SHARE * rows as f64 || count <= SATURATED_RATIO * commonest {
            return Ok(());
        }
        let unit = if column.unit.is_empty() {
            String::new()
        } else {
            format!(" {}", quoted(&column.unit))
        };
        let limits = [(at_low, low), (at_high, high)]
            .iter()
            .filter(|(samples, _)| *samples > 0)
            .map(|(samples, value)| format!("{samples} at {value}{unit}"))
            .collect::<Vec<_>>()
            .join(", ");
        Err(Error::Saturated {
            file: file.into(),
            column: quoted(&column.header),
            count,
            rows,
            limits,
        })
    }
}

/// A number without the last digits, which are an accident of binary arithmetic.
fn rounded(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

/// The value of a signal that stays the same to a part in a billion.
pub(crate) fn constant(values: &[f64]) -> Option<f64> {
    let first = *values.first()?;
    values
        .iter()
        .all(|v| (v - first).abs() <= 1e-9 * first.abs())
        .then_some(first)
}
