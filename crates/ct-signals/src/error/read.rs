//! What can be wrong with a file: each message names the file, the row, the column and the mend, in one line.

use crate::{ColumnFault, Names, TimestampError};

/// A file, or a stream, that cannot be read as a record.
///
/// `row` is the line number in the file as a text editor shows it, including the header.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
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
    /// The file is not text.
    #[error("{file}: this is not a text file but {found}; export it as CSV (UTF-8)")]
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
    #[error("{}", self.worded(&Names::LIBRARY))]
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
    #[error("{}", self.worded(&Names::LIBRARY))]
    EmptyCell {
        /// The path as it was given.
        file: String,
        /// Line number.
        row: u64,
        /// The column's header.
        column: String,
    },
    /// A cell holds something that is not a number.
    #[error("{}", self.worded(&Names::LIBRARY))]
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
        mend: CellMend,
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
    /// The header and the row of units below it give a column two units.
    #[error(
        "{file}, row {row}, column \"{column}\": this row of units says {below}; delete the unit that is wrong"
    )]
    TwoUnits {
        /// The path as it was given.
        file: String,
        /// Line number of the row of units.
        row: u64,
        /// The column's header.
        column: String,
        /// The unit of the row below.
        below: String,
    },
    /// A cell holds NaN or an infinity.
    #[error("{}", self.worded(&Names::LIBRARY))]
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
    #[error("{}", self.worded(&Names::LIBRARY))]
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
        /// Whether a clock that was set back explains it.
        clock: bool,
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
}

/// What to do about a cell that is not a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CellMend {
    /// Commas separate thousands.
    Thousands,
    /// The time is a number in the rows before.
    TimeAsNumber,
    /// [`Columns::missing`](crate::Columns::missing) lists the word, and missing samples are refused.
    Declared,
    /// The word may stand for a missing sample, and these are refused.
    Strict,
    /// The word may stand for a missing sample, and is not listed.
    Declare,
    /// The same in a stream.
    DeclareInStream,
}

/// The mend for a file that is too large.
fn too_large(largest: u64) -> &'static str {
    if largest == crate::LARGEST_RECORD {
        "split the record, or leave rows out"
    } else {
        "check that it is the right file"
    }
}
