//! Cells of a CSV file: numbers, and what stands there where a sample is missing.

use super::place::Place;
use crate::{Error, quoted};

/// What historians, loggers and spreadsheets write where there is no sample, in small letters. A cell that begins with one of them and goes
/// on with a blank or a colon is meant too (`Bad: sensor failure`).
const MISSING: &[&str] = &[
    "-",
    "--",
    "---",
    "?",
    "#n/a",
    "#na",
    "#value!",
    "#ref!",
    "n/a",
    "n.a.",
    "na",
    "nan",
    "null",
    "none",
    "nil",
    "bad",
    "badinput",
    "invalid",
    "uncertain",
    "questionable",
    "error",
    "err",
    "fault",
    "failed",
    "fail",
    "offline",
    "off-line",
    "disconnected",
    "timeout",
    "no",
    "nodata",
    "missing",
    "shutdown",
    "scan",
    "i/o",
    "comm",
    "under",
    "over",
    "calc",
    "pt",
];

/// Words that are meant only where another follows.
const BEGINNINGS: &[&str] = &["no", "scan", "i/o", "comm", "under", "over", "calc", "pt"];

/// Whether a cell says that its sample is missing.
pub(super) fn says_missing(cell: &str) -> bool {
    if cell.is_empty() {
        return true;
    }
    let lower = cell.to_lowercase();
    let end = lower.find([' ', ':', ';', ',', '(']).unwrap_or(lower.len());
    let (first, rest) = lower.split_at(end);
    let alone = rest.is_empty();
    // A sign in front of a number is no word.
    let number = rest.trim_start().starts_with(|c: char| c.is_ascii_digit());
    let is_sign = !first.contains(|c: char| c.is_alphanumeric());
    MISSING.contains(&first)
        && !(alone && BEGINNINGS.contains(&first))
        && !(!alone && (is_sign || number))
}

/// Whether a cell may be a unit: no number, and nothing that begins as a date or a number does.
pub(super) fn is_word(cell: &str) -> bool {
    let cell_is_number = cell.parse::<f64>().is_ok();
    cell.is_empty()
        || cell == "-"
        || !(cell_is_number || cell.starts_with(|c: char| c.is_ascii_digit() || "+-.,".contains(c)))
}

/// What a cell holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cell {
    Number(f64),
    /// Its sample is missing.
    Missing,
}

/// Turns cells into numbers.
pub(super) struct Numbers<'a> {
    decimal_comma_allowed: bool,
    /// The decimal mark seen so far.
    mark: Option<char>,
    /// A missing sample is refused.
    strict: bool,
    /// What stands for a missing sample beside the usual words: as text, and as a number where it is one.
    own: Vec<(&'a str, Option<f64>)>,
    scratch: String,
}

impl<'a> Numbers<'a> {
    pub fn new(decimal_comma_allowed: bool, strict: bool, missing: &'a [String]) -> Self {
        Self {
            decimal_comma_allowed,
            mark: None,
            strict,
            own: missing
                .iter()
                .map(|word| (word.trim(), word.trim().replace(',', ".").parse().ok()))
                .collect(),
            scratch: String::new(),
        }
    }

