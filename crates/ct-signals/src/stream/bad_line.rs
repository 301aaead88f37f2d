//! Reasons why a line of a stream is not used.

use crate::csv::TIME_AS_NUMBER;
use crate::{CellMend, Names, TimestampError};

/// Reason why a line is not used; later lines may be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BadLine {
    /// A longer or a shorter row.
    #[error(
        "{found} fields where {expected} are read; check for a missing or a surplus {delimiter}, and whether the line is whole"
    )]
    Fields {
        /// Fields of a row.
        expected: usize,
        /// Fields of this one.
        found: usize,
        /// The delimiter's name.
        delimiter: &'static str,
    },
    /// An empty cell.
    #[error("column \"{column}\": the cell is empty; check the program that writes the rows")]
    Empty {
        /// The column's header.
        column: String,
    },
    /// The cell marks a missing sample.
    #[error("column \"{column}\": \"{text}\" stands for a missing sample")]
    Missing {
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
    },
    /// A number beyond the floating-point range.
    #[error(
        "column \"{column}\": \"{text}\" is not a finite number; check the program that writes the rows"
    )]
    NotFinite {
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
    },
    /// A time that is no number, where those before are.
    #[error("column \"{column}\": \"{text}\" is not a number; {TIME_AS_NUMBER}")]
    NoNumber {
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
    },
    /// A date or a time that is not understood.
    #[error("column \"{column}\": {error}")]
    Time {
        /// The column's header.
        column: String,
        /// Why.
        error: Box<TimestampError>,
    },
    /// The cell contains no number.
    #[error("{}", self.worded(&Names::LIBRARY))]
    Text {
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
        /// The correction.
        mend: CellMend,
    },
    /// The column uses both decimal marks.
    #[error(
        "column \"{column}\": \"{text}\" has another decimal mark than the rows before; use one of them throughout"
    )]
    DecimalMark {
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
    },
    /// Bytes that are not UTF-8 text.
    #[error(
        "the line is not UTF-8 text; check the speed of the line and the program that writes the rows"
    )]
    NotText,
}

impl BadLine {
    /// The message with the caller's names for what it has to change.
    #[must_use]
    pub fn worded(&self, names: &Names) -> String {
        match self {
            Self::Text { column, text, mend } => format!(
                "column \"{column}\": \"{text}\" is not a number; {}",
                mend.worded(names)
            ),
            // These name nothing of the caller's.
            Self::Fields { .. }
            | Self::Empty { .. }
            | Self::Missing { .. }
            | Self::NotFinite { .. }
            | Self::NoNumber { .. }
            | Self::Time { .. }
            | Self::DecimalMark { .. }
            | Self::NotText => self.to_string(),
        }
    }
}
