//! Where the table of a CSV file begins: lines above its header, its delimiter, and a row of units below the header.

use csv::StringRecord;

use super::cells::says_missing;
use super::text::{delimiter, is_before_header, reader};
use crate::{MOST_COLUMNS, TimestampReader, Unit};

/// Rows in which the header is looked for, and bytes.
const LONGEST_PREAMBLE: usize = 60;
const MOST_BYTES: usize = 1 << 20;

/// Rows above the header with more numbers than words, at most: a longer table is a table of its own, and is not skipped.
const MOST_NUMBERS_ABOVE: usize = 3;

/// The beginning of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Start {
    /// Byte at which the lines before the header end.
    pub begin: usize,
    pub delimiter: u8,
    /// Rows above the header.
    pub above: usize,
    /// The row below the header has units.
    pub units: bool,
}

impl Start {
    /// Finds the header: the first row of words with as many fields as the first row of numbers below it. If there is no such row, it is
    /// the first row, and errors refer to that row.
    pub fn of(text: &str) -> Self {
        let usual = delimiter(text);
        let text = beginning(text);
        let found = find(text, usual);
        if let Some((start, _)) = found.filter(|(start, _)| start.above == 0) {
            return start;
        }
        let others = b",\t;".iter().filter(|other| **other != usual);
        let found = found
            .into_iter()
            .chain(others.filter_map(|&other| find(text, other)));
        let widest = found.reduce(|best, other| if other.1 > best.1 { other } else { best });
        widest.map_or(
            Self {
                begin: 0,
                delimiter: usual,
                above: 0,
                units: false,
            },
            |(start, _)| start,
        )
    }
}

/// Whole lines at the beginning of a text.
fn beginning(text: &str) -> &str {
    match text.as_bytes().get(..MOST_BYTES) {
        None => text,
        Some(first) => {
            let end = first.iter().rposition(|byte| b"\r\n".contains(byte));
            &text[..end.map_or(0, |end| end + 1)]
        }
    }
}

/// A row at the beginning of a file.
struct Line {
    begin: usize,
    fields: usize,
    /// Fields up to the last one that is not empty.
    filled: usize,
    is_data: bool,
    is_units: bool,
    /// No cell is a number, a date or the mark of a missing sample.
    is_words: bool,
}

/// The header by one delimiter, with the number of its fields.
fn find(text: &str, delimiter: u8) -> Option<(Start, usize)> {
    let mut reader = reader(text, delimiter);
    let mut record = StringRecord::new();
    let mut lines: Vec<Line> = Vec::new();
    let mut numbers_above = 0;
    while lines.len() < LONGEST_PREAMBLE {
        let begin = usize::try_from(reader.position().byte()).ok()?;
        if !reader.read_record(&mut record).ok()? {
            return None;
        }
        if record.iter().all(str::is_empty) || lines.is_empty() && is_before_header(&record) {
            continue;
        }
        if record.len() > MOST_COLUMNS {
            return None;
        }
        let line = Line::of(&record, begin);
        if line.is_data && !lines.is_empty() {
            if let Some(header) = header_above(&lines, &line) {
                let above = &lines[header];
                let start = Start {
                    begin: above.begin,
                    delimiter,
                    above: header,
                    units: lines.get(header + 1).is_some_and(|line| line.is_units),
                };
                return Some((start, above.fields));
            }
            numbers_above += 1;
            if numbers_above > MOST_NUMBERS_ABOVE {
                return None;
            }
        }
        lines.push(line);
    }
    None
}

/// The first of the rows directly above a row of numbers that have as many fields. The first row of a file may be a header of any content;
/// a later one has words alone: it is no row in which samples are missing.
fn header_above(lines: &[Line], data: &Line) -> Option<usize> {
    let like = |line: &&Line| line.fields == data.fields && !line.is_data;
    let first = lines.len() - lines.iter().rev().take_while(like).count();
    let names = |at: &usize| {
        let line = &lines[*at];
        line.filled >= data.filled && (*at == 0 || line.is_words && !line.is_units)
    };
    (first..lines.len())
        .find(names)
        .filter(|_| data.fields >= 2)
}

impl Line {
    fn of(record: &StringRecord, begin: usize) -> Self {
        let filled = (0..record.len()).rfind(|&k| !record[k].is_empty());
        let used = record.iter().filter(|cell| !cell.is_empty()).count();
        let numbers = record.iter().filter(|cell| is_number_or_date(cell)).count();
        Self {
            begin,
            fields: record.len(),
            filled: filled.map_or(0, |last| last + 1),
            is_data: 2 * numbers > used,
            is_units: are_units(record) && 2 * used >= record.len(),
            is_words: numbers == 0
                && !record
                    .iter()
                    .any(|cell| !cell.is_empty() && says_missing(cell)),
        }
    }
}

/// Whether the cells are units, at least one of them of a quantity: `1,-,-` is a row in which samples are missing.
pub(crate) fn are_units(record: &StringRecord) -> bool {
    let is_number = |cell: &str| cell.parse::<f64>().is_ok();
    record
        .iter()
        .all(|cell| unit_of(cell).is_some() && !is_number(cell))
        && record
            .iter()
            .any(|cell| unit_of(cell).is_some_and(|unit| !unit.is_empty()))
}

fn is_number_or_date(cell: &str) -> bool {
    let number = |cell: &str| {
        cell.replace(',', ".")
            .parse::<f64>()
            .is_ok_and(f64::is_finite)
    };
    !cell.is_empty() && (number(cell) || TimestampReader::understands(cell))
}

/// The unit that a cell of a row of units gives, without brackets; empty where it gives none.
pub(super) fn unit_of(cell: &str) -> Option<&str> {
    let bracketed = [('[', ']'), ('(', ')')]
        .into_iter()
        .find_map(|(open, close)| cell.strip_prefix(open)?.strip_suffix(close));
    let unit = bracketed.unwrap_or(cell).trim();
    match unit {
        "" | "-" => Some(""),
        unit if says_missing(unit) => None,
        unit => Unit::parse(unit).map(|_| unit),
    }
}
