//! Rows as they come on a stream, a line at a time: what a CSV file may hold, but without looking ahead.
//!
//! The first line that is neither blank nor a comment decides: where it holds names, [`Columns`] says which column is what, as
//! in a file; where it holds a time and numbers, they are time, reference, command and readings, or time, command and readings.
//! Understood as in a file: commas, semicolons or tabs, a decimal comma where commas do not separate, a byte-order mark, CRLF,
//! blank lines and comments, quotes, words where a sample is missing, times as numbers in a unit or as dates. The first row's time says how
//! they are written. A line that cannot be used is refused by itself, and the next one is read on.

use csv::{ReaderBuilder, StringRecord, Terminator, Trim};

use crate::columns::{Found, Layout, Purpose};
use crate::csv::{
    Cell, CellFault, Numbers, THOUSANDS, TIME_AS_NUMBER, Times, check_width, delimiter,
    delimiter_name, is_number, says_missing,
};
use crate::{
    Calendar, Columns, Conversion, Error, Timestamp, TimestampError, TimestampReader, escaped,
    quoted, unit,
};

/// The names of the columns in use, where they have no header.
const ROLES: [&str; 3] = ["time", "input", "output"];

/// How the times of rows are written.
#[derive(Debug, Clone, PartialEq)]
pub enum RowTimes {
    /// As numbers.
    Numbers,
    /// As times of day, which say no day; they count from the first row.
    TimesOfDay,
    /// As dates.
    Dates {
        /// Where the times count from.
        calendar: Calendar,
        /// The first cell has no offset from UTC: what it means follows from the zone.
        civil: bool,
    },
}

/// How rows are read.
#[derive(Debug, Clone)]
pub struct Rows {
    delimiter: u8,
    /// The header, where there is one: it may come again.
    header: Option<String>,
    /// Fields of a row.
    fields: usize,
    /// Positions of time, inputs and outputs.
    at: Vec<usize>,
    /// How many of them are inputs, one at least.
    inputs: usize,
    /// Their headers.
    names: Vec<String>,
    /// Units of inputs and outputs.
    units: Vec<String>,
    /// How inputs and outputs are converted to these, where the header has other ones.
    conversions: Vec<Option<Conversion>>,
    /// The cells of the latest row: time, inputs, outputs.
    values: Vec<Result<f64, BadLine>>,
    /// Seconds in one unit of the time, where it is a number.
    seconds: f64,
    columns: Columns,
    /// How the time is written; `None` until a row has been read.
    times: Option<Times>,
    /// Where dates count from and what they follow, where this is known beforehand.
    start: Option<(Timestamp, Timestamp)>,
    /// Dates of this stream have no offset.
    civil: bool,
    numbers: Numbers,
}

/// What a line holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Line {
    /// Time \[s\] and the first input, NaN where there is none; all inputs are in [`Rows::inputs`], the outputs in [`Rows::outputs`].
    Row([f64; 2]),
    /// Nothing: it is blank, a comment, or the header again.
    Nothing,
}

/// Why a line is not used; the next one may be.
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
    #[error("column \"{column}\": the cell is empty; check what writes the rows")]
    Empty {
        /// The column's header.
        column: String,
    },
    /// A cell that says that its sample is missing.
    #[error("column \"{column}\": \"{text}\" stands for a missing sample")]
    Missing {
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
    },
    /// A number too large to be one.
    #[error("column \"{column}\": \"{text}\" is not a finite number; check what writes the rows")]
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
    /// A cell that holds no number.
    #[error("column \"{column}\": \"{text}\" is not a number; {mend}")]
    Text {
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
        /// What to do.
        mend: &'static str,
    },
    /// Both marks for decimals.
    #[error(
        "column \"{column}\": \"{text}\" has another decimal mark than the rows before; use one of them throughout"
    )]
    DecimalMark {
        /// The column's header.
        column: String,
        /// The cell.
        text: String,
    },
    /// Bytes that are no text.
    #[error("the line is not UTF-8 text; check the speed of the line and what writes the rows")]
    NotText,
}

