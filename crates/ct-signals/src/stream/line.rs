//! What a line is, before the columns are known: a header, units, samples, or none of them.

use csv::{ReaderBuilder, StringRecord, Terminator, Trim};

use super::Rows;
use crate::csv::{DELIMITER_KEY, are_units, delimiter, is_number, says_missing};
use crate::{Columns, TimestampReader};

impl Rows {
    /// Whether a line is not part of a table: blank, empty cells alone, a comment, or the line in which spreadsheets name the delimiter, `sep=;`.
    #[must_use]
    pub fn is_before_table(line: &str) -> bool {
        let line = text(line);
        let is_empty = |line: &str| line.trim_matches([';', ',', '\t', ' ']).is_empty();
        line.starts_with('#') || is_empty(line.strip_prefix(DELIMITER_KEY).unwrap_or(line))
    }

    /// Whether the cells of the line below a header are units.
    #[must_use]
    pub fn gives_units(header: &str, below: &str) -> bool {
        let delimiter = delimiter(text(header));
        let names = cells(text(header), delimiter);
        let below = cells(text(below), delimiter);
        let used = below.iter().filter(|cell| !cell.is_empty()).count();
        names.len() == below.len()
            && 2 * used >= below.len()
            && are_units(&StringRecord::from(below))
    }

    /// Whether a line has samples: most of its cells are numbers, times, or marks of missing samples.
    #[must_use]
    pub fn has_samples(line: &str, columns: &Columns) -> bool {
        let cells = cells(text(line), delimiter(text(line)));
        let used = || cells.iter().filter(|cell| !cell.is_empty());
        let is_sample = |cell: &&String| is_number(cell) || TimestampReader::understands(cell);
        is_row(&cells, columns) || 2 * used().filter(is_sample).count() > used().count()
    }
}

/// Whether the cells of a first line are a row and no names: numbers only, or a complete or partial time, and marks of missing samples.
pub(super) fn is_row(cells: &[String], columns: &Columns) -> bool {
    let format = columns.time_format.as_deref();
    let is_time = |cell: &str| {
        is_number(cell)
            || TimestampReader::understands(cell)
            || is_end_of_time(cell)
            || format.is_some_and(|format| TimestampReader::new(Some(format), None, [cell]).is_ok())
    };
    let is_sample = |cell: &String| {
        is_number(cell)
            || says_missing(cell)
            || columns.missing.iter().any(|own| own.trim() == cell)
    };
    match cells {
        [time, samples @ ..] => is_time(time) && samples.iter().all(is_sample),
        [] => true,
    }
}

/// Whether a cell may be the end of a date or a time, if the stream was joined within a row.
fn is_end_of_time(cell: &str) -> bool {
    let part = |c: char| c.is_ascii_digit() || " -/.:+TZ".contains(c);
    cell.chars().all(part) && cell.ends_with(|c: char| c.is_ascii_digit() || c == 'Z')
}

/// A line without its byte-order mark and the blanks around it.
pub(super) fn text(line: &str) -> &str {
    let line = line.strip_prefix('\u{feff}').unwrap_or(line);
    // A tab at an end separates an empty cell.
    line.trim_matches([' ', '\r', '\n'])
}

/// The cells of a line, quotes taken away.
pub(super) fn cells(line: &str, delimiter: u8) -> Vec<String> {
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .delimiter(delimiter)
        .trim(Trim::All)
        // A line without its end, so that no character in it ends the line again.
        .terminator(Terminator::Any(b'\n'))
        .from_reader(line.as_bytes());
    let mut record = StringRecord::new();
    // From memory nothing fails.
    let _ = reader.read_record(&mut record);
    record.iter().map(str::to_string).collect()
}
