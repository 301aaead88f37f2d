//! What can be wrong with a record or a setting: each message names the place, the numbers that
//! disagree and the mend, in one line.

use crate::{ColumnFault, Names, duration, shown};

pub use read::{CellMend, ReadError};

mod messages;
mod read;

/// Errors of this crate.
///
/// `row` is the line number in the file as a text editor shows it, including the header.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be read as a record.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A limit of the part of a file that is wanted is not understood.
    #[error("{}", self.worded(&Names::LIBRARY))]
    Bound {
        /// Which limit.
        limit: PartLimit,
        /// What was given.
        text: String,
        /// What to do.
        mend: String,
    },
    /// The part of a file that is wanted ends before it begins.
    #[error("{}", self.worded(&Names::LIBRARY))]
    EmptyPart {
        /// The end that was given.
        text: String,
    },
    /// A grid of too many rows.
    #[error("{}", self.worded(&Names::LIBRARY))]
    Resampled {
        /// The record.
        record: String,
        /// The interval \[s\].
        interval: f64,
        /// Rows that it would have.
        rows: f64,
        /// The most that it may have.
        most: f64,
    },
    /// No part of a record between its gaps has enough readings.
    #[error(
        "{record}: no part between gaps has {readings} readings (the input can be held through gaps of at most {}); leave the record out, or fill its gaps",
        duration(*limit)
    )]
    NoStretch {
        /// The record.
        record: String,
        /// Readings that a part needs.
        readings: usize,
        /// The longest hold \[s\].
        limit: f64,
    },
    /// A column without any sample.
    #[error("{}", self.worded(&Names::LIBRARY))]
    NoSample {
        /// The path as it was given.
        file: String,
        /// Line number of the first row in use.
        row: u64,
        /// The column's header.
        column: String,
        /// The number of rows.
        rows: usize,
        /// What stands in their cells, quoted.
        words: String,
    },
    /// Samples are missing.
    #[error("{}", self.worded(&Names::LIBRARY))]
    Gap {
        /// The path as it was given.
        file: String,
        /// Line number of the first row after the gap.
        row: u64,
        /// The column's header.
        column: String,
        /// How many samples are missing.
        missing: u64,
        /// The time before the gap, as the file gives it.
        previous: Box<str>,
        /// The time after the gap.
        time: Box<str>,
        /// The median step of the time \[s\].
        interval: f64,
    },
    /// The input never moves.
    #[error("{}", self.worded(&Names::LIBRARY))]
    ConstantInput {
        /// The path as it was given.
        file: String,
        /// The column's header.
        column: String,
        /// Its value.
        value: f64,
        /// The number of rows.
        rows: usize,
    },
    /// The output never moves.
    #[error("{}", self.worded(&Names::LIBRARY))]
    ConstantOutput {
        /// The path as it was given.
        file: String,
        /// The column's header.
        column: String,
        /// Its value.
        value: f64,
        /// The number of rows.
        rows: usize,
    },
    /// A value whose powers overflow.
    #[error(
        "{file}, row {row}, column \"{column}\": {value:e} is too large to compute with; correct the cell, or give the column in a larger unit: below {limit:e}"
    )]
    TooLarge {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// The column's header.
        column: String,
        /// The value.
        value: f64,
        /// What has to be larger than it.
        limit: f64,
    },
    /// Values whose powers vanish.
    #[error(
        "{file}, column \"{column}\": the largest absolute value is {value:e}, which is too small to compute with; give the column in a smaller unit, so that it is above {limit:e}"
    )]
    TooSmall {
        /// The path as it was given.
        file: String,
        /// The column's header.
        column: String,
        /// The largest of the values, without its sign.
        value: f64,
        /// What has to be smaller than it.
        limit: f64,
    },
    /// A sampling interval outside the range that can be computed with.
    #[error(
        "{file}, column \"{column}\": the sampling interval is {interval:e} s, but it has to be between {low:e} and {high:e} s; check the column and its unit"
    )]
    InvalidInterval {
        /// The path as it was given.
        file: String,
        /// The column's header.
        column: String,
        /// The median step \[s\].
        interval: f64,
        /// Smallest possible \[s\].
        low: f64,
        /// Largest possible \[s\].
        high: f64,
    },
    /// The output sits at its limit for much of the record.
    #[error(
        "{file}, column \"{column}\": {count} of {rows} samples sit exactly at a limit of the output ({limits}), where the sensor does not measure the process; keep the experiment within the sensor's range, or cut those rows out and use each remaining part as a separate record"
    )]
    Saturated {
        /// The path as it was given.
        file: String,
        /// The column's header.
        column: String,
        /// Samples at the limits.
        count: usize,
        /// The number of rows.
        rows: usize,
        /// The limits, as text.
        limits: String,
    },
    /// The record is too short.
    #[error("{}", self.worded(&Names::LIBRARY))]
    TooFewRows {
        /// The file or the record's name.
        record: String,
        /// Available rows.
        rows: usize,
        /// Rows that are needed.
        needed: usize,
        /// What they are needed for, or where others are.
        why: Shortage,
    },
    /// The signals of a record have different lengths.
    #[error(
        "{record}: {signal} has {found} values but there are {expected} times; give one value for each time"
    )]
    LengthMismatch {
        /// The record's name.
        record: String,
        /// The signal's name.
        signal: String,
        /// The number of times.
        expected: usize,
        /// The number of values.
        found: usize,
    },
    /// A value in a record or a series is NaN or infinite.
    #[error("{record}: {signal}[{index}] is {value}; every value has to be finite",
        value = shown(*.value)
    )]
    ValueNotFinite {
        /// The record's name, or the function that refuses.
        record: String,
        /// The signal's name.
        signal: String,
        /// Index from 0.
        index: usize,
        /// The value.
        value: f64,
    },
    /// The times of a record do not increase.
    #[error(
        "{record}: time[{index}] = {time} s does not follow time[{index} - 1] = {previous} s; times have to increase",
        time = shown(*.time),
        previous = shown(*.previous)
    )]
    TimeNotIncreasing {
        /// The record's name.
        record: String,
        /// Index of the later time, from 0.
        index: usize,
        /// The later time \[s\].
        time: f64,
        /// The time before it \[s\].
        previous: f64,
    },
    /// A setting is outside its range.
    #[error("{setting} is {value}, but has to be {range}")]
    InvalidSetting {
        /// Which setting.
        setting: &'static str,
        /// Its value.
        value: String,
        /// What is allowed.
        range: String,
    },
    /// A series is too short for what is asked of it.
    #[error("{task}: {found} samples, but {needed} are needed; give a longer record or fewer lags")]
    TooFewSamples {
        /// What was asked.
        task: &'static str,
        /// Available samples.
        found: usize,
        /// Samples that are needed.
        needed: usize,
    },
    /// Two series that belong together have different lengths.
    #[error(
        "{task}: {first} and {second} samples; the two series have to be sampled at the same times"
    )]
    SeriesMismatch {
        /// What was asked.
        task: &'static str,
        /// Length of the first.
        first: usize,
        /// Length of the second.
        second: usize,
    },
}

