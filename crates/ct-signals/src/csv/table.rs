//! The rows of a file as a table, and the record that is made of it.

use csv::StringRecord;

use super::cells::is_word;
use super::place::Place;
use super::rows::Rows;
use super::start::Start;
use super::text::{Decoded, line_number};
use super::time::Bounds;
use super::{
    Cell, Converted, MissingSamples, Numbers, ReadOptions, ReadSummary, Reading, Times,
    delimiter_name, fewest_rows, says_missing, time,
};
use crate::columns::{Columns, Found, Layout, Purpose};
use crate::{
    Calendar, Channel, Error, ReadError, Record, Shortage, escaped, isolated_readings, quoted, unit,
};

/// The columns in use, with where each row ends in the file.
pub(super) struct Table {
    pub(super) start: Start,
    /// Line number of the header.
    pub(super) header: u64,
    pub(super) ends: Vec<usize>,
    /// \[s\], from zero of the column, or from the first row where these are dates.
    pub(super) time: Vec<f64>,
    /// Values of each channel, in the order of [`Layout::channels`], in the required units.
    pub(super) values: Vec<Vec<f64>>,
    /// For each channel, the words that mark missing samples, with their number.
    pub(super) missing: Vec<Vec<(String, usize)>>,
    pub(super) calendar: Option<Calendar>,
    /// Rows outside the required range of time.
    pub(super) outside: usize,
    /// Rows without a time.
    pub(super) without_time: usize,
    /// Place where the first row without a time ends, and the contents of the time cells.
    pub(super) untimed: (usize, Vec<(String, usize)>),
}

pub(super) fn read_table(
    file: &str,
    text: &str,
    columns: &Columns,
    (options, purpose): (&ReadOptions, Purpose),
) -> Result<(Layout, Table), Error> {
    let mut rows = Rows::new(file, text);
    let start = rows.start();
    let delimiter = start.delimiter;
    let header = rows.header()?;
    let fields = header.names.len();
    let layout = columns.resolve(file, header.row, &header.names, purpose)?;
    let channels = layout.channels().count();
    let mut record = StringRecord::new();
    let mut times: Option<(Times, Bounds)> = None;
    let mut numbers = Numbers::new(delimiter != b',', options.strict, &columns.missing);
    let mut table = Table {
        start,
        header: header.row,
        ends: Vec::new(),
        time: Vec::new(),
        values: vec![Vec::new(); channels],
        missing: vec![Vec::new(); channels],
        calendar: None,
        outside: 0,
        without_time: 0,
        untimed: (0, Vec::new()),
    };

    while rows.next(&mut record)? {
        let end = rows.end();
        if record.iter().all(str::is_empty) {
            continue;
        }
        if record.len() != fields {
            return Err(Error::Read(ReadError::WrongFieldCount {
                file: file.into(),
                row: line_number(text, end),
                expected: fields,
                found: record.len(),
                delimiter: delimiter_name(delimiter),
            }));
        }
        if table.time.is_empty() && table.outside == 0 && is_row_of_units(&record) {
            let (name, unit) = unit::split(&layout.time.header);
            let below = &record[layout.time.index];
            let unit = if below.is_empty() { unit } else { below };
            return Err(Error::Read(ReadError::UnitRow {
                file: file.into(),
                row: line_number(text, end),
                header: quoted(&format!("{name} [{unit}]")),
            }));
        }
        let cell = &record[layout.time.index];
        let place = Place {
            name: file,
            text,
            end,
            header: &layout.time.header,
        };
        if !options.strict && says_missing(cell) {
            if table.without_time == 0 {
                table.untimed.0 = end;
            }
            table.without_time += 1;
            count_word(&mut table.untimed.1, cell);
            continue;
        }
        let (times, bounds) = match &mut times {
            Some(known) => known,
            none => {
                let all = || time::cells(place, layout.time.index);
                let found = Times::of(cell, all, layout.seconds, columns)
                    .map_err(|fault| fault.at(place, cell, options.strict))?;
                let bounds = Bounds::of(&found, layout.seconds, options)?;
                none.insert((found, bounds))
            }
        };
        let time = times
            .read(cell, &mut numbers)
            .map_err(|fault| fault.at(place, cell, options.strict))?;
        if !bounds.contain(time) {
            table.outside += 1;
            continue;
        }
        if let Some(&previous) = table.time.last() {
            times.check_order(place, previous, time)?;
        }
        table.time.push(time);
        table.ends.push(end);
        for (k, column) in layout.channels().enumerate() {
            let cell = &record[column.index];
            let place = Place {
                header: &column.header,
                ..place
            };
            let sample = numbers.sample(cell);
            let value = match sample.map_err(|fault| fault.at(place, cell, options.strict))? {
                Cell::Number(value) => match &column.converted {
                    Some((_, conversion)) => conversion.apply(value),
                    None => value,
                },
                Cell::Missing => {
                    count_word(&mut table.missing[k], cell);
                    f64::NAN
                }
            };
            table.values[k].push(value);
        }
    }
    table.calendar = times.and_then(|(times, _)| times.calendar());
    Ok((layout, table))
}

