//! Cells of a CSV file: numbers, and marks of missing samples.

use super::place::Place;
use crate::{CellMend, Error, ReadError, TimestampError, quoted};

/// Marks of missing samples in historians, loggers and spreadsheets, in small letters. A cell that begins with one of them and continues
/// with a blank or a colon is a missing sample too (`Bad: sensor failure`).
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

/// Words that mark a missing sample only if a certain word follows.
const BEGINNINGS: &[&str] = &["no", "scan", "i/o", "comm", "under", "over", "calc", "pt"];

/// Whether a cell marks a missing sample.
pub(crate) fn says_missing(cell: &str) -> bool {
    if cell.is_empty() {
        return true;
    }
    let lower = cell.to_lowercase();
    let end = lower.find([' ', ':', ';', ',', '(']).unwrap_or(lower.len());
    let (first, rest) = lower.split_at(end);
    let alone = rest.is_empty();
    // A sign in front of a number does not make a word.
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

/// Content of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cell {
    Number(f64),
    /// The sample is missing.
    Missing,
}

/// Reason why a cell is rejected; the caller knows its row and its column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum CellFault {
    Empty,
    /// A number that is not finite.
    NotFinite,
    /// A word that is no mark of a missing sample.
    Word,
    /// Commas that are no decimal mark.
    Thousands,
    /// The cell marks a missing sample, and missing samples are not allowed.
    Strict,
    /// The time is a number in the rows before, and no number here.
    NoNumber,
    /// Another decimal mark than in the cells before.
    DecimalMark {
        here: char,
        before: char,
    },
    /// A date or a time that is not understood.
    Time(Box<TimestampError>),
}

impl CellFault {
    /// Converts the fault to an error of the file; `strict`: a missing sample is an error.
    pub(super) fn at(self, place: Place, cell: &str, strict: bool) -> Error {
        let (file, row, column) = (place.file(), place.row(), place.column());
        let mend = match self {
            Self::Empty => return Error::Read(ReadError::EmptyCell { file, row, column }),
            Self::NotFinite => {
                return Error::Read(ReadError::NotFinite {
                    file,
                    row,
                    column,
                    text: quoted(cell),
                });
            }
            Self::DecimalMark { here, before } => {
                let word = |mark| if mark == ',' { "comma" } else { "point" };
                return Error::Read(ReadError::MixedDecimalMarks {
                    file,
                    row,
                    column,
                    text: quoted(cell),
                    here: word(here),
                    before: word(before),
                });
            }
            Self::Time(error) => {
                return Error::Read(ReadError::Timestamp {
                    file,
                    row,
                    column,
                    error,
                });
            }
            Self::Thousands => CellMend::Thousands,
            Self::NoNumber => CellMend::TimeAsNumber,
            Self::Strict => CellMend::Declared,
            Self::Word if strict => CellMend::Strict,
            Self::Word => CellMend::Declare,
        };
        Error::Read(ReadError::TextInCell {
            file,
            row,
            column,
            text: quoted(cell),
            mend,
        })
    }
}

/// Correction for [`CellFault::NoNumber`].
pub(crate) const TIME_AS_NUMBER: &str =
    "the rows before have the time as a number: write it so throughout";

/// Turns cells into numbers.
#[derive(Debug, Clone)]
pub(crate) struct Numbers {
    decimal_comma_allowed: bool,
    /// The decimal mark found so far.
    mark: Option<char>,
    /// A missing sample is refused.
    strict: bool,
    /// Marks of a missing sample in addition to the usual words: as text, and as a number if it is one.
    own: Vec<(String, Option<f64>)>,
    scratch: String,
}

impl Numbers {
    pub fn new(decimal_comma_allowed: bool, strict: bool, missing: &[String]) -> Self {
        let own = missing.iter().map(|word| {
            let word = word.trim();
            (word.to_string(), word.replace(',', ".").parse().ok())
        });
        Self {
            decimal_comma_allowed,
            mark: None,
            strict,
            own: own.collect(),
            scratch: String::new(),
        }
    }

    /// A cell of a column whose samples may be missing.
    pub fn sample(&mut self, cell: &str) -> Result<Cell, CellFault> {
        let value = self.value(cell);
        let own = |value: Option<f64>| {
            self.own
                .iter()
                .any(|(word, number)| *word == cell || value.is_some() && *number == value)
        };
        match value {
            Ok(value) if own(Some(value)) && !self.strict => Ok(Cell::Missing),
            Ok(value) if value.is_finite() && own(Some(value)) => Err(CellFault::Strict),
            Ok(value) if value.is_finite() => {
                self.check_mark(cell)?;
                Ok(Cell::Number(value))
            }
            // A number beyond the floating-point range is no word.
            Ok(_) if self.strict || cell.contains(|c: char| c.is_ascii_digit()) => {
                Err(CellFault::NotFinite)
            }
            Ok(_) => Ok(Cell::Missing),
            Err(()) if own(None) && !self.strict => Ok(Cell::Missing),
            Err(()) if self.strict && cell.is_empty() => Err(CellFault::Empty),
            Err(()) if !self.strict && says_missing(cell) => Ok(Cell::Missing),
            Err(()) if cell.contains(',') => Err(CellFault::Thousands),
            Err(()) => Err(CellFault::Word),
        }
    }

    /// Reads a cell of the time column that contains a number.
    pub fn time(&mut self, cell: &str) -> Result<f64, CellFault> {
        match self.value(cell) {
            Ok(value) if value.is_finite() => {
                self.check_mark(cell)?;
                Ok(value)
            }
            Ok(_) => Err(CellFault::NotFinite),
            Err(()) if cell.is_empty() => Err(CellFault::Empty),
            Err(()) => Err(CellFault::NoNumber),
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
    fn check_mark(&mut self, cell: &str) -> Result<(), CellFault> {
        let mark = if self.has_comma(cell) {
            Some(',')
        } else {
            cell.contains('.').then_some('.')
        };
        if let (Some(here), Some(before)) = (mark, self.mark)
            && here != before
        {
            return Err(CellFault::DecimalMark { here, before });
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
