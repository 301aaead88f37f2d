//! Formats of dates in a column, and the reading of a cell.
//!
//! A [`Form`] holds what must be the same in all cells: the order and the separator of the date, and whether an offset follows. Whether
//! a cell has a time, seconds and a fraction may differ from row to row: many programs leave out what is zero.

mod scanner;

use self::scanner::Scanner;
use super::calendar;

/// Format of all cells of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Form {
    pub date: DateForm,
    /// Whether `Z` or an offset such as `+01:00` follows the time; `None` where the first cell has no time to tell.
    pub offset: Option<bool>,
}

/// The order of a date's parts, with the separator between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DateForm {
    /// `2026-01-31`
    YearFirst(u8),
    /// `20260131`, followed by a time
    Digits,
    /// `31.01.2026`
    DayFirst(u8),
    /// `01/31/2026`
    MonthFirst(u8),
    /// `03/04/2026`: one of the two above
    Undecided(u8),
    /// `31-Jan-2026`
    MonthName(u8),
    /// Time without a date: `14:25:00`
    TimeOnly,
}

/// Fields of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fields {
    /// Days since 1970-01-01; `None` without a date.
    pub days: Option<i64>,
    /// Seconds of the day; without a date there may be more than a day of them.
    pub seconds: i64,
    pub nanoseconds: u32,
    /// Seconds that local time is ahead of UTC.
    pub offset: Option<i32>,
    /// Whether the cell has a time of day.
    pub timed: bool,
}

/// Reason why a cell cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// The cell has another format.
    Form,
    /// The date or time does not exist.
    Range,
}

impl Form {
    /// The form of a cell; `None` if it is not a recognised date or time.
    pub(super) fn of(cell: &str) -> Option<Form> {
        let bytes = cell.as_bytes();
        let at = |index: usize| bytes.get(index).copied().unwrap_or(0);
        let first = leading_digits(bytes);
        let separator = at(first);
        let date = match (first, separator) {
            (8, b'T' | b't' | b' ') => DateForm::Digits,
            (4, b'-' | b'/' | b'.') => DateForm::YearFirst(separator),
            (1..=4, b':') => DateForm::TimeOnly,
            (1 | 2, b'-' | b'/' | b'.' | b' ') if at(first + 1).is_ascii_alphabetic() => {
                DateForm::MonthName(separator)
            }
            // Dates with points never have the month first.
            (1 | 2, b'.') => DateForm::DayFirst(separator),
            (1 | 2, b'-' | b'/') => DateForm::Undecided(separator),
            _ => return None,
        };
        let form = Form { date, offset: None };
        let offset = match form.parse(cell) {
            Ok(fields) if fields.timed => Some(fields.offset.is_some()),
            Ok(_) | Err(Fault::Range) => None,
            Err(Fault::Form) => return None,
        };
        Some(Form { date, offset })
    }

    /// Whether the first of the two numbers before the year is the day.
    ///
    /// `Some(true)` for `31/01/2026`, `Some(false)` for `01/31/2026`, `None` for `03/04/2026`.
    pub(super) fn day_first(cell: &str) -> Option<bool> {
        let (first, second) = first_numbers(cell)?;
        match (first > 12, second > 12) {
            (true, false) => Some(true),
            (false, true) => Some(false),
            _ => None,
        }
    }

    /// Whether day and month are the same number, so that their order does not matter.
    pub(super) fn symmetric(cell: &str) -> bool {
        first_numbers(cell).is_some_and(|(first, second)| first == second)
    }

    /// Whether a cell of this form is ambiguous.
    pub(super) fn is_ambiguous(&self, cell: &str) -> bool {
        matches!(self.date, DateForm::Undecided(_))
            && Self::day_first(cell).is_none()
            && !Self::symmetric(cell)
    }

    /// Whether a cell has day and month in the other order than this form.
    pub(super) fn is_reversed(&self, cell: &str) -> bool {
        match self.date {
            DateForm::DayFirst(_) => Self::day_first(cell) == Some(false),
            DateForm::MonthFirst(_) => Self::day_first(cell) == Some(true),
            _ => false,
        }
    }

    /// Reads one cell, without blanks around it.
    #[inline]
    pub(super) fn parse(&self, cell: &str) -> Result<Fields, Fault> {
        let mut scan = Scanner {
            bytes: cell.as_bytes(),
            at: 0,
        };
        let days = self.date(&mut scan)?;
        let mut fields = Fields {
            days,
            seconds: 0,
            nanoseconds: 0,
            offset: None,
            timed: false,
        };
        if scan.done() && days.is_some() && self.date != DateForm::Digits {
            return Ok(fields);
        }
        if days.is_some() && !scan.date_separator() {
            return Err(Fault::Form);
        }
        self.time(&mut scan, &mut fields)?;
        if self.offset != Some(false) && !(self.offset.is_none() && scan.done()) {
            scan.blanks();
            fields.offset = Some(scan.offset()?);
        }
        if scan.done() {
            Ok(fields)
        } else {
            Err(Fault::Form)
        }
    }