impl Error {
    /// Whether a header lacks a column that is needed.
    #[must_use]
    pub fn lacks_a_column(&self) -> bool {
        match self {
            Self::Read(ReadError::Column { fault, .. }) => {
                matches!(**fault, ColumnFault::Missing { .. })
            }
            _ => false,
        }
    }

    /// Whether the unit of a header is refused: it is not a unit of time, or differs from that of the model.
    #[must_use]
    pub fn of_units(&self) -> bool {
        match self {
            Self::Read(ReadError::UnknownTimeUnit { .. }) => true,
            Self::Read(ReadError::Column { fault, .. }) => {
                matches!(**fault, ColumnFault::Unit { .. })
            }
            _ => false,
        }
    }
}

/// A limit of the part of a file that is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartLimit {
    /// [`ReadOptions::from`](crate::ReadOptions::from).
    From,
    /// [`ReadOptions::to`](crate::ReadOptions::to).
    To,
}

/// Why the rows of a record are too few.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shortage {
    /// The record is short.
    Short,
    /// Rows are outside the part that is wanted.
    Outside {
        /// Number of these rows.
        rows: usize,
    },
    /// The grid of [`ReadOptions::resample`](crate::ReadOptions::resample) is coarse.
    Resampled,
    /// So many parameters need more.
    Parameters {
        /// Number of parameters.
        parameters: usize,
        /// Whether readings are missing, which do not count.
        missing: bool,
    },
}
