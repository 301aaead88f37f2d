//! Errors of dates and times.

use thiserror::Error;

/// Reason why a date or a time is rejected; the caller knows the file, the row and the column.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TimestampError {
    /// No time zone has this name.
    #[error(
        "there is no time zone \"{zone}\"; give a name such as \"Europe/Berlin\" or \"UTC\", or an offset such as \"+01:00\""
    )]
    UnknownZone {
        /// The name.
        zone: String,
    },
    /// Every cell of the column is empty.
    #[error("there is no date or time to read; name another column")]
    NoCells,
    /// The first cell has no form that is known.
    #[error(
        "\"{text}\" is not a recognised date or time; give its format with time_format, such as \"%d.%m.%Y %H:%M:%S\", or give the time as a number"
    )]
    UnknownForm {
        /// The cell.
        text: String,
    },
    /// Day and month cannot be distinguished.
    #[error(
        "\"{text}\" is ambiguous: no date in the column shows which number is the day; set time_format = \"{day_first}\" or \"{month_first}\""
    )]
    DayOrMonth {
        /// The cell.
        text: String,
        /// The format with the day first.
        day_first: String,
        /// The format with the month first.
        month_first: String,
    },
    /// Some dates have the day first, others the month.
    #[error(
        "\"{text}\" has the {first_here} first, but dates elsewhere in the column have the other order; write all dates alike"
    )]
    BothOrders {
        /// The cell.
        text: String,
        /// `day` or `month`.
        first_here: &'static str,
    },
    /// A cell has another form than the first one.
    #[error(
        "\"{text}\" is not written as \"{first}\" further up; write all times alike, or split the file there"
    )]
    OtherForm {
        /// The cell.
        text: String,
        /// The first cell of the column.
        first: String,
    },
    /// A cell does not fit the format that was given.
    #[error(
        "\"{text}\" does not fit time_format = \"{format}\" ({reason}); correct the format or the cell"
    )]
    Format {
        /// The cell.
        text: String,
        /// The format.
        format: String,
        /// Reason for the mismatch.
        reason: String,
    },
    /// The date or time does not exist.
    #[error("\"{text}\" is not in the calendar or on the clock; correct the cell")]
    NoSuchTime {
        /// The cell.
        text: String,
    },
    /// Clocks go forward over this time.
    #[error(
        "\"{text}\" does not exist in {zone}, where the clocks go forward over it; if the clock of the record was not changed, set time_zone to its offset, such as \"+01:00\""
    )]
    SkippedTime {
        /// The cell.
        text: String,
        /// The zone.
        zone: String,
    },
    /// A bound given by the user is not understood.
    #[error("\"{text}\" is not an unambiguous date; write 2026-01-31 or \"2026-01-31 14:25\"")]
    UnknownBound {
        /// What was given.
        text: String,
    },
}
