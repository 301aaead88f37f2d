//! Rows of numbers as they come on a stream, a line at a time: what a CSV file may hold, but without looking ahead.
//!
//! The first line that is neither blank nor a comment decides: where it holds names, [`Columns`] says which column is what, as
//! in a file; where it holds numbers, they are time, reference, command and readings, or time, command and readings.
//! Understood as in a file: commas, semicolons or tabs, a decimal comma where commas do not separate, a byte-order mark, CRLF,
//! blank lines and comments, quotes. A line that cannot be used is refused by itself, and the next one is read on.

use csv::{ReaderBuilder, StringRecord, Terminator, Trim};

use crate::columns::{Found, Layout, Purpose};
use crate::csv::{check_width, delimiter, is_number};
use crate::{Columns, Conversion, Error, escaped, quoted, unit};

/// The names of the columns in use, where they have no header; all behind the last are outputs.
const ROLES: [&str; 3] = ["time", "input", "output"];
/// Roles before the outputs.
const OUTPUTS: usize = 2;

/// How rows are read.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    delimiter: u8,
    /// The header, where there is one: it may come again.
    header: Option<String>,
    /// Fields of a row.
    fields: usize,
    /// Positions of time, input and outputs.
    at: Vec<usize>,
    /// Their headers.
    names: Vec<String>,
    /// Units of input and outputs.
    units: Vec<String>,
    /// How input and outputs are converted to these, where the header has other ones.
    conversions: Vec<Option<Conversion>>,
    /// The cells of the latest row: time, input, outputs.
    values: Vec<Result<f64, BadLine>>,
    /// Seconds in one unit of the time.
    seconds: f64,
    /// The decimal mark seen so far.
    mark: Option<u8>,
    scratch: String,
}