impl Rows {
    /// From the first line that is neither blank nor a comment; `file` names the stream in messages, `row` is the line's number.
    /// The second value is whether the line is a row, to be read by [`Rows::read`] too.
    ///
    /// # Errors
    /// As of [`read_csv`](crate::read_csv) for a header; [`Error::NoOrder`] for numbers that are neither time, input and outputs nor these with
    /// a reference. There is one output where `columns` name none.
    pub fn begin(
        file: &str,
        row: u64,
        line: &str,
        columns: &Columns,
    ) -> Result<(Self, bool), Error> {
        let line = text(line);
        let delimiter = delimiter(line);
        let cells = cells(line, delimiter);
        let mut rows = Self {
            delimiter,
            header: None,
            fields: cells.len(),
            at: Vec::new(),
            inputs: 1,
            names: Vec::new(),
            units: Vec::new(),
            conversions: Vec::new(),
            values: Vec::new(),
            seconds: 1.0,
            columns: columns.clone(),
            times: None,
            start: None,
            civil: false,
            numbers: Numbers::new(delimiter != b',', false, &columns.missing),
        };
        if is_row(&cells, columns) {
            let outputs = columns.outputs.len().max(1);
            // Where the first channel stands: behind the time, or behind the reference that follows it.
            let inputs = usize::from(!columns.without_inputs);
            let first = match cells.len().checked_sub(outputs + inputs) {
                Some(1) => 1,
                Some(2) if inputs > 0 => 2,
                _ => {
                    return Err(Error::NoOrder {
                        file: file.into(),
                        row,
                        found: cells.len(),
                        outputs,
                    });
                }
            };
            rows.inputs = inputs;
            let channels = inputs + outputs;
            rows.at = std::iter::once(0).chain(first..first + channels).collect();
            let named = |names: &[String], at: usize| {
                let name = names.get(at).filter(|name| !name.is_empty());
                name.cloned().unwrap_or_default()
            };
            rows.names = vec![columns.time.clone().unwrap_or_default()];
            rows.names
                .extend((0..inputs).map(|input| named(&columns.inputs, input)));
            rows.names
                .extend((0..outputs).map(|output| named(&columns.outputs, output)));
            let units = rows.names[1..].iter();
            rows.units = units
                .map(|name| escaped(unit::split(name).1).into_owned())
                .collect();
            for (i, name) in rows.names.iter_mut().enumerate() {
                if name.is_empty() {
                    let role = if i > inputs { ROLES.len() - 1 } else { i };
                    *name = ROLES[role].to_string();
                }
            }
            rows.conversions = vec![None; channels];
            rows.seconds = columns.time_header().1;
            rows.values = vec![Ok(f64::NAN); rows.at.len()];
            return Ok((rows, true));
        }
        check_width(file, row, cells.len())?;
        let Layout {
            time,
            seconds,
            inputs,
            outputs,
            ..
        } = columns.resolve(file, row, &cells, Purpose::Fit)?;
        rows.inputs = inputs.len();
        rows.at = vec![time.index];
        rows.names = vec![time.header];
        for Found {
            index,
            header,
            unit,
            converted,
            ..
        } in inputs.into_iter().chain(outputs)
        {
            rows.at.push(index);
            rows.names.push(header);
            rows.units.push(escaped(&unit).into_owned());
            rows.conversions.push(converted.map(|(_, by)| by));
        }
        rows.seconds = seconds;
        rows.values = vec![Ok(f64::NAN); rows.at.len()];
        rows.header = Some(line.to_string());
        Ok((rows, false))
    }

    /// Whether a header has named the columns.
    #[must_use]
    pub fn has_header(&self) -> bool {
        self.header.is_some()
    }

    /// The header of the time, or of an input or output, counted from zero among its kind: `time`, `input`, `output`.
    #[must_use]
    pub fn name(&self, role: &str, at: usize) -> &str {
        let before = match ROLES.iter().position(|known| *known == role) {
            Some(0) => 0,
            Some(1) => 1,
            _ => 1 + self.inputs,
        };
        self.names.get(before + at).map_or("", String::as_str)
    }

    /// Units of inputs and outputs, in order and in printable text; empty where nothing says.
    pub fn units(&self) -> impl Iterator<Item = &str> {
        self.units.iter().map(String::as_str)
    }

    /// The outputs of the row that was read last, or why there is none: its cell says that the sample is missing, or holds no number.
    pub fn outputs(&self) -> &[Result<f64, BadLine>] {
        &self.values[1 + self.inputs..]
    }

    /// The inputs of the row that was read last, finite or not.
    pub fn inputs(&self) -> impl Iterator<Item = f64> {
        let inputs = self.values[1..=self.inputs].iter();
        inputs.map(|value| *value.as_ref().unwrap_or(&f64::NAN))
    }