    /// A cell of a column whose samples may be missing.
    pub fn sample(&mut self, place: Place, cell: &str) -> Result<Cell, Error> {
        let value = self.value(cell);
        let own = |value: Option<f64>| {
            self.own
                .iter()
                .any(|(word, number)| *word == cell || value.is_some() && *number == value)
        };
        match value {
            Ok(value) if own(Some(value)) && !self.strict => Ok(Cell::Missing),
            Ok(value) if value.is_finite() && own(Some(value)) => Err(Error::TextInCell {
                file: place.file(),
                row: place.row(),
                column: place.column(),
                text: quoted(cell),
                mend: "[columns] says that it stands for a missing sample; leave out --strict to read on over it",
            }),
            Ok(value) if value.is_finite() => {
                self.check_mark(place, cell)?;
                Ok(Cell::Number(value))
            }
            // A number too large to be one is no word.
            Ok(_) if self.strict || cell.contains(|c: char| c.is_ascii_digit()) => {
                Err(Error::NotFinite {
                    file: place.file(),
                    row: place.row(),
                    column: place.column(),
                    text: quoted(cell),
                })
            }
            Ok(_) => Ok(Cell::Missing),
            Err(()) if own(None) && !self.strict => Ok(Cell::Missing),
            Err(()) if self.strict && cell.is_empty() => Err(Error::EmptyCell {
                file: place.file(),
                row: place.row(),
                column: place.column(),
            }),
            Err(()) if !self.strict && says_missing(cell) => Ok(Cell::Missing),
            Err(()) => Err(Error::TextInCell {
                file: place.file(),
                row: place.row(),
                column: place.column(),
                text: quoted(cell),
                mend: if cell.contains(',') {
                    "write decimals with a point and without separators for thousands"
                } else if self.strict {
                    "correct the cell, or leave out --strict where it says that the sample is missing"
                } else {
                    "correct the cell, or list the word under [columns] where it says that the sample is missing: missing = [\"...\"]"
                },
            }),
        }
    }

    /// A cell of the time's column, which holds a number.
    pub fn time(&mut self, place: Place, cell: &str) -> Result<f64, Error> {
        match self.value(cell) {
            Ok(value) if value.is_finite() => {
                self.check_mark(place, cell)?;
                Ok(value)
            }
            Ok(_) => Err(Error::NotFinite {
                file: place.file(),
                row: place.row(),
                column: place.column(),
                text: quoted(cell),
            }),
            Err(()) if cell.is_empty() => Err(Error::EmptyCell {
                file: place.file(),
                row: place.row(),
                column: place.column(),
            }),
            Err(()) => Err(Error::TextInCell {
                file: place.file(),
                row: place.row(),
                column: place.column(),
                text: quoted(cell),
                mend: "the rows before have the time as a number: write it so throughout",
            }),
        }
    }

    fn has_comma(&self, cell: &str) -> bool {
        self.decimal_comma_allowed
            && cell.bytes().filter(|byte| *byte == b',').count() == 1
            && !cell.contains('.')
    }

    fn value(&mut self, cell: &str) -> Result<f64, ()> {
        if self.has_comma(cell) {
            self.scratch.clear();
            let point = |c: char| if c == ',' { '.' } else { c };
            self.scratch.extend(cell.chars().map(point));
            self.scratch.parse().map_err(|_| ())
        } else {
            cell.parse().map_err(|_| ())
        }
    }

    /// A comma may separate thousands where other cells have a decimal point.
    fn check_mark(&mut self, place: Place, cell: &str) -> Result<(), Error> {
        let mark = if self.has_comma(cell) {
            Some(',')
        } else {
            cell.contains('.').then_some('.')
        };
        if let (Some(here), Some(before)) = (mark, self.mark)
            && here != before
        {
            let word = |mark| if mark == ',' { "comma" } else { "point" };
            return Err(Error::MixedDecimalMarks {
                file: place.file(),
                row: place.row(),
                column: place.column(),
                text: quoted(cell),
                here: word(here),
                before: word(before),
            });
        }
        self.mark = self.mark.or(mark);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quality_words_say_that_a_sample_is_missing() {
        for word in [
            "",
            "-",
            "Bad",
            "BAD",
            "NaN",
            "null",
            "#N/A",
            "No Data",
            "I/O Timeout",
            "Bad: sensor",
            "Scan Off",
            "offline",
        ] {
            assert!(says_missing(word), "{word}");
        }
        for word in [
            "- 1.95", "no_flow", "bad 3", "open", "12 cm", "on", "no", "over", "Badger",
        ] {
            assert!(!says_missing(word), "{word}");
        }
    }
}