/// Whether a row below the header contains units: words only, and no mark of a missing sample.
fn is_row_of_units(row: &StringRecord) -> bool {
    let says = |cell: &str| !cell.is_empty() && cell != "-" && says_missing(cell);
    row.iter().all(is_word) && !row.iter().any(says)
}

/// Counts the contents of cells with missing samples: the first different words separately, the others together.
fn count_word(words: &mut Vec<(String, usize)>, cell: &str) {
    const MOST: usize = 6;
    const LONGEST: usize = 24;
    let end = cell
        .char_indices()
        .nth(LONGEST)
        .map_or(cell.len(), |(at, _)| at);
    let cell = &cell[..end];
    if let Some((_, count)) = words.iter_mut().find(|(word, _)| word == cell) {
        *count += 1;
    } else if words.len() < MOST {
        words.push((cell.to_string(), 1));
    } else {
        match words.get_mut(MOST) {
            Some((_, count)) => *count += 1,
            None => words.push(("...".to_string(), 1)),
        }
    }
}

impl Table {
    pub(super) fn into_reading(
        mut self,
        file: &str,
        Decoded { text, encoding }: &Decoded,
        layout: Layout,
        (options, purpose): (&ReadOptions, Purpose),
    ) -> Result<Reading, Error> {
        // Times begin at the first row in use where they are dates.
        if let (Some(calendar), Some(&first)) = (&mut self.calendar, self.time.first()) {
            calendar.start = calendar.start.after(first);
            self.time.iter_mut().for_each(|time| *time -= first);
        }
        // Names and units are used in sentences, tables and files; control characters are removed.
        let printable = |text: &str| escaped(text).into_owned();
        let mut values = self.values.into_iter();
        let mut channels = |columns: &[Found]| -> Vec<Channel> {
            let channel = |(column, values): (&Found, Vec<f64>)| {
                Channel::new(printable(&column.name), printable(&column.unit), values)
            };
            columns.iter().zip(values.by_ref()).map(channel).collect()
        };
        let inputs = channels(&layout.inputs).into_iter();
        let mut record = Record {
            name: file.into(),
            time: self.time,
            inputs: inputs.map(|u| u.with_hold(options.hold)).collect(),
            outputs: channels(&layout.outputs),
            references: channels(&layout.references),
            part: 0,
            calendar: self.calendar,
        };
        for (at, header) in &layout.absent {
            let (name, unit) = unit::split(header);
            let none = vec![f64::NAN; record.len()];
            let channel = Channel::new(printable(name), printable(unit), none);
            record.outputs.insert(*at, channel);
        }
        let named = layout.channels().zip(&self.missing);
        let missing = named
            .filter(|(_, words)| !words.is_empty())
            .map(|(column, words)| MissingSamples {
                column: printable(&column.name),
                samples: words.iter().map(|(_, count)| count).sum(),
                words: words
                    .iter()
                    .map(|(word, count)| (quoted(word), *count))
                    .collect(),
            });
        let missing: Vec<MissingSamples> = missing.collect();
        let converted = layout.channels().filter_map(|column| {
            let (from, _) = column.converted.as_ref()?;
            Some(Converted {
                column: printable(&column.name),
                from: printable(from),
                to: printable(&column.unit),
            })
        });
        let summary = ReadSummary {
            file: file.into(),
            encoding: *encoding,
            above_header: self.start.above,
            header_row: self.header,
            units_below_header: self.start.units,
            rows: record.len(),
            first_row: self.ends.first().map_or(0, |&end| line_number(text, end)),
            time_header: printable(&layout.time.header),
            looks_like_days: layout.time.unit.is_empty()
                && record.calendar.is_none()
                && time::looks_like_days(record.time[0], record.sample_interval()),
            outside: self.outside,
            without_time: self.without_time,
            missing_rows: record.missing_rows(),
            interval: record.sample_interval(),
            duration: record.duration(),
            calendar: record.calendar.clone(),
            missing,
            converted: converted.collect(),
            isolated: isolated_readings(&record),
            out_of_range: Vec::new(),
            resampled: options.resample,
        };
        if let Some(interval) = options.resample {
            record = record.resampled(interval)?;
            if record.len() < fewest_rows(purpose) {
                return Err(Error::TooFewRows {
                    record: file.into(),
                    rows: record.len(),
                    needed: fewest_rows(purpose),
                    why: Shortage::Resampled,
                });
            }
        }
        Ok(Reading { record, summary })
    }
}