    /// Seconds in one unit of the time, as its header has it.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// How the times are written, once a row has been read.
    #[must_use]
    pub fn times(&self) -> Option<RowTimes> {
        let times = self.times.as_ref()?;
        Some(match (times, times.calendar()) {
            (_, Some(calendar)) => RowTimes::Dates {
                calendar,
                civil: self.civil,
            },
            (Times::Dates { .. }, None) => RowTimes::TimesOfDay,
            (Times::Numbers(_), None) => RowTimes::Numbers,
        })
    }

    /// Dates count from the zero of a calendar, and not from the first row; the latest row before was at `last` \[s\].
    pub fn count_from(&mut self, calendar: &Calendar, last: f64) {
        self.start = Some((calendar.start, calendar.start.after(last)));
    }

    /// The times go on as those of other rows of the same stream, which came before: dates count from the same zero, and what was a number
    /// stays one.
    pub fn go_on(&mut self, before: &Self) {
        self.times = match &before.times {
            Some(Times::Numbers(_)) => Some(Times::Numbers(self.seconds)),
            times => times.clone(),
        };
        self.civil = before.civil;
        self.start = before.start;
    }

    /// In which order a row's fields are read, in words.
    #[must_use]
    pub fn order(&self) -> String {
        let (inputs, outputs) = self.names[1..].split_at(self.inputs);
        let readings = if outputs.len() == 1 {
            "reading"
        } else {
            "readings"
        };
        if self.header.is_some() {
            let list = |names: &[String]| {
                let names = names.iter().map(|name| format!("\"{}\"", quoted(name)));
                names.collect::<Vec<_>>().join(", ")
            };
            let inputs = match inputs.len() {
                0 => String::new(),
                1 => format!(" {} the command,", list(inputs)),
                _ => format!(" {} the inputs,", list(inputs)),
            };
            return format!(
                "a header: \"{}\" is the time,{inputs} {} the {readings}",
                quoted(&self.names[0]),
                list(outputs)
            );
        }
        let (reference, r) = if self.fields > self.names.len() {
            (" reference,", " r,")
        } else {
            ("", "")
        };
        let (command, u) = match inputs.len() {
            0 => ("", ""),
            _ => (" command,", " u,"),
        };
        format!(
            "no header: the columns are taken as time,{reference}{command} {readings} (t,{r}{u} {})",
            letters(outputs.len(), ", ")
        )
    }

    /// Reads a line, which was cut off at its end: a carriage return or a line feed within it is part of a cell.
    ///
    /// # Errors
    /// [`BadLine`]: the line is not used.
    pub fn read(&mut self, line: &[u8]) -> Result<Line, BadLine> {
        let line = std::str::from_utf8(line).map_err(|_| BadLine::NotText)?;
        let line = text(line);
        if line.is_empty() || line.starts_with('#') {
            return Ok(Line::Nothing);
        }
        if self.header.as_deref() == Some(line) {
            return Ok(Line::Nothing);
        }
        if line.contains('"') {
            let cells = cells(line, self.delimiter);
            self.check_count(cells.len())?;
            for role in 0..self.at.len() {
                let cell = cells.get(self.at[role]).map_or("", String::as_str);
                self.values[role] = self.value(role, cell);
            }
        } else {
            let fields = || line.split(char::from(self.delimiter));
            // A row that is not whole has wrong cells too.
            self.check_count(fields().count())?;
            for (i, cell) in line.split(char::from(self.delimiter)).enumerate() {
                let Some(role) = self.at.iter().position(|at| *at == i) else {
                    continue;
                };
                self.values[role] = self.value(role, cell.trim());
            }
        }
        for (value, conversion) in self.values[1..].iter_mut().zip(&self.conversions) {
            if let (Ok(value), Some(conversion)) = (value, conversion) {
                *value = conversion.apply(*value);
            }
        }
        let value = |role: usize| self.values[role].clone();
        // Every input is needed.
        for role in 2..=self.inputs {
            value(role)?;
        }
        let command = if self.inputs == 0 {
            f64::NAN
        } else {
            value(1)?
        };
        Ok(Line::Row([value(0)?, command]))
    }

    fn check_count(&self, found: usize) -> Result<(), BadLine> {
        if found == self.fields {
            return Ok(());
        }
        Err(BadLine::Fields {
            expected: self.fields,
            found,
            delimiter: delimiter_name(self.delimiter),
        })
    }

