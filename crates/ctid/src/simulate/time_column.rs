//! Times of rows in the format of a file, which reads back identically.

use std::path::Path;

use ct_signals::{Columns, Heading, LARGEST_RECORD, Record, csv_header, read_file};
use serde::Serialize;

use crate::Error;

/// A column of times.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TimeColumn {
    /// Header of the column.
    pub header: String,
    /// Cells of the column.
    pub cells: Vec<String>,
}

impl TimeColumn {
    /// The times of a record that was read with these columns: dates with their offset from UTC, or numbers in the unit of the column.
    ///
    /// # Errors
    /// Where the file cannot be read any more.
    pub fn of(path: &Path, columns: &Columns, record: &Record) -> Result<Self, Error> {
        let named = match &columns.time {
            Some(_) => columns.clone(),
            None => {
                let content = read_file(path, LARGEST_RECORD)?;
                let headings = csv_header(&path.display().to_string(), &content)?;
                Columns {
                    time: Columns::guessed(&headings).time,
                    ..Columns::default()
                }
            }
        };
        let (header, seconds) = named.time_header();
        if let Some(calendar) = &record.calendar {
            let date = |time: &f64| {
                let instant = calendar.start.after(*time);
                let ahead = calendar.zone.seconds_ahead(instant) / 60;
                let sign = if ahead < 0 { '-' } else { '+' };
                let (hours, minutes) = (ahead.abs() / 60, ahead.abs() % 60);
                format!("{}{sign}{hours:02}:{minutes:02}", calendar.at(*time))
            };
            return Ok(Self {
                header: Heading::of(&header).name,
                cells: record.time.iter().map(date).collect(),
            });
        }
        let number = |time: &f64| {
            // Rounds off the last digits, which are rounding errors of the conversion.
            let value = time / seconds;
            let value = format!("{value:.12e}").parse().unwrap_or(value);
            format!("{value}")
        };
        Ok(Self {
            header,
            cells: record.time.iter().map(number).collect(),
        })
    }
}
