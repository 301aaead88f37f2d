//! The time of rows: numbers in a unit, or dates and times.

use csv::StringRecord;

use super::{
    ReadOptions,
    cells::{CellFault, Numbers},
    place::Place,
    rows::Rows,
};
use crate::columns::Columns;
use crate::quote::rounded;
use crate::{
    Calendar, Error, PartLimit, ReadError, Timestamp, TimestampError, TimestampReader, Zone, quoted,
};

/// Format of a time column.
#[derive(Debug, Clone)]
pub(crate) enum Times {
    /// Numbers, and the number of seconds in one unit of them.
    Numbers(f64),
    /// Dates and times, counted from the first row.
    Dates {
        reader: Box<TimestampReader>,
        first: Timestamp,
    },
}

impl Times {
    /// Finds the format from the first cell; `all`: the cells of the whole column, which may show the order of day and month. A number is a
    /// multiple of `seconds`.
    pub fn of(
        cell: &str,
        all: impl FnOnce() -> Vec<String>,
        seconds: f64,
        columns: &Columns,
    ) -> Result<Self, CellFault> {
        let format = columns.time_format.as_deref();
        if format.is_none() && !TimestampReader::understands(cell) && cell_is_number(cell) {
            return Ok(Self::Numbers(seconds));
        }
        // Dates with an offset are shown, and limits of a part understood, with that offset.
        let zone = columns.time_zone.as_deref().or_else(|| offset_of(cell));
        let reader = match TimestampReader::new(format, zone, [cell]) {
            // The rest of the column distinguishes day and month.
            Err(TimestampError::DayOrMonth { .. }) => {
                let cells = all();
                TimestampReader::new(format, zone, cells.iter().map(String::as_str))
            }
            reader => reader,
        };
        let reader = reader.map_err(refused)?;
        // The first cell is read again together with its row.
        let first = reader.clone().read(cell).map_err(refused)?;
        Ok(Self::Dates {
            reader: Box::new(reader),
            first,
        })
    }

    /// The time of a row \[s\].
    pub fn read(&mut self, cell: &str, numbers: &mut Numbers) -> Result<f64, CellFault> {
        match self {
            Self::Numbers(seconds) => Ok(numbers.time(cell)? * *seconds),
            Self::Dates { reader, first } => reader
                .read(cell)
                .map(|instant| instant.seconds_since(*first))
                .map_err(refused),
        }
    }

    /// The calendar whose zero the times count from; `None` where these are numbers or times of day.
    pub fn calendar(&self) -> Option<Calendar> {
        match self {
            Self::Dates { reader, first } if reader.has_dates() => Some(Calendar {
                start: *first,
                zone: reader.zone().clone(),
            }),
            _ => None,
        }
    }

    /// A time as the file writes it.
    fn shown(&self, time: f64) -> String {
        match self {
            Self::Numbers(seconds) => crate::shown(rounded(time / seconds)).to_string(),
            Self::Dates { reader, first } => reader.format(first.after(time)),
        }
    }

    pub(super) fn check_order(&self, place: Place, previous: f64, time: f64) -> Result<(), Error> {
        if time > previous {
            return Ok(());
        }
        let (file, row, column) = (place.file(), place.row(), place.column());
        if time == previous {
            return Err(Error::Read(ReadError::RepeatedTime {
                file,
                row,
                column,
                time: self.shown(time).into(),
            }));
        }
        // An hour occurs twice when clocks are set back.
        let clock = matches!(self, Self::Dates { .. }) && previous - time <= 3600.0;
        Err(Error::Read(ReadError::BackwardTime {
            file,
            row,
            column,
            time: self.shown(time).into(),
            previous: self.shown(previous).into(),
            clock,
        }))
    }
}

