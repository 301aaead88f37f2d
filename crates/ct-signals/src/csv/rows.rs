//! The rows of a CSV file, from its header on.

use csv::{Reader, StringRecord};

use super::empty;
use super::start::{Start, unit_of};
use super::text::{check_header, is_before_header, line_number, reader};
use crate::{Error, ReadError, Unit, quoted, unit};

/// Reads rows, and knows where each of them ends in the file.
pub(super) struct Rows<'a> {
    file: &'a str,
    text: &'a str,
    reader: Reader<&'a [u8]>,
    start: Start,
}

/// The header of a file.
pub(super) struct HeaderRow {
    /// Line number.
    pub row: u64,
    /// Names, with the units that the row below gives.
    pub names: Vec<String>,
}

impl<'a> Rows<'a> {
    pub fn new(file: &'a str, text: &'a str) -> Self {
        let start = Start::of(text);
        Self {
            file,
            text,
            reader: reader(&text[start.begin..], start.delimiter),
            start,
        }
    }

    pub fn start(&self) -> Start {
        self.start
    }

    /// Reads the header, and the row of units below it if there is one.
    pub fn header(&mut self) -> Result<HeaderRow, Error> {
        let mut record = StringRecord::new();
        while self.next(&mut record)? {
            if is_before_header(&record) {
                continue;
            }
            let row = line_number(self.text, self.end());
            check_header(self.file, row, &record)?;
            let mut names: Vec<String> = record.iter().map(str::to_string).collect();
            if self.start.units {
                while self.next(&mut record)? && record.iter().all(str::is_empty) {}
                let row = line_number(self.text, self.end());
                for (name, below) in names.iter_mut().zip(&record) {
                    *name = with_unit(name, below, (self.file, row))?;
                }
            }
            return Ok(HeaderRow { row, names });
        }
        Err(empty(self.file))
    }

    /// The next row, if there is one.
    pub fn next(&mut self, row: &mut StringRecord) -> Result<bool, Error> {
        self.reader.read_record(row).map_err(|error| {
            Error::Read(ReadError::CannotOpen {
                file: self.file.into(),
                source: error.into(),
            })
        })
    }

    /// Byte of the file at which the last row ended.
    pub fn end(&self) -> usize {
        let read = usize::try_from(self.reader.position().byte());
        read.map_or(usize::MAX, |read| read.saturating_add(self.start.begin))
    }
}

/// A name with the unit of the row below the header. What stands in brackets in the header and is no unit belongs to the name.
pub(crate) fn with_unit(
    name: &str,
    below: &str,
    (file, row): (&str, u64),
) -> Result<String, Error> {
    let below = unit_of(below).unwrap_or_default();
    let bracketed = unit::split_bracket(name).map_or("", |(_, unit)| unit);
    let own = Some(bracketed).filter(|unit| Unit::parse(unit).is_some());
    match own {
        _ if below.is_empty() => Ok(name.to_string()),
        None => Ok(format!("{name} [{below}]")),
        Some(own) if Unit::parse(own) == Unit::parse(below) => Ok(name.to_string()),
        Some(_) => Err(Error::Read(ReadError::TwoUnits {
            file: file.into(),
            row,
            column: quoted(name),
            below: quoted(below),
        })),
    }
}
