//! A line of a stream as a row: its cells, their numbers and its time.

use super::{BadLine, Line, Rows, cells, text};
use crate::csv::{Cell, CellFault, Times, delimiter_name, says_missing};
use crate::{CellMend, quoted};

impl Rows {
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
        if self.header.as_deref() == Some(line) || self.units_row.as_deref() == Some(line) {
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
            // An incomplete row may have wrong cells too.
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
            Err(CellFault::Thousands) => CellMend::Thousands,
            Err(CellFault::NoNumber) => {
                return Err(BadLine::NoNumber {
                    column: column(),
                    text: text(),
                });
            }
            Err(CellFault::Word | CellFault::Strict) => CellMend::DeclareInStream,
        };
        Err(BadLine::Text {
            column: column(),
            text: text(),
            mend,
        })
    }

    /// The time of a row \[s\]; the first row determines the format.
    fn time(&mut self, cell: &str) -> Result<f64, CellFault> {
        if let Some(times) = &mut self.times {
            return times.read(cell, &mut self.numbers);
        }
        // The other cells of the column are not available.
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
