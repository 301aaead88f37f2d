//! Rows of numbers as they come on a stream, a line at a time: what a CSV file may hold, but without looking ahead.
//!
//! The first line that is neither blank nor a comment decides: where it holds names, [`Columns`] says which column is what, as
//! in a file; where it holds numbers, they are time, reference, command and reading, or time, command and reading.
//! Understood as in a file: commas, semicolons or tabs, a decimal comma where commas do not separate, a byte-order mark, CRLF,
//! blank lines and comments, quotes. A line that cannot be used is refused by itself, and the next one is read on.

use csv::{ReaderBuilder, StringRecord, Terminator, Trim};

use crate::columns::{Found, Layout};
use crate::csv::{check_width, delimiter, is_number};
use crate::{Columns, Conversion, Error, quoted, unit};

/// The names of the columns in use, and which they are in a row without a header.
const ROLES: [&str; 3] = ["time", "input", "output"];

/// How rows are read.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    delimiter: u8,
    /// The header, where there is one: it may come again.
    header: Option<String>,
    /// Fields of a row.
    fields: usize,
    /// Positions of time, input and output.
    at: [usize; 3],
    /// Their headers.
    names: [String; 3],
    /// Units of input and output.
    units: [String; 2],
    /// How input and output are converted to these, where the header has other ones.
    conversions: [Option<Conversion>; 2],
    /// Seconds in one unit of the time.
    seconds: f64,
    /// The decimal mark seen so far.
    mark: Option<u8>,
    scratch: String,
}

/// What a line holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Line {
    /// Time \[s\], input and output, finite or not.
    Row([f64; 3]),
    /// Time \[s\] and input, finite or not, and why there is no output: its cell is empty or holds no number.
    NoOutput([f64; 2], BadLine),
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
    /// As of [`read_csv`](crate::read_csv) for a header; [`Error::NoOrder`] for numbers that are neither three nor four.
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
            at: [0; 3],
            names: Default::default(),
            units: Default::default(),
            conversions: [None; 2],
            seconds: 1.0,
            mark: None,
            scratch: String::new(),
        };
        if cells.iter().all(|cell| is_number(cell)) {
            rows.at = match cells.len() {
                3 => [0, 1, 2],
                4 => [0, 2, 3],
                found => {
                    return Err(Error::NoOrder {
                        file: file.into(),
                        row,
                        found,
                    });
                }
            };
            let named = |names: &'_ [String]| -> Option<String> {
                names.first().filter(|name| !name.is_empty()).cloned()
            };
            let (input, output) = (named(&columns.inputs), named(&columns.outputs));
            let unit = |given: &Option<String>| {
                given
                    .as_deref()
                    .map_or(String::new(), |name| unit::split(name).1.to_string())
            };
            rows.units = [unit(&input), unit(&output)];
            let named = [columns.time.clone(), input, output];
            for ((name, role), given) in rows.names.iter_mut().zip(ROLES).zip(named) {
                *name = given.unwrap_or_else(|| role.to_string());
            }
            rows.seconds = columns.time_header().1;
            return Ok((rows, true));
        }
        check_width(file, row, cells.len())?;
        let Layout {
            time,
            seconds,
            mut inputs,
            mut outputs,
            ..
        } = columns.resolve(file, row, &cells)?;
        // One of each at least.
        let (input, output) = (inputs.swap_remove(0), outputs.swap_remove(0));
        rows.at = [time.index, input.index, output.index];
        let conversion = |found: &Found| found.converted.as_ref().map(|(_, by)| *by);
        rows.conversions = [conversion(&input), conversion(&output)];
        rows.units = [input.unit, output.unit];
        rows.names = [time.header, input.header, output.header];
        rows.seconds = seconds;
        rows.header = Some(line.to_string());
        Ok((rows, false))
    }

    /// Whether a header has named the columns.
    #[must_use]
    pub fn has_header(&self) -> bool {
        self.header.is_some()
    }

    /// The header of time, input or output.
    #[must_use]
    pub fn name(&self, role: &str) -> &str {
        let at = ROLES.iter().position(|known| *known == role);
        at.map_or("", |at| &self.names[at])
    }

    /// Units of input and output; empty where nothing says.
    #[must_use]
    pub fn units(&self) -> [&str; 2] {
        [&self.units[0], &self.units[1]]
    }

    /// Seconds in one unit of the time.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// In which order a row's fields are read, in words.
    #[must_use]
    pub fn order(&self) -> String {
        match (&self.header, self.fields) {
            (Some(_), _) => format!(
                "a header: \"{}\" is the time, \"{}\" the command, \"{}\" the reading",
                quoted(&self.names[0]),
                quoted(&self.names[1]),
                quoted(&self.names[2])
            ),
            (None, 4) => {
                "no header: the columns are taken as time, reference, command, reading (t, r, u, y)"
                    .to_string()
            }
            (None, _) => {
                "no header: the columns are taken as time, command, reading (t, u, y)".to_string()
            }
        }
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
        let mut values = [const { Ok(f64::NAN) }; 3];
        if line.contains('"') {
            let cells = cells(line, self.delimiter);
            self.check_count(cells.len())?;
            for (role, &at) in self.at.clone().iter().enumerate() {
                values[role] = self.number(role, cells.get(at).map_or("", String::as_str));
            }
        } else {
            let mut found = 0;
            for (i, cell) in line.split(char::from(self.delimiter)).enumerate() {
                found += 1;
                let Some(role) = self.at.iter().position(|at| *at == i) else {
                    continue;
                };
                values[role] = self.number(role, cell.trim());
            }
            // A row that is not whole has wrong cells too.
            self.check_count(found)?;
        }
        for (value, conversion) in values[1..].iter_mut().zip(&self.conversions) {
            if let (Ok(value), Some(conversion)) = (value, conversion) {
                *value = conversion.apply(*value);
            }
        }
        let [time, input, output] = values;
        let (time, input) = (time? * self.seconds, input?);
        Ok(match output {
            Ok(output) => Line::Row([time, input, output]),
            Err(bad) => Line::NoOutput([time, input], bad),
        })
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
        assert_eq!(rows.units(), ["V", "cm"]);
        assert_eq!(
            read(&mut rows, "12,5; 4 ;0,5;\"a; b\"\r\n"),
            Ok(Line::Row([30.0, 4.0, 12.5]))
        );
        assert_eq!(
            read(&mut rows, "y [cm];u [V];t [min];note"),
            Ok(Line::Nothing)
        );
        assert_eq!(read(&mut rows, "# a comment"), Ok(Line::Nothing));
        let Ok(Line::NoOutput([60.0, 4.0], bad)) = read(&mut rows, "12.5;4;1;") else {
            panic!("the command of a row counts whatever the reading is");
        };
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
            Ok(Line::Row([0.0, 4.5, 14.8]))
        );
        let (mut three, _) = rows("0\t4\t14");
        assert_eq!(
            read(&mut three, "1\t5\t15"),
            Ok(Line::Row([1.0, 5.0, 15.0]))
        );
        let Ok(Line::NoOutput([1.0, 5.0], bad)) = read(&mut three, "1\t5\t") else {
            panic!("the command of a row counts whatever the reading is");
        };
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

    /// What the first line is taken for is what it is read as: else it would be begun with again and again.
    #[test]
    fn a_carriage_return_within_a_line_is_part_of_a_cell_for_both() {
        let line = "1,1,3\r2,1,3";
        assert!(Rows::begin("input", 1, line, &Columns::default()).is_err());
        let (mut rows, _) = rows("0,1,2");
        assert!(read(&mut rows, line).is_err());
    }
}
