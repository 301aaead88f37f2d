//! What can be wrong with a record or a setting: each message names the place, the numbers that
//! disagree and the mend, in one line.

use crate::{ColumnFault, TimestampError, shown};

/// Everything this crate can refuse.
///
/// `row` is always the line number in the file as a text editor shows it, the header's included.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file could not be opened or read.
    #[error("{file}: cannot be opened: {source}; check the path and the permissions")]
    CannotOpen {
        /// The path as it was given.
        file: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// A device, which may never end.
    #[error("{file}: it is a device; name a file or a pipe")]
    Device {
        /// The path as it was given.
        file: String,
    },
    /// A file that is larger than any of its kind.
    #[error("{file}: it has more than {largest} bytes, which is the most that is read; {}", too_large(*.largest))]
    FileTooLarge {
        /// The path as it was given.
        file: String,
        /// The most that is read \[bytes\].
        largest: u64,
    },
    /// A line that is longer than any row.
    #[error(
        "{file}, row {row}: the line has more than {longest} bytes; check what wrote the file, and end every row with a line feed"
    )]
    LongLine {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// The longest line that is read \[bytes\].
        longest: usize,
    },
    /// More columns than any record has.
    #[error(
        "{file}, row {row}: {found} columns, and {most} are the most; delete those that are not used"
    )]
    ManyColumns {
        /// The path as it was given.
        file: String,
        /// Line number of the header.
        row: u64,
        /// Columns of the file.
        found: usize,
        /// The most that are read.
        most: usize,
    },
    /// A folder where a file is expected.
    #[error("{file}: it is a folder; name a file in it")]
    Folder {
        /// The path as it was given.
        file: String,
    },
    /// The file is not text in an encoding that is understood.
    #[error("{file}: this is not a UTF-8 text file but {found}; export it as CSV (UTF-8)")]
    NotText {
        /// The path as it was given.
        file: String,
        /// What it looks like.
        found: &'static str,
    },
    /// Nothing in the file but blank lines and comments.
    #[error(
        "{file}: the file is empty; a header such as \"t [s],u [V],y [cm]\" and rows of numbers are needed"
    )]
    EmptyFile {
        /// The path as it was given.
        file: String,
    },
    /// The first row holds numbers where names are expected.
    #[error(
        "{file}, row {row}: the first row holds numbers ({first}), not names; put a header such as \"t [s],u [V],y [cm]\" above it"
    )]
    NoHeader {
        /// The path as it was given.
        file: String,
        /// Line number of the first row.
        row: u64,
        /// The first row.
        first: String,
    },
    /// Numbers without names, and neither time, input and outputs nor these with a reference.
    #[error(
        "{file}, row {row}: {found} numbers and no header; give t,u,{y} or t,r,u,{y}, or put a header such as \"t [s],u [V],y [cm]\" above",
        y = crate::stream::letters(*.outputs, ",")
    )]
    NoOrder {
        /// What is read.
        file: String,
        /// Line number.
        row: u64,
        /// Numbers in the row.
        found: usize,
        /// Outputs that are read.
        outputs: usize,
    },
    /// The columns of the file are not those that were named or are needed.
    #[error("{file}, row {row}{}", .fault.in_model())]
    Column {
        /// The path as it was given.
        file: String,
        /// Line number of the header.
        row: u64,
        /// What is wrong.
        fault: Box<ColumnFault>,
    },
    /// The time column's unit is not a unit of time that is understood.
    #[error(
        "{file}, row {row}, column \"{column}\": {unit} is not a unit of time; use us, ms, s, min, h or d"
    )]
    UnknownTimeUnit {
        /// The path as it was given.
        file: String,
        /// Line number of the header.
        row: u64,
        /// The column's header.
        column: String,
        /// The unit.
        unit: String,
    },
    /// A row is longer or shorter than the header.
    #[error(
        "{file}, row {row}: {found} fields, but the header has {expected}; check for a missing or a surplus {delimiter}, and for commas inside numbers"
    )]
    WrongFieldCount {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// Fields in the header.
        expected: usize,
        /// Fields in this row.
        found: usize,
        /// The delimiter's name.
        delimiter: &'static str,
    },
    /// A cell that is needed is empty.
    #[error(
        "{file}, row {row}, column \"{column}\": the cell is empty; fill it in, or leave out --strict: then its sample is missing"
    )]
    EmptyCell {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// The column's header.
        column: String,
    },
    /// A cell holds something that is not a number.
    #[error("{file}, row {row}, column \"{column}\": \"{text}\" is not a number; {mend}")]
    TextInCell {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
        /// What to do.
        mend: &'static str,
    },
    /// Below the header stands a row without a number.
    #[error(
        "{file}, row {row}: no cell is a number; if these are units, write them into the header, \"{header}\", and delete this row"
    )]
    UnitRow {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// The time's header with its unit.
        header: String,
    },
    /// A cell holds NaN or an infinity.
    #[error(
        "{file}, row {row}, column \"{column}\": \"{text}\" is not a finite number; replace it, or leave out --strict: then its sample is missing"
    )]
    NotFinite {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
    },
    /// The file uses both marks for decimals, so a comma may separate thousands.
    #[error(
        "{file}, row {row}, column \"{column}\": \"{text}\" has a decimal {here}, but earlier rows have a decimal {before}; use one of them throughout"
    )]
    MixedDecimalMarks {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
        /// The mark in this cell.
        here: &'static str,
        /// The mark in earlier cells.
        before: &'static str,
    },
    /// Two rows in a row have the same time.
    #[error(
        "{file}, row {row}, column \"{column}\": the time {time} is repeated from the row before; remove one of the two rows, or write the time with more digits"
    )]
    RepeatedTime {
        /// The path as it was given.
        file: String,
        /// Line number of the second of the two.
        row: u64,
        /// The column's header.
        column: String,
        /// The time, as the file gives it.
        time: Box<str>,
    },
    /// The time runs backward.
    #[error(
        "{file}, row {row}, column \"{column}\": the time goes back from {previous} to {time}; {mend}"
    )]
    BackwardTime {
        /// The path as it was given.
        file: String,
        /// Line number of the later row.
        row: u64,
        /// The column's header.
        column: String,
        /// The time in this row, as the file gives it.
        time: Box<str>,
        /// The time in the row before.
        previous: Box<str>,
        /// What to do.
        mend: &'static str,
    },
    /// A date or a time that is not understood.
    #[error("{file}, row {row}, column \"{column}\": {error}")]
    Timestamp {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// The column's header.
        column: String,
        /// What is wrong, and the mend.
        error: Box<TimestampError>,
    },
    /// A limit of the part of a file that is wanted is not understood.
    #[error("{option} \"{text}\": {mend}")]
    Bound {
        /// The option.
        option: &'static str,
        /// What was given.
        text: String,
        /// What to do.
        mend: String,
    },
    /// A grid of too many rows.
    #[error(
        "{record}: one row every {interval:e} s would be {rows:.3e} rows, and {most:e} are the most; give a longer interval with --resample, or check the dates of the first and the last row"
    )]
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
    /// A column without any sample.
    #[error(
        "{file}, row {row}, column \"{column}\": from here on the samples of all {rows} rows are missing ({words}); name another column under [columns], or choose another part with --from and --to"
    )]
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
    #[error(
        "{file}, row {row}, column \"{column}\": {missing} missing before this row (the time steps from {previous} to {time}, elsewhere by {interval} s); leave out --strict to go on over it, or split the file there",
        missing = samples(*.missing),
        interval = shown(*.interval)
    )]
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
    #[error(
        "{file}, column \"{column}\": the input is {value} in all {rows} rows, so nothing can be learnt about the process; record an experiment in which it moves, or name another column with input = \"...\" under [columns]",
        value = shown(*.value)
    )]
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
    #[error(
        "{file}, column \"{column}\": the output is {value} in all {rows} rows; check the sensor, or name another column with output = \"...\" under [columns]",
        value = shown(*.value)
    )]
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
        "{file}, column \"{column}\": no value is beyond {value:e}, which is too small to compute with; give the column in a smaller unit: above {limit:e}"
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
    /// A sampling interval that no process has.
    #[error(
        "{file}, column \"{column}\": the time steps by {interval:e} s, and between {low:e} and {high:e} s can be computed with; check the column and its unit"
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
        "{file}, column \"{column}\": {count} of {rows} samples sit exactly at a limit of the output ({limits}), where the sensor no longer sees the process; keep the experiment within the sensor's range, or cut those rows out: each part that is left is a record of its own"
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
    #[error("{record}: {rows} rows of data, but {needed} are needed{why}; give a longer record")]
    TooFewRows {
        /// The file or the record's name.
        record: String,
        /// Rows that are there.
        rows: usize,
        /// Rows that are needed.
        needed: usize,
        /// What they are needed for, or empty.
        why: String,
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
        /// Samples that are there.
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
    /// Whether it is a header's unit that is refused: it is none of the time, or another than the model's.
    #[must_use]
    pub fn of_units(&self) -> bool {
        match self {
            Self::UnknownTimeUnit { .. } => true,
            Self::Column { fault, .. } => matches!(**fault, ColumnFault::Unit { .. }),
            _ => false,
        }
    }
}

/// The mend for a file that is too large.
fn too_large(largest: u64) -> &'static str {
    if largest == crate::LARGEST_RECORD {
        "split the record, or leave rows out"
    } else {
        "check that it is the right file"
    }
}

fn samples(count: u64) -> String {
    if count == 1 {
        "1 sample is".into()
    } else {
        format!("{count} samples are")
    }
}