    fn date(&self, scan: &mut Scanner) -> Result<Option<i64>, Fault> {
        let (year, month, day) = match self.date {
            DateForm::TimeOnly => return Ok(None),
            DateForm::YearFirst(separator) => {
                let year = scan.number(4, 4)?;
                scan.expect(separator)?;
                let month = scan.number(1, 2)?;
                scan.expect(separator)?;
                (year, month, scan.number(1, 2)?)
            }
            DateForm::Digits => {
                let date = scan.number(8, 8)?;
                (date / 10_000, date / 100 % 100, date % 100)
            }
            DateForm::DayFirst(separator)
            | DateForm::MonthFirst(separator)
            | DateForm::Undecided(separator) => {
                let first = scan.number(1, 2)?;
                scan.expect(separator)?;
                let second = scan.number(1, 2)?;
                scan.expect(separator)?;
                let year = scan.number(4, 4)?;
                match self.date {
                    DateForm::MonthFirst(_) => (year, first, second),
                    DateForm::Undecided(_) if second > 12 => (year, first, second),
                    _ => (year, second, first),
                }
            }
            DateForm::MonthName(separator) => {
                let day = scan.number(1, 2)?;
                scan.expect(separator)?;
                let month = scan.month_name()?;
                scan.expect(separator)?;
                (scan.number(4, 4)?, month, day)
            }
        };
        calendar::days(year, month, day)
            .map(Some)
            .ok_or(Fault::Range)
    }

    fn time(&self, scan: &mut Scanner, fields: &mut Fields) -> Result<(), Fault> {
        let dated = fields.days.is_some();
        let (mut hour, minute, second) = self.clock(scan, dated)?;
        if second.is_some() && matches!(scan.peek(), b'.' | b',') {
            scan.at += 1;
            fields.nanoseconds = scan.fraction()?;
        }
        match scan.half_day() {
            Some(_) if !(1..=12).contains(&hour) => return Err(Fault::Range),
            Some(afternoon) => hour = hour % 12 + if afternoon { 12 } else { 0 },
            // 14:25 may be minutes and seconds.
            None if !dated && second.is_none() => return Err(Fault::Form),
            None => {}
        }
        let second = second.unwrap_or(0);
        let end_of_day = hour == 24 && minute == 0 && second == 0 && fields.nanoseconds == 0;
        if minute > 59 || second > 59 || dated && hour > 23 && !end_of_day {
            return Err(Fault::Range);
        }
        fields.seconds = i64::from(hour) * 3600 + i64::from(minute) * 60 + i64::from(second);
        fields.timed = true;
        Ok(())
    }

    /// Hour, minute and second, as they are written.
    #[inline]
    fn clock(&self, scan: &mut Scanner, dated: bool) -> Result<(u32, u32, Option<u32>), Fault> {
        if self.date == DateForm::Digits {
            let (hour, minute) = (scan.number(2, 2)?, scan.number(2, 2)?);
            let more = scan.peek().is_ascii_digit();
            return Ok((hour, minute, more.then(|| scan.number(2, 2)).transpose()?));
        }
        // Without a date, the hours may count from the start of the record.
        let hour = scan.number(1, if dated { 2 } else { 4 })?;
        scan.expect(b':')?;
        let minute = scan.number(2, 2)?;
        let more = scan.peek() == b':';
        scan.at += usize::from(more);
        Ok((hour, minute, more.then(|| scan.number(2, 2)).transpose()?))
    }
}

/// Seconds ahead of UTC for a text such as `+01:00`, `-0330`, `+01` or `Z`.
pub(super) fn offset(text: &str) -> Option<i32> {
    let mut scan = Scanner {
        bytes: text.as_bytes(),
        at: 0,
    };
    let seconds = scan.offset().ok()?;
    scan.done().then_some(seconds)
}

fn leading_digits(bytes: &[u8]) -> usize {
    bytes
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .count()
}

/// The first two numbers of a date.
fn first_numbers(cell: &str) -> Option<(u32, u32)> {
    let mut scan = Scanner {
        bytes: cell.as_bytes(),
        at: 0,
    };
    let first = scan.number(1, 2).ok()?;
    scan.at += 1;
    Some((first, scan.number(1, 2).ok()?))
}
