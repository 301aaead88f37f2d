//! One-line summary: rows read, samples missing, and corrections made.

use std::fmt;

use serde::Serialize;

use crate::{Calendar, IsolatedReadings, Names, OutOfRange, duration};

/// Samples of a column that are missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MissingSamples {
    /// The column's name.
    pub column: String,
    /// Number of samples.
    pub samples: usize,
    /// Contents of the cells with missing samples, with the number of each; empty text for an empty cell.
    pub words: Vec<(String, usize)>,
}

/// A column that the file has in another unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Converted {
    /// The column's name.
    pub column: String,
    /// The file's unit.
    pub from: String,
    /// The unit of the values.
    pub to: String,
}

/// Summary of a file that was read; [`fmt::Display`] formats it in one line.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadSummary {
    /// The file.
    pub file: String,
    /// Its encoding, where it is not UTF-8.
    pub encoding: Option<&'static str>,
    /// Rows above the header, which are not used.
    pub above_header: usize,
    /// Line number of the header.
    #[serde(skip)]
    pub header_row: u64,
    /// Whether the units are in a row below the header.
    pub units_below_header: bool,
    /// Rows in use.
    pub rows: usize,
    /// Line number of the first row in use.
    #[serde(skip)]
    pub first_row: u64,
    /// The header of the time.
    #[serde(skip)]
    pub time_header: String,
    /// Whether the times count as seconds because they have no unit, but look like days: the numbers that spreadsheets have for dates.
    pub looks_like_days: bool,
    /// Rows outside the required range of time.
    pub outside: usize,
    /// Rows without a time, which are not used.
    pub without_time: usize,
    /// Rows that are missing between the first and the last.
    pub missing_rows: usize,
    /// The median step of the time \[s\].
    pub interval: f64,
    /// Time from the first to the last row in use \[s\].
    pub duration: f64,
    /// Start date, if the file has dates.
    #[serde(skip)]
    pub calendar: Option<Calendar>,
    /// Samples that are missing, by column.
    pub missing: Vec<MissingSamples>,
    /// Columns that were converted.
    pub converted: Vec<Converted>,
    /// Readings that are far from those before and after them.
    pub isolated: Vec<IsolatedReadings>,
    /// Signals with values outside the range that a model declares; the reader itself knows of none.
    pub out_of_range: Vec<OutOfRange>,
    /// Interval of the grid after resampling \[s\].
    pub resampled: Option<f64>,
}

impl ReadSummary {
    /// Whether the file was read unchanged: no sample was missing, left out or converted.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        self.encoding.is_none()
            && self.above_header == 0
            && !self.units_below_header
            && self.outside == 0
            && self.without_time == 0
            && self.missing_rows == 0
            && self.missing.is_empty()
            && self.converted.is_empty()
            && self.resampled.is_none()
    }

    /// Notes that a column was converted once more, from the unit in which it was read.
    pub fn add_conversion(&mut self, column: &str, from: &str, to: &str) {
        let mut converted = self.converted.iter_mut();
        match converted.find(|converted| converted.column == column) {
            Some(converted) => converted.to = to.to_string(),
            None => self.converted.push(Converted {
                column: column.to_string(),
                from: from.to_string(),
                to: to.to_string(),
            }),
        }
        // A conversion that was undone.
        self.converted
            .retain(|converted| converted.from != converted.to);
    }

    /// The line with the caller's names for the settings of reading.
    #[must_use]
    pub fn worded(&self, names: &Names) -> String {
        let mut line = String::new();
        // Into memory nothing fails.
        let _ = self.write(&mut line, names);
        line
    }

    fn write(&self, f: &mut impl fmt::Write, names: &Names) -> fmt::Result {
        write!(f, "{}: {}", self.file, rows(self.rows))?;
        if let Some(calendar) = &self.calendar {
            let (first, last) = (calendar.at(0.0), calendar.at(self.duration));
            write!(f, " from {first} to {last} ({})", calendar.zone.name())?;
        } else {
            write!(f, " over {}", duration(self.duration))?;
        }
        write!(f, ", every {}", duration(self.interval))?;
        if let Some(encoding) = self.encoding {
            write!(f, "; read as {encoding}")?;
        }
        if self.above_header > 0 {
            let above = rows(self.above_header);
            write!(
                f,
                "; the header is row {}, {above} above it left out",
                self.header_row
            )?;
        }
        if self.units_below_header {
            write!(f, "; units from the row below the header")?;
        }
        if self.outside > 0 {
            write!(
                f,
                "; {} outside {} and {} left out",
                rows(self.outside),
                names.from,
                names.to
            )?;
        }
        if self.without_time > 0 {
            write!(f, "; {} without a time left out", rows(self.without_time))?;
        }
        if self.missing_rows > 0 {
            let are = if self.missing_rows == 1 { "is" } else { "are" };
            write!(f, "; {} {are} missing", rows(self.missing_rows))?;
        }
        for column in &self.missing {
            let part = 100.0 * column.samples as f64 / self.rows.max(1) as f64;
            let words = column
                .words
                .iter()
                .map(|(word, count)| match word.as_str() {
                    "" => format!("{count} empty"),
                    word => format!("{count} \"{word}\""),
                });
            let words: Vec<String> = words.collect();
            let part = if part < 1.0 {
                "below 1".to_string()
            } else {
                format!("{part:.0}")
            };
            let samples = if column.samples == 1 {
                "sample"
            } else {
                "samples"
            };
            write!(
                f,
                "; {} {samples} of \"{}\" missing ({}; {part} %)",
                column.samples,
                column.column,
                words.join(", ")
            )?;
        }
        for Converted { column, from, to } in &self.converted {
            write!(f, "; \"{column}\" converted from {from} to {to}")?;
        }
        if let Some(interval) = self.resampled {
            write!(f, "; resampled to one row every {}", duration(interval))?;
        }
        Ok(())
    }
}

fn rows(count: usize) -> String {
    match count {
        1 => "1 row".to_string(),
        count => format!("{count} rows"),
    }
}

impl fmt::Display for ReadSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, &Names::LIBRARY)
    }
}
