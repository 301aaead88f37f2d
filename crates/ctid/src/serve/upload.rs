//! A record as sent by the page, and as last read.

use std::sync::Arc;

use axum::body::Bytes;
use ct_signals::{
    Columns, Heading, ReadOptions, ReadSummary, Reading, Record, csv_header, parse_csv,
};

use super::guard::Refusal;
use super::held::of_record;
use crate::{MessageNames, input};

/// Largest number of characters of a record's name.
const LONGEST_NAME: usize = 100;
/// Largest number of columns of a file: the page offers them for choice.
const MOST_COLUMNS: usize = 500;
/// The header has to end within this number of bytes.
const LARGEST_HEAD: usize = 1 << 20;

/// A record that could be read, and what was missing in it.
type AsRead = (Arc<Record>, ReadSummary);

/// A record as it was dropped.
#[derive(Debug, Clone)]
pub(super) struct Upload {
    pub name: String,
    pub held_out: bool,
    pub headings: Vec<Heading>,
    pub content: Bytes,
    /// Result of the last reading, and its columns.
    read: Option<(Columns, ReadOptions, Result<AsRead, String>)>,
}

impl Upload {
    /// Accepts a file; only the header is checked.
    ///
    /// # Errors
    /// Where it is no CSV, or has too many columns.
    pub(super) fn new(name: &str, held_out: bool, content: Bytes) -> Result<Self, Refusal> {
        let headings = csv_header(name, head(name, &content)?).map_err(Refusal::input)?;
        if headings.len() > MOST_COLUMNS {
            return Err(Refusal::input(format!(
                "{name} has {} columns; the page takes at most {MOST_COLUMNS}: keep those of the time, the input, the output and \
                 the reference",
                headings.len()
            )));
        }
        Ok(Self {
            name: name.to_string(),
            held_out,
            headings,
            content,
            read: None,
        })
    }

    /// Memory in bytes, as sent and as read. A number has at least two bytes in the file, including the separator, and eight in memory: a
    /// read record takes at most four times the size of the file.
    pub(super) fn held(&self) -> usize {
        let read = self
            .read
            .as_ref()
            .and_then(|(_, _, read)| read.as_ref().ok());
        self.content.len() + read.map_or(0, |(record, _)| of_record(record))
    }

    /// The record as last read.
    pub(super) fn as_read(&self) -> Option<&Record> {
        let (_, _, read) = self.read.as_ref()?;
        read.as_ref().ok().map(|(record, _)| record.as_ref())
    }

    /// Note on missing samples and corrections of the last reading; `None` if the record was read unchanged.
    pub(super) fn remark(&self) -> Option<String> {
        let (_, _, read) = self.read.as_ref()?;
        let (_, summary) = read.as_ref().ok()?;
        let note =
            (!summary.is_plain()).then(|| summary.worded(&MessageNames::PROGRAM.fit.records));
        let said: Vec<String> = note.into_iter().chain(input::faults(summary)).collect();
        (!said.is_empty()).then(|| said.join("; "))
    }

    /// The record with a note on missing samples, read again only after a change of the columns.
    pub(super) fn reading(
        &mut self,
        columns: &Columns,
        options: &ReadOptions,
    ) -> Result<Reading, String> {
        self.record(columns, options)?;
        let (_, _, read) = self.read.as_ref().ok_or("the record was not read")?;
        let (record, summary) = read.as_ref().map_err(String::clone)?;
        Ok(Reading {
            record: record.as_ref().clone(),
            summary: summary.clone(),
        })
    }

    /// The record, read again only after a change of the columns.
    pub(super) fn record(
        &mut self,
        columns: &Columns,
        options: &ReadOptions,
    ) -> Result<Arc<Record>, String> {
        match &self.read {
            Some((c, o, read)) if c == columns && o == options => {
                read.clone().map(|(record, _)| record)
            }
            _ => {
                // Whether a fitted record has to change depends on the other records.
                let reading = parse_csv(&self.name, &self.content, columns, options);
                let read = reading.map(|reading| (Arc::new(reading.record), reading.summary));
                let read = read.map_err(|error| error.worded(&MessageNames::PROGRAM.fit.records));
                self.read = Some((columns.clone(), options.clone(), read.clone()));
                read.map(|(record, _)| record)
            }
        }
    }
}

/// The first lines of a file. A long line may have as many columns as bytes, each far larger in memory.
fn head<'a>(name: &str, content: &'a [u8]) -> Result<&'a [u8], Refusal> {
    let Some(first) = content.get(..LARGEST_HEAD) else {
        return Ok(content);
    };
    let end = first.iter().rposition(|byte| b"\r\n".contains(byte));
    let end = end.ok_or_else(|| {
        Refusal::input(format!(
            "{name} is a single line over its first {} MB; write one row for each sample, below a header",
            LARGEST_HEAD >> 20
        ))
    })?;
    Ok(&first[..=end])
}

/// A name for messages and tables; it is not used as a file name.
pub(super) fn plain_name(name: &str) -> String {
    let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let printable = last.chars().filter(|c| !c.is_control());
    let name: String = printable.take(LONGEST_NAME).collect();
    match name.trim() {
        "" => "record.csv".to_string(),
        name => name.to_string(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::fmt::Write;

    use super::*;

    /// The largest number of rows for these bytes: every command and reading is one digit.
    #[test]
    fn what_is_read_is_counted_and_takes_at_most_four_times_the_file() {
        let mut text = "t,u,y,u2,r\n".to_string();
        for k in 0..2000 {
            writeln!(text, "{k},{},{},4,5", k % 2, k % 3).unwrap();
        }
        let sent = text.len();
        let mut upload = Upload::new("dense.csv", false, text.into()).unwrap();
        assert_eq!(upload.held(), sent);
        let columns = Columns {
            time: Some("t".into()),
            inputs: vec!["u".into(), "u2".into()],
            outputs: vec!["y".into()],
            references: vec!["r".into()],
            ..Columns::default()
        };
        let options = ReadOptions::default();
        upload.record(&columns, &options).unwrap();
        assert_eq!(upload.held(), sent + 2000 * 5 * 8);
        assert!(upload.held() <= 5 * sent);
        // An unreadable file uses no memory.
        let columns = Columns {
            inputs: vec!["no such".into()],
            ..columns
        };
        upload.record(&columns, &options).unwrap_err();
        assert_eq!(upload.held(), sent);
    }
}