/// What a line holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Line {
    /// Time \[s\] and input, finite or not; the outputs are in [`Rows::outputs`].
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
            names: Vec::new(),
            units: Vec::new(),
            conversions: Vec::new(),
            values: Vec::new(),
            seconds: 1.0,
            mark: None,
            scratch: String::new(),
        };
        if cells.iter().all(|cell| is_number(cell)) {
            let outputs = columns.outputs.len().max(1);
            let input = match cells.len().checked_sub(outputs) {
                Some(2) => 1,
                Some(3) => 2,
                _ => {
                    return Err(Error::NoOrder {
                        file: file.into(),
                        row,
                        found: cells.len(),
                        outputs,
                    });
                }
            };
            rows.at = std::iter::once(0).chain(input..=input + outputs).collect();
            let named = |names: &[String], at: usize| {
                let name = names.get(at).filter(|name| !name.is_empty());
                name.cloned().unwrap_or_default()
            };
            rows.names = vec![
                columns.time.clone().unwrap_or_default(),
                named(&columns.inputs, 0),
            ];
            rows.names
                .extend((0..outputs).map(|output| named(&columns.outputs, output)));
            let units = rows.names[1..].iter();
            rows.units = units
                .map(|name| escaped(unit::split(name).1).into_owned())
                .collect();
            for (i, name) in rows.names.iter_mut().enumerate() {
                if name.is_empty() {
                    *name = ROLES[i.min(OUTPUTS)].to_string();
                }
            }
            rows.conversions = vec![None; outputs + 1];
            rows.seconds = columns.time_header().1;
            rows.values = vec![Ok(f64::NAN); rows.at.len()];
            return Ok((rows, true));
        }
        check_width(file, row, cells.len())?;
        let Layout {
            time,
            seconds,
            mut inputs,
            outputs,
            ..
        } = columns.resolve(file, row, &cells, Purpose::Fit)?;
        // One input at least.
        let input = inputs.swap_remove(0);
        rows.at = vec![time.index];
        rows.names = vec![time.header];
        for Found {
            index,
            header,
            unit,
            converted,
            ..
        } in std::iter::once(input).chain(outputs)
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

    /// The header of time, input or the first output.
    #[must_use]
    pub fn name(&self, role: &str) -> &str {
        let at = ROLES.iter().position(|known| *known == role);
        at.map_or("", |at| &self.names[at])
    }

    /// The header of an output, counted from zero.
    #[must_use]
    pub fn output_name(&self, output: usize) -> &str {
        self.names.get(OUTPUTS + output).map_or("", String::as_str)
    }

    /// Units of input and outputs, in order and in printable text; empty where nothing says.
    pub fn units(&self) -> impl Iterator<Item = &str> {
        self.units.iter().map(String::as_str)
    }

    /// The outputs of the row that was read last, finite or not, or why there is none: its cell is empty or holds no number.
    pub fn outputs(&self) -> &[Result<f64, BadLine>] {
        &self.values[OUTPUTS..]
    }

    /// Seconds in one unit of the time.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// In which order a row's fields are read, in words.
    #[must_use]
    pub fn order(&self) -> String {
        let outputs = &self.names[OUTPUTS..];
        let readings = if outputs.len() == 1 {
            "reading"
        } else {
            "readings"
        };
        if self.header.is_some() {
            let names: Vec<String> = outputs
                .iter()
                .map(|name| format!("\"{}\"", quoted(name)))
                .collect();
            return format!(
                "a header: \"{}\" is the time, \"{}\" the command, {} the {readings}",
                quoted(&self.names[0]),
                quoted(&self.names[1]),
                names.join(", ")
            );
        }
        let (reference, r) = if self.fields > self.names.len() {
            (" reference,", " r,")
        } else {
            ("", "")
        };
        format!(
            "no header: the columns are taken as time,{reference} command, {readings} (t,{r} u, {})",
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
                self.values[role] = self.number(role, cell);
            }
        } else {
            let mut found = 0;
            for (i, cell) in line.split(char::from(self.delimiter)).enumerate() {
                found += 1;
                let Some(role) = self.at.iter().position(|at| *at == i) else {
                    continue;
                };
                self.values[role] = self.number(role, cell.trim());
            }
            // A row that is not whole has wrong cells too.
            self.check_count(found)?;
        }
        for (value, conversion) in self.values[1..].iter_mut().zip(&self.conversions) {
            if let (Ok(value), Some(conversion)) = (value, conversion) {
                *value = conversion.apply(*value);
            }
        }
        let value = |role: usize| self.values[role].clone();
        Ok(Line::Row([value(0)? * self.seconds, value(1)?]))
    }

    fn check_count(&self, found: usize) -> Result<(), BadLine> {
        if found == self.fields {
            return Ok(());
        }
        Err(BadLine::Fields {
            expected: self.fields,
            found,
            delimiter: match self.delimiter {
                b';' => "semicolon",
                b'\t' => "tab",
                _ => "comma",
            },
        })
    }

    fn number(&mut self, role: usize, cell: &str) -> Result<f64, BadLine> {
        let column = || quoted(&self.names[role]);
        if cell.is_empty() {
            return Err(BadLine::Empty { column: column() });
        }
        let commas = cell.bytes().filter(|byte| *byte == b',').count();
        let point = cell.contains('.');
        let comma = commas == 1 && !point && self.delimiter != b',';
        let value = if comma {
            self.scratch.clear();
            self.scratch
                .extend(cell.chars().map(|c| if c == ',' { '.' } else { c }));
            self.scratch.parse::<f64>()
        } else {
            cell.parse::<f64>()
        };
        let Ok(value) = value else {
            return Err(BadLine::Text {
                column: column(),
                text: quoted(cell),
                mend: if commas > 0 {
                    "write decimals with a point and without separators for thousands"
                } else if role == 0 && cell.contains(|c: char| c.is_ascii_digit()) {
                    "give the time as a number, such as seconds from the start"
                } else {
                    "check what writes the rows"
                },
            });
        };
        let mark = if comma {
            Some(b',')
        } else {
            point.then_some(b'.')
        };
        if let (Some(here), Some(before)) = (mark, self.mark)
            && here != before
        {
            return Err(BadLine::DecimalMark {
                column: column(),
                text: quoted(cell),
            });
        }
        self.mark = self.mark.or(mark);
        Ok(value)
    }
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
        assert!(message.contains("give the time as a number"), "{message}");
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
        assert_eq!(rows.output_name(1), "lower [mm]");
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

    /// What the first line is taken for is what it is read as: else it would be begun with again and again.
    #[test]
    fn a_carriage_return_within_a_line_is_part_of_a_cell_for_both() {
        let line = "1,1,3\r2,1,3";
        assert!(Rows::begin("input", 1, line, &Columns::default()).is_err());
        let (mut rows, _) = rows("0,1,2");
        assert!(read(&mut rows, line).is_err());
    }
}
