//! The form in which the cells of a column are written: found from all of them, or given.

use jiff::fmt::strtime::BrokenDownTime;

use super::form::{DateForm, Fields, Form};
use super::{DAY, TimestampError, Written, calendar};
use crate::quoted;

/// The form of the first cell and whether it has a date; the order of day and month comes from the other cells if it is ambiguous.
pub(super) fn find_form<'a>(
    first: &'a str,
    others: impl Iterator<Item = &'a str>,
) -> Result<(Written, bool), TimestampError> {
    let text = || quoted(first);
    let form = Form::of(first).ok_or_else(|| TimestampError::UnknownForm { text: text() })?;
    form.parse(first)
        .map_err(|_| TimestampError::NoSuchTime { text: text() })?;
    let DateForm::Undecided(separator) = form.date else {
        return Ok((Written::Form(form), form.date != DateForm::TimeOnly));
    };
    let mut symmetric = true;
    for cell in std::iter::once(first).chain(others) {
        let date = match Form::day_first(cell) {
            Some(true) => DateForm::DayFirst(separator),
            Some(false) => DateForm::MonthFirst(separator),
            None => {
                symmetric &= Form::symmetric(cell);
                continue;
            }
        };
        return Ok((Written::Form(Form { date, ..form }), true));
    }
    if symmetric {
        Ok((Written::Symmetric(form), true))
    } else {
        Err(undecided(first, &form))
    }
}

/// The message that requests a format, with the two possible formats.
pub(super) fn undecided(cell: &str, form: &Form) -> TimestampError {
    let separator = match form.date {
        DateForm::Undecided(separator) => char::from(separator),
        _ => '/',
    };
    let clock = cell.find(':').unwrap_or(cell.len());
    let end = cell[clock..].find(['+', '-']).map(|sign| clock + sign);
    let (local, offset) = cell.split_at(end.unwrap_or(cell.len()));
    let half_day = local.trim_end().ends_with(['m', 'M']);
    let mut time = String::new();
    let colons = local.matches(':').count();
    if colons > 0 {
        time += if half_day { " %I:%M" } else { " %H:%M" };
    }
    if colons > 1 {
        time += ":%S";
        if local.contains('.') {
            time += "%.f";
        } else if local.contains(',') {
            time += ",%f";
        }
    }
    if half_day {
        time += " %p";
    }
    if !offset.is_empty() {
        time += if local.ends_with(' ') { " " } else { "" };
        time += if offset.contains(':') { "%:z" } else { "%z" };
    }
    TimestampError::DayOrMonth {
        text: quoted(cell),
        day_first: format!("%d{separator}%m{separator}%Y{time}"),
        month_first: format!("%m{separator}%d{separator}%Y{time}"),
    }
}

/// Reads a cell by a format of `strftime`.
pub(super) fn by_format(format: &str, cell: &str) -> Result<Fields, TimestampError> {
    let fault = |reason: String| TimestampError::Format {
        text: quoted(cell),
        format: quoted(format),
        reason: quoted(&reason),
    };
    let parts = BrokenDownTime::parse(format, cell).map_err(|error| fault(error.to_string()))?;
    if parts.iana_time_zone().is_some() {
        return Err(fault("names of zones in cells are not read".into()));
    }
    if let Some(instant) = parts.timestamp() {
        let seconds = instant.as_duration();
        let nanoseconds = i64::from(seconds.subsec_nanos());
        let whole = seconds.as_secs() - i64::from(nanoseconds < 0);
        return Ok(Fields {
            days: Some(whole.div_euclid(DAY)),
            seconds: whole.rem_euclid(DAY),
            nanoseconds: nanoseconds.rem_euclid(1_000_000_000) as u32,
            offset: Some(0),
            timed: true,
        });
    }
    let dated = [
        parts.year().is_some(),
        parts.iso_week_year().is_some(),
        parts.month().is_some(),
        parts.day().is_some(),
        parts.day_of_year().is_some(),
    ];
    let days = if dated.contains(&true) {
        let date = parts.to_date().map_err(|error| fault(error.to_string()))?;
        let [year, month, day] = [
            i32::from(date.year()),
            date.month().into(),
            date.day().into(),
        ]
        .map(i32::unsigned_abs);
        let days = calendar::days(year, month, day).filter(|_| date.year() > 0);
        Some(days.ok_or_else(|| TimestampError::NoSuchTime { text: quoted(cell) })?)
    } else {
        None
    };
    let time = parts.to_time().map_err(|error| fault(error.to_string()))?;
    let timed = parts.hour().is_some();
    if days.is_none() && !timed {
        return Err(fault("it has neither a date nor an hour".into()));
    }
    Ok(Fields {
        days,
        seconds: i64::from(time.hour()) * 3600
            + i64::from(time.minute()) * 60
            + i64::from(time.second()),
        nanoseconds: time.subsec_nanosecond().unsigned_abs(),
        offset: parts.offset().map(|offset| offset.seconds()),
        timed,
    })
}
