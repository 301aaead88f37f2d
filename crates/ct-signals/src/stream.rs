//! Rows as they come on a stream, a line at a time: what a CSV file may hold, but without looking ahead.
//!
//! The first line of a table decides (blank lines, comments and `sep=;` are not part of it): where it holds names, [`Columns`] says which column is what, as
//! in a file; where it holds a time and numbers, they are time, reference, command and readings, or time, command and readings.
//! Understood as in a file: commas, semicolons or tabs, a decimal comma where commas do not separate, a byte-order mark, CRLF,
//! blank lines and comments, quotes, words where a sample is missing, times as numbers in a unit or as dates. The first row's time says how
//! they are written. A line that cannot be used is refused by itself, and the next one is read on.

mod bad_line;
mod line;
mod row;

pub use self::bad_line::BadLine;
use self::line::{cells, is_row, text};
use crate::columns::{Found, Layout, Purpose};
use crate::csv::{Numbers, Times, check_width, delimiter, with_unit};
use crate::{Calendar, Columns, Conversion, Error, ReadError, Timestamp, escaped, quoted, unit};

/// The names of the columns in use, where they have no header.
const ROLES: [&str; 3] = ["time", "input", "output"];

/// Format of the times of rows.
#[derive(Debug, Clone, PartialEq)]
pub enum RowTimes {
    /// Times are numbers.
    Numbers,
    /// Times of day without a date; they count from the first row.
    TimesOfDay,
    /// Times are dates.
    Dates {
        /// Origin of the times.
        calendar: Calendar,
        /// The first cell has no offset from UTC: its instant depends on the zone.
        civil: bool,
    },
}

/// Format of rows.
#[derive(Debug, Clone)]
pub struct Rows {
    delimiter: u8,
    /// The header, if there is one: it may be repeated in the stream.
    header: Option<String>,
    /// The row of units below it, likewise.
    units_row: Option<String>,
    /// Fields of a row.
    fields: usize,
    /// Positions of time, inputs and outputs.
    at: Vec<usize>,
    /// Number of inputs, at least one.
    inputs: usize,
    /// Headers of the columns.
    names: Vec<String>,
    /// Units of inputs and outputs.
    units: Vec<String>,
    /// Conversion of each input and output from the header's unit.
    conversions: Vec<Option<Conversion>>,
    /// The cells of the latest row: time, inputs, outputs.
    values: Vec<Result<f64, BadLine>>,
    /// Seconds in one unit of the time, where it is a number.
    seconds: f64,
    columns: Columns,
    /// Format of the time; `None` before the first row.
    times: Option<Times>,
    /// Origin of dates and the date before it, if known beforehand.
    start: Option<(Timestamp, Timestamp)>,
    /// Dates of this stream have no offset.
    civil: bool,
    numbers: Numbers,
}

/// Content of a line.
#[derive(Debug, Clone, PartialEq)]
pub enum Line {
    /// Time \[s\] and the first input, NaN where there is none; all inputs are in [`Rows::inputs`], the outputs in [`Rows::outputs`].
    Row([f64; 2]),
    /// No data: blank line, comment, or repeated header.
    Nothing,
}