    /// The cell of a role: the time \[s\], or a sample.
    fn value(&mut self, role: usize, cell: &str) -> Result<f64, BadLine> {
        let sample = match role {
            0 if says_missing(cell) => Ok(Cell::Missing),
            0 => self.time(cell).map(Cell::Number),
            _ => self.numbers.sample(cell),
        };
        let (column, text) = (|| quoted(&self.names[role]), || quoted(cell));
        let mend = match sample {
            Ok(Cell::Number(value)) => return Ok(value),
            Err(CellFault::Empty) => return Err(BadLine::Empty { column: column() }),
            Ok(Cell::Missing) if cell.is_empty() => {
                return Err(BadLine::Empty { column: column() });
            }
            Ok(Cell::Missing) => {
                return Err(BadLine::Missing {
                    column: column(),
                    text: text(),
                });
            }
            Err(CellFault::NotFinite) => {
                return Err(BadLine::NotFinite {
                    column: column(),
                    text: text(),
                });
            }
            Err(CellFault::DecimalMark { .. }) => {
                return Err(BadLine::DecimalMark {
                    column: column(),
                    text: text(),
                });
            }
            Err(CellFault::Time(error)) => {
                return Err(BadLine::Time {
                    column: column(),
                    error,
                });
            }
            Err(CellFault::Thousands) => THOUSANDS,
            Err(CellFault::NoNumber) => {
                return Err(BadLine::NoNumber {
                    column: column(),
                    text: text(),
                });
            }
            Err(CellFault::Word | CellFault::Strict) => {
                "check what writes the rows, or list the word under [columns] where it says that the sample is missing"
            }
        };
        Err(BadLine::Text {
            column: column(),
            text: text(),
            mend,
        })
    }

    /// The time of a row \[s\]; the first one says how times are written.
    fn time(&mut self, cell: &str) -> Result<f64, CellFault> {
        if let Some(times) = &mut self.times {
            return times.read(cell, &mut self.numbers);
        }
        // There is no more of the column to look at.
        let all = || vec![cell.to_string()];
        let mut times = Times::of(cell, all, self.seconds, &self.columns)?;
        if let Times::Dates { reader, first } = &mut times {
            let order = reader.require_order(cell);
            order.map_err(|error| CellFault::Time(Box::new(error)))?;
            self.civil = reader.is_civil(cell);
            if let Some((start, last)) = self.start
                && reader.has_dates()
            {
                *first = start;
                reader.follow(last);
            }
        }
        let time = times.read(cell, &mut self.numbers)?;
        self.times = Some(times);
        Ok(time)
    }
}