/// Whether numbers look like dates as spreadsheets count them, in days since 1900: they begin in the years 2000 to 2064, and the step is one
/// that clocks of loggers have.
pub(super) fn looks_like_days(first: f64, step: f64) -> bool {
    const YEARS: std::ops::Range<f64> = 36_526.0..60_000.0;
    const SECONDS: [f64; 15] = [
        1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1200.0, 1800.0,
        3600.0,
    ];
    // Spreadsheets write five digits of a day, which is 0.86 s.
    let is_near = |seconds: &f64| (86_400.0 * step - seconds).abs() < 0.45;
    YEARS.contains(&first) && SECONDS.iter().any(is_near)
}

/// The offset from UTC at the end of a date: `+01:00`.
fn offset_of(cell: &str) -> Option<&str> {
    let cell = cell.trim();
    let time = cell.find(['T', ' '])?;
    let sign = cell[time..].find(['+', '-'])?;
    let offset = &cell[time + sign..];
    let digits = |c: char| c.is_ascii_digit() || c == ':';
    (offset[1..].chars().all(digits) && Zone::named(offset).is_ok()).then_some(offset)
}

fn cell_is_number(cell: &str) -> bool {
    cell.replace(',', ".").parse::<f64>().is_ok()
}

fn refused(error: TimestampError) -> CellFault {
    CellFault::Time(Box::new(error))
}

/// The cells of a column.
pub(super) fn cells(place: Place, column: usize) -> Vec<String> {
    let mut rows = Rows::new(place.name, place.text);
    let mut row = StringRecord::new();
    let mut cells = Vec::new();
    if rows.header().is_ok() {
        while let Ok(true) = rows.next(&mut row) {
            cells.extend(row.get(column).map(str::to_string));
        }
    }
    cells
}

/// The part of a file that is wanted \[s\].
pub(super) struct Bounds {
    from: f64,
    to: f64,
}

impl Bounds {
    pub fn of(times: &Times, seconds: f64, options: &ReadOptions) -> Result<Self, Error> {
        let bound = |limit: PartLimit, text: &Option<String>, none: f64| -> Result<f64, Error> {
            let Some(text) = text else {
                return Ok(none);
            };
            let refused = |mend: String| Error::Bound {
                limit,
                text: quoted(text),
                mend,
            };
            match times {
                Times::Numbers(_) => {
                    let number = text.trim().replace(',', ".").parse::<f64>().ok();
                    let number = number.filter(|number| number.is_finite());
                    number.map(|number| number * seconds).ok_or_else(|| {
                        refused("the file has times as numbers: give a number in their unit".into())
                    })
                }
                Times::Dates { reader, first } => reader
                    .bound(text)
                    .map(|instant| instant.seconds_since(*first))
                    .map_err(|error| refused(error.to_string())),
            }
        };
        let from = bound(PartLimit::From, &options.from, f64::NEG_INFINITY)?;
        let to = bound(PartLimit::To, &options.to, f64::INFINITY)?;
        if from >= to {
            return Err(Error::EmptyPart {
                text: quoted(options.to.as_deref().unwrap_or_default()),
            });
        }
        Ok(Self { from, to })
    }

    pub fn contain(&self, time: f64) -> bool {
        (self.from..=self.to).contains(&time)
    }
}

#[cfg(test)]
mod tests {
    use super::looks_like_days;

    #[test]
    fn days_of_a_spreadsheet_are_distinguished_from_seconds() {
        for seconds in [1.0, 10.0, 60.0, 300.0, 3600.0] {
            let days: f64 = seconds / 86_400.0;
            assert!(looks_like_days(45_260.3, days), "{seconds} s");
            let five_digits = (days * 1e5).round() / 1e5;
            assert!(looks_like_days(45_260.3, five_digits), "{seconds} s");
        }
        for step in [
            0.001,
            0.005,
            0.05,
            0.1,
            0.25,
            1.0 / 60.0,
            1.0 / 30.0,
            1.0 / 64.0,
        ] {
            assert!(!looks_like_days(45_260.3, step), "{step}");
        }
        assert!(!looks_like_days(0.0, 1.0 / 86_400.0));
    }
}
