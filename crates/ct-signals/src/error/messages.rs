//! Messages with the names of the caller.

use super::{CellMend, Error, PartLimit, ReadError, Shortage};
use crate::{Names, shown};

impl Error {
    /// The message with the caller's names for what it has to change.
    #[must_use]
    pub fn worded(&self, names: &Names) -> String {
        let Names {
            strict,
            from,
            to,
            in_columns,
            ..
        } = names;
        match self {
            Self::Read(error) => error.worded(names),
            Self::Bound { limit, text, mend } => {
                let limit = match limit {
                    PartLimit::From => from,
                    PartLimit::To => to,
                };
                format!("{limit} \"{text}\": {mend}")
            }
            Self::EmptyPart { text } => {
                format!("{to} \"{text}\": it is not after {from}: give a later one")
            }
            Self::Resampled {
                record,
                interval,
                rows,
                most,
            } => format!(
                "{record}: one row every {interval:e} s would be {rows:.3e} rows, and {most:e} are the most; give a longer interval with {}, or check the dates of the first and the last row",
                names.resample
            ),
            Self::NoSample {
                file,
                row,
                column,
                rows,
                words,
            } => format!(
                "{file}, row {row}, column \"{column}\": from here on the samples of all {rows} rows are missing ({words}); name another column {in_columns}, or choose another part {}",
                names.part
            ),
            Self::Gap {
                file,
                row,
                column,
                missing,
                previous,
                time,
                interval,
            } => format!(
                "{file}, row {row}, column \"{column}\": {} missing before this row (the time steps from {previous} to {time}, elsewhere by {} s); leave out {strict} to go on over it, or split the file there",
                samples(*missing),
                shown(*interval)
            ),
            Self::ConstantInput {
                file,
                column,
                value,
                rows,
            } => format!(
                "{file}, column \"{column}\": the input is {} in all {rows} rows, so nothing can be learnt about the process; record an experiment in which it moves, or name another column {in_columns}",
                shown(*value)
            ),
            Self::ConstantOutput {
                file,
                column,
                value,
                rows,
            } => format!(
                "{file}, column \"{column}\": the output is {} in all {rows} rows; check the sensor, or name another column {in_columns}",
                shown(*value)
            ),
            Self::TooFewRows {
                record,
                rows,
                needed,
                why,
            } => format!(
                "{record}: {rows} rows of data, but {needed} are needed{}; give a longer record",
                why.worded(names)
            ),
            // These name nothing of the caller's.
            Self::NoStretch { .. }
            | Self::TooLarge { .. }
            | Self::TooSmall { .. }
            | Self::InvalidInterval { .. }
            | Self::Saturated { .. }
            | Self::LengthMismatch { .. }
            | Self::ValueNotFinite { .. }
            | Self::TimeNotIncreasing { .. }
            | Self::InvalidSetting { .. }
            | Self::TooFewSamples { .. }
            | Self::SeriesMismatch { .. } => self.to_string(),
        }
    }
}

impl ReadError {
    /// The message with the caller's names for what it has to change.
    #[must_use]
    pub fn worded(&self, names: &Names) -> String {
        let strict = names.strict;
        match self {
            Self::Column { file, row, fault } => {
                format!("{file}, row {row}{}", fault.worded(names))
            }
            Self::EmptyCell { file, row, column } => format!(
                "{file}, row {row}, column \"{column}\": the cell is empty; fill it in, or leave out {strict}: then its sample is missing"
            ),
            Self::TextInCell {
                file,
                row,
                column,
                text,
                mend,
            } => format!(
                "{file}, row {row}, column \"{column}\": \"{text}\" is not a number; {}",
                mend.worded(names)
            ),
            Self::NotFinite {
                file,
                row,
                column,
                text,
            } => format!(
                "{file}, row {row}, column \"{column}\": \"{text}\" is not a finite number; replace it, or leave out {strict}: then its sample is missing"
            ),
            Self::BackwardTime {
                file,
                row,
                column,
                time,
                previous,
                clock,
            } => {
                let mend = if *clock {
                    format!(
                        "name the zone with time_zone = \"...\" {} where clocks were set back, or sort the rows by time",
                        names.in_columns
                    )
                } else {
                    "sort the rows by time, or split the file there: each part is a record of its own".to_string()
                };
                format!(
                    "{file}, row {row}, column \"{column}\": the time goes back from {previous} to {time}; {mend}"
                )
            }
            // These name nothing of the caller's.
            Self::CannotOpen { .. }
            | Self::Device { .. }
            | Self::FileTooLarge { .. }
            | Self::LongLine { .. }
            | Self::ManyColumns { .. }
            | Self::Folder { .. }
            | Self::NotText { .. }
            | Self::EmptyFile { .. }
            | Self::NoHeader { .. }
            | Self::NoOrder { .. }
            | Self::UnknownTimeUnit { .. }
            | Self::WrongFieldCount { .. }
            | Self::UnitRow { .. }
            | Self::TwoUnits { .. }
            | Self::MixedDecimalMarks { .. }
            | Self::RepeatedTime { .. }
            | Self::Timestamp { .. } => self.to_string(),
        }
    }
}

impl CellMend {
    pub(crate) fn worded(self, names: &Names) -> String {
        let Names {
            strict,
            columns,
            in_columns,
            ..
        } = names;
        match self {
            Self::Thousands => {
                "write decimals with a point and without separators for thousands".to_string()
            }
            Self::TimeAsNumber => crate::csv::TIME_AS_NUMBER.to_string(),
            Self::Declared => format!(
                "{columns} says that it stands for a missing sample; leave out {strict} to accept missing samples"
            ),
            Self::Strict => format!(
                "correct the cell, or leave out {strict} where it says that the sample is missing"
            ),
            Self::Declare => format!(
                "correct the cell, or list the word {in_columns} where it says that the sample is missing: missing = [\"...\"]"
            ),
            Self::DeclareInStream => format!(
                "check the program that writes the rows, or list the word {in_columns} where it says that the sample is missing"
            ),
        }
    }
}

impl Shortage {
    fn worded(self, names: &Names) -> String {
        match self {
            Self::Short => String::new(),
            Self::Outside { rows } => format!(
                " ({} and {} leave out {rows}; dates without a zone are those of time_zone, or UTC)",
                names.from, names.to
            ),
            Self::Resampled => format!(" on the grid of {}", names.resample),
            Self::Parameters {
                parameters,
                missing: true,
            } => format!(
                " to fit {parameters} parameters, and readings that are missing do not count"
            ),
            Self::Parameters {
                parameters,
                missing: false,
            } => format!(" to fit {parameters} parameters"),
        }
    }
}

fn samples(count: u64) -> String {
    if count == 1 {
        "1 sample is".into()
    } else {
        format!("{count} samples are")
    }
}