/// Whether the cells of a first line are a row, and no names: numbers alone, or a time, whole or the end of one, and what may stand for samples.
fn is_row(cells: &[String], columns: &Columns) -> bool {
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

/// Whether a cell may be what is left of a date or a time where a stream was joined within a row.
fn is_end_of_time(cell: &str) -> bool {
    let part = |c: char| c.is_ascii_digit() || " -/.:+TZ".contains(c);
    cell.chars().all(part) && cell.ends_with(|c: char| c.is_ascii_digit() || c == 'Z')
}

/// What so many readings of a row without a header are called.
pub(crate) fn letters(outputs: usize, between: &str) -> String {
    let of_output = |output: usize| match outputs {
        1 => "y".to_string(),
        _ => format!("y{output}"),
    };
    let letters: Vec<String> = (1..=outputs).map(of_output).collect();
    letters.join(between)
}

/// A line without its byte-order mark and the blanks around it.
fn text(line: &str) -> &str {
    let line = line.strip_prefix('\u{feff}').unwrap_or(line);
    // A tab at an end separates an empty cell.
    line.trim_matches([' ', '\r', '\n'])
}

/// The cells of a line, quotes taken away.
fn cells(line: &str, delimiter: u8) -> Vec<String> {
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .delimiter(delimiter)
        .trim(Trim::All)
        // The line was cut at its end, so nothing in it ends it again.
        .terminator(Terminator::Any(b'\n'))
        .from_reader(line.as_bytes());
    let mut record = StringRecord::new();
    // From memory nothing fails.
    let _ = reader.read_record(&mut record);
    record.iter().map(str::to_string).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(first: &str) -> (Rows, bool) {
        Rows::begin("input", 1, first, &Columns::default()).unwrap()
    }

    fn read(rows: &mut Rows, line: &str) -> Result<Line, String> {
        rows.read(line.as_bytes()).map_err(|bad| bad.to_string())
    }

    #[test]
    fn a_header_says_the_order_and_the_units() {
        let (mut rows, row) = rows("\u{feff}y [cm];u [V];t [min];note\r\n");
        assert!(!row);
        assert!(rows.units().eq(["V", "cm"]));
        assert_eq!(
            read(&mut rows, "12,5; 4 ;0,5;\"a; b\"\r\n"),
            Ok(Line::Row([30.0, 4.0]))
        );
        assert_eq!(rows.outputs(), [Ok(12.5)]);
        assert_eq!(
            read(&mut rows, "y [cm];u [V];t [min];note"),
            Ok(Line::Nothing)
        );
        assert_eq!(read(&mut rows, "# a comment"), Ok(Line::Nothing));
        // The command of a row counts whatever the reading is.
        assert_eq!(read(&mut rows, "12.5;4;1;"), Ok(Line::Row([60.0, 4.0])));
        let bad = rows.outputs()[0].clone().unwrap_err();
        assert!(
            bad.to_string()
                .contains("\"12.5\" has another decimal mark"),
            "{bad}"
        );
        let message = read(&mut rows, "12,5;4").unwrap_err();
        assert!(
            message.starts_with("2 fields where 4 are read"),
            "{message}"
        );
    }

    #[test]
    fn without_a_header_three_or_four_numbers_have_an_order() {
        let (mut four, row) = rows("0, 15, 4.5, 14.8");
        assert!(row);
        assert_eq!(
            read(&mut four, "0, 15, 4.5, 14.8"),
            Ok(Line::Row([0.0, 4.5]))
        );
        assert_eq!(four.outputs(), [Ok(14.8)]);
        let (mut three, _) = rows("0\t4\t14");
        assert_eq!(read(&mut three, "1\t5\t15"), Ok(Line::Row([1.0, 5.0])));
        assert_eq!(three.outputs(), [Ok(15.0)]);
        assert_eq!(read(&mut three, "1\t5\t"), Ok(Line::Row([1.0, 5.0])));
        let bad = three.outputs()[0].clone().unwrap_err();
        assert_eq!(
            bad.to_string(),
            "column \"output\": the cell is empty; check what writes the rows"
        );
        let message = read(&mut three, "1\t\t5").unwrap_err();
        assert_eq!(
            message,
            "column \"input\": the cell is empty; check what writes the rows"
        );
        let message = read(&mut three, "12:30\t5\t1").unwrap_err();
        assert!(message.contains("write it so throughout"), "{message}");
        let error = Rows::begin("input", 3, "1,2", &Columns::default()).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("input, row 3: 2 numbers and no header")
        );
        assert_eq!(three.read(&[0xff, 0xfe]), Err(BadLine::NotText));
    }

    #[test]
    fn several_outputs_are_read_in_the_order_in_which_they_are_named() {
        let columns = Columns {
            outputs: vec!["upper [cm]".into(), "lower [cm]".into()],
            ..Columns::default()
        };
        let begin = |line: &str| Rows::begin("input", 1, line, &columns);
        let (mut rows, _) = begin("t,lower [mm],u [V],upper [cm]").unwrap();
        assert!(rows.units().eq(["V", "cm", "cm"]));
        assert_eq!(read(&mut rows, "1,100,4,12"), Ok(Line::Row([1.0, 4.0])));
        assert_eq!(rows.outputs(), [Ok(12.0), Ok(10.0)]);
        assert_eq!(rows.name("output", 1), "lower [mm]");
        // Either may be lost for itself, in one row.
        assert_eq!(read(&mut rows, "2,,4,12"), Ok(Line::Row([2.0, 4.0])));
        assert_eq!(rows.outputs()[0], Ok(12.0));
        let bad = rows.outputs()[1].clone().unwrap_err();
        assert_eq!(
            bad.to_string(),
            "column \"lower [mm]\": the cell is empty; check what writes the rows"
        );

        let (mut rows, _) = begin("0,15,4.5,14.8,9.1").unwrap();
        assert_eq!(
            rows.order(),
            "no header: the columns are taken as time, reference, command, readings (t, r, u, y1, y2)"
        );
        read(&mut rows, "0,15,4.5,14.8,9.1").unwrap();
        assert_eq!(rows.outputs(), [Ok(14.8), Ok(9.1)]);
        let message = begin("0,4.5,14.8").unwrap_err().to_string();
        assert!(message.contains("3 numbers and no header"), "{message}");
        assert!(message.contains("t,u,y1,y2"), "{message}");
    }

    #[test]
    fn rows_of_a_model_without_inputs_have_a_time_and_outputs() {
        let columns = Columns {
            without_inputs: true,
            ..Columns::default()
        };
        for (first, order) in [
            (
                "t,y [rad]",
                "a header: \"t\" is the time, \"y [rad]\" the reading",
            ),
            (
                "0,1.5",
                "no header: the columns are taken as time, reading (t, y)",
            ),
        ] {
            let (mut rows, is_row) = Rows::begin("input", 1, first, &columns).unwrap();
            assert_eq!(is_row, first == "0,1.5");
            assert_eq!(rows.order(), order);
            assert!(matches!(read(&mut rows, "1,2.5"), Ok(Line::Row([1.0, _]))));
            assert_eq!(rows.outputs(), [Ok(2.5)]);
            assert_eq!(rows.inputs().count(), 0);
            // The row stays where its reading is missing.
            assert!(matches!(read(&mut rows, "2,"), Ok(Line::Row([2.0, _]))));
            assert!(rows.outputs()[0].is_err());
        }
        let (mut rows, _) = Rows::begin("input", 1, "u,t,y", &columns).unwrap();
        read(&mut rows, "7,1,2.5").unwrap();
        assert_eq!(rows.outputs(), [Ok(2.5)]);
    }

    #[test]
    fn times_may_be_dates_and_words_stand_for_missing_samples() {
        let columns = Columns {
            time_zone: Some("Europe/Berlin".into()),
            missing: vec!["-999".into()],
            ..Columns::default()
        };
        let (mut rows, _) = Rows::begin("input", 1, "t;u;y", &columns).unwrap();
        assert_eq!(rows.times(), None);
        // Over the hour that is left out in spring.
        for (line, time, reading) in [
            ("29.03.2026 01:59:58,5;4;12,5", 0.0, Some(12.5)),
            ("29.03.2026 03:00:00;4;Bad", 1.5, None),
            ("29.03.2026 03:00:01;4;-999", 2.5, None),
        ] {
            assert_eq!(read(&mut rows, line), Ok(Line::Row([time, 4.0])), "{line}");
            assert_eq!(rows.outputs()[0].clone().ok(), reading, "{line}");
        }
        let message = read(&mut rows, "29.03.2026 02:30:00;4;12").unwrap_err();
        assert!(
            message.contains("does not exist in Europe/Berlin"),
            "{message}"
        );
        let message = read(&mut rows, "I/O Timeout;4;12").unwrap_err();
        assert!(message.contains("stands for a missing sample"), "{message}");
        let Some(RowTimes::Dates { calendar, civil }) = rows.times() else {
            panic!("{:?}", rows.times());
        };
        assert!(civil);
        assert_eq!(calendar.at(0.0), "2026-03-29 01:59:58.5");

        // Other rows of the same stream count from the same zero.
        let again = || Rows::begin("input", 9, "y;t;u", &columns).unwrap().0;
        let mut on = again();
        on.go_on(&rows);
        assert_eq!(
            read(&mut on, "1;29.03.2026 03:00:08;4"),
            Ok(Line::Row([9.5, 4.0]))
        );
        let mut restored = again();
        restored.count_from(&calendar, 9.5);
        assert_eq!(
            read(&mut restored, "1;29.03.2026 03:00:09;4"),
            Ok(Line::Row([10.5, 4.0]))
        );
        // The hour that comes twice: where the rows stood tells which.
        let october = 210.0 * 86_400.0;
        let mut second = again();
        second.count_from(&calendar, october + 3.0 * 3600.0);
        read(&mut second, "1;25.10.2026 02:30:00;4").unwrap();
        let mut first = again();
        first.count_from(&calendar, october - 7200.0);
        read(&mut first, "1;25.10.2026 02:30:00;4").unwrap();
        let time = |rows: &Rows| *rows.values[0].as_ref().unwrap();
        assert_eq!(time(&second) - time(&first), 3600.0);
    }

    #[test]
    fn dates_need_no_header() {
        let (mut rows, row) = rows("2026-01-31T14:25:00+01:00,15,4.5,Bad");
        assert!(row);
        let line = "2026-01-31T14:26:00+01:00,15,4.5,12";
        read(&mut rows, "2026-01-31T14:25:00+01:00,15,4.5,Bad").unwrap();
        assert_eq!(read(&mut rows, line), Ok(Line::Row([60.0, 4.5])));
        let Some(RowTimes::Dates { calendar, civil }) = rows.times() else {
            panic!("{:?}", rows.times());
        };
        assert!(!civil);
        assert_eq!(calendar.rfc3339(60.0), "2026-01-31T14:26:00+01:00");
        let message = read(&mut rows, "12,15,4.5,12").unwrap_err();
        assert!(message.contains("write all times alike"), "{message}");

        let (mut clock, _) = super::tests::rows("23:59:59,4.5,12");
        read(&mut clock, "23:59:59,4.5,12").unwrap();
        assert_eq!(clock.times(), Some(RowTimes::TimesOfDay));
        assert_eq!(
            read(&mut clock, "00:00:01,4.5,12"),
            Ok(Line::Row([2.0, 4.5]))
        );
    }

    #[test]
    fn the_end_of_a_date_is_no_header() {
        for end in ["5:00", ":02", "-29 10:00:02", "9T10:00:02Z", "00+01:00"] {
            let line = format!("{end},4.5,Bad");
            let (mut rows, row) = rows(&line);
            assert!(row, "{end}");
            assert!(matches!(
                rows.read(line.as_bytes()),
                Err(BadLine::Time { .. })
            ));
            assert_eq!(
                read(&mut rows, "2026-03-29 10:00:02,4,12"),
                Ok(Line::Row([0.0, 4.0]))
            );
        }
        for header in ["T1,y,u", "-,y,4.5"] {
            assert!(!matches!(
                Rows::begin("input", 1, header, &Columns::default()),
                Ok((_, true))
            ));
        }
    }

    /// A file has more cells to look at; of a stream the first one has to do, also where day and month are the same on this day.
    #[test]
    fn a_stream_does_not_wait_for_a_day_above_12() {
        for cell in ["03/04/2026 10:00", "04/04/2026 10:00"] {
            let line = format!("{cell},4,12");
            let (mut rows, _) = rows(&line);
            let message = read(&mut rows, &line).unwrap_err();
            assert!(
                message.contains("set time_format = \"%d/%m/%Y %H:%M\""),
                "{message}"
            );
            assert_eq!(rows.times(), None);
        }
        let (mut rows, _) = rows("31/03/2026 10:00,4,12");
        read(&mut rows, "31/03/2026 10:00,4,12").unwrap();
        assert_eq!(
            read(&mut rows, "01/04/2026 10:00,4,12"),
            Ok(Line::Row([86_400.0, 4.0]))
        );
    }

    #[test]
    fn several_inputs_are_read_and_each_is_needed() {
        let columns = Columns {
            inputs: vec!["heater [%]".into(), "room [degC]".into()],
            outputs: vec!["block [degC]".into()],
            ..Columns::default()
        };
        let line = "t [h],room [degC],block [degC],heater [%]";
        let (mut rows, _) = Rows::begin("input", 1, line, &columns).unwrap();
        assert!(rows.units().eq(["%", "degC", "degC"]));
        assert_eq!(rows.name("input", 1), "room [degC]");
        assert_eq!(
            rows.order(),
            "a header: \"t [h]\" is the time, \"heater [%]\", \"room [degC]\" the inputs, \"block [degC]\" the reading"
        );
        assert_eq!(read(&mut rows, "1,21,,40"), Ok(Line::Row([3600.0, 40.0])));
        assert!(rows.inputs().eq([40.0, 21.0]));
        assert!(rows.outputs()[0].is_err());
        let bad = read(&mut rows, "2,,50,40").unwrap_err();
        assert_eq!(
            bad,
            "column \"room [degC]\": the cell is empty; check what writes the rows"
        );
    }

    /// What the first line is taken for is what it is read as: else it would be begun with again and again.
    #[test]
    fn a_carriage_return_within_a_line_is_part_of_a_cell_for_both() {
        let line = "1,1,3\r2,1,3";
        assert!(Rows::begin("input", 1, line, &Columns::default()).is_err());
        let (mut rows, _) = rows("0,1,2");
        assert!(read(&mut rows, line).is_err());
    }
}