impl Rows {
    /// From the first line that is neither blank nor a comment; `file` names the stream in messages, `row` is the line's number.
    /// The second value is whether the line is a row, to be read by [`Rows::read`] too.
    ///
    /// # Errors
    /// As of [`read_csv`](crate::read_csv) for a header; [`ReadError::NoOrder`] for numbers that are neither time, input and outputs nor these
    /// with a reference. There is one output where `columns` name none.
    pub fn begin(
        file: &str,
        row: u64,
        line: &str,
        columns: &Columns,
    ) -> Result<(Self, bool), Error> {
        let line = text(line);
        let delimiter = delimiter(line);
        let cells = cells(line, delimiter);
        let mut rows = Self::empty(delimiter, cells.len(), columns);
        if is_row(&cells, columns) {
            let outputs = columns.outputs.len().max(1);
            let inputs = usize::from(!columns.without_inputs);
            // Column of the first channel: 1 after the time, 2 after the time and a reference.
            let first = match cells.len().checked_sub(outputs + inputs) {
                Some(1) => 1,
                Some(2) if inputs > 0 => 2,
                _ => {
                    return Err(Error::Read(ReadError::NoOrder {
                        file: file.into(),
                        row,
                        found: cells.len(),
                        outputs,
                    }));
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
        rows.take_header((file, row), line, &cells)?;
        Ok((rows, false))
    }

    /// Rows whose columns are not known yet.
    fn empty(delimiter: u8, fields: usize, columns: &Columns) -> Self {
        Self {
            delimiter,
            header: None,
            units_row: None,
            fields,
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
        }
    }

    /// Finds the columns by the names of a header.
    fn take_header(
        &mut self,
        (file, row): (&str, u64),
        line: &str,
        cells: &[String],
    ) -> Result<(), Error> {
        check_width(file, row, cells.len())?;
        let Layout {
            time,
            seconds,
            inputs,
            outputs,
            ..
        } = self.columns.resolve(file, row, cells, Purpose::Fit)?;
        self.inputs = inputs.len();
        self.at = vec![time.index];
        self.names = vec![time.header];
        for Found {
            index,
            header,
            unit,
            converted,
            ..
        } in inputs.into_iter().chain(outputs)
        {
            self.at.push(index);
            self.names.push(header);
            self.units.push(escaped(&unit).into_owned());
            self.conversions.push(converted.map(|(_, by)| by));
        }
        self.seconds = seconds;
        self.values = vec![Ok(f64::NAN); self.at.len()];
        self.header = Some(line.to_string());
        Ok(())
    }

    /// As [`Self::begin`], from a header and the row of units below it ([`Self::gives_units`]), both of which may be repeated in the stream.
    ///
    /// # Errors
    /// As [`Self::begin`]; [`ReadError::TwoUnits`] for a column that has another unit in the header.
    pub fn begin_with_units(
        file: &str,
        row: u64,
        (header, units): (&str, &str),
        columns: &Columns,
    ) -> Result<Self, Error> {
        let (header, units) = (text(header), text(units));
        let delimiter = delimiter(header);
        let names = cells(header, delimiter);
        let below = cells(units, delimiter);
        let named = names.iter().zip(&below);
        let named = named.map(|(name, below)| with_unit(name, below, (file, row + 1)));
        let named = named.collect::<Result<Vec<String>, Error>>()?;
        let mut rows = Self::empty(delimiter, named.len(), columns);
        rows.take_header((file, row), header, &named)?;
        rows.units_row = Some(units.to_string());
        Ok(rows)
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

    /// Units of inputs and outputs, in order and in printable text; empty if unknown.
    pub fn units(&self) -> impl Iterator<Item = &str> {
        self.units.iter().map(String::as_str)
    }

    /// Outputs of the last row, or the reason why one is missing: its cell marks a missing sample, or contains no number.
    pub fn outputs(&self) -> &[Result<f64, BadLine>] {
        &self.values[1 + self.inputs..]
    }

    /// The inputs of the row that was read last, finite or not.
    pub fn inputs(&self) -> impl Iterator<Item = f64> {
        let inputs = self.values[1..=self.inputs].iter();
        inputs.map(|value| *value.as_ref().unwrap_or(&f64::NAN))
    }

    /// Seconds in one unit of the time that the header states.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Format of the times, known after the first row.
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

    /// Continues the times of earlier rows of the same stream: dates count from the same zero, and numbers stay numbers.
    pub fn go_on(&mut self, before: &Self) {
        self.times = match &before.times {
            Some(Times::Numbers(_)) => Some(Times::Numbers(self.seconds)),
            times => times.clone(),
        };
        self.civil = before.civil;
        self.start = before.start;
    }

    /// Order of a row's fields, in words.
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
}

/// Names of the readings of a row without a header.
pub(crate) fn letters(outputs: usize, between: &str) -> String {
    let of_output = |output: usize| match outputs {
        1 => "y".to_string(),
        _ => format!("y{output}"),
    };
    let letters: Vec<String> = (1..=outputs).map(of_output).collect();
    letters.join(between)
}

#[cfg(test)]
mod tests;
