//! What may be wrong in a record that was read, in sentences with the corrections.

use ct_signals::{IsolatedReadings, OutOfRange, ReadSummary, duration, quoted};

use crate::numbers;
use crate::sentences::with_unit;

/// Sentences about what may be wrong in a record that was read, with the corrections.
pub(crate) fn faults(summary: &ReadSummary) -> impl Iterator<Item = String> {
    let outside = summary.out_of_range.iter();
    let outside = outside.map(|outside| of_range(summary, outside));
    days(summary)
        .into_iter()
        .chain(isolated(summary))
        .chain(outside)
}

/// A sentence about values outside the range that the model declares, with the correction.
fn of_range(summary: &ReadSummary, outside: &OutOfRange) -> String {
    let shown = |value: f64| with_unit(&numbers::significant(value, 4), &outside.unit);
    let (beyond, bound, towards) = if outside.value > outside.bound {
        ("above", "max", "up")
    } else {
        ("below", "min", "down")
    };
    let rows = match outside.rows {
        1 => "1 row".to_string(),
        rows => format!("{rows} rows"),
    };
    format!(
        "{}: {signal} is {beyond} its {bound} of {} in {rows}, {towards} to {}: correct the unit in the column's header, or the {bound} of {signal} in the model",
        summary.file,
        shown(outside.bound),
        shown(outside.value),
        signal = outside.signal,
    )
}

/// A sentence about times that look like days, with the correction.
fn days(summary: &ReadSummary) -> Option<String> {
    summary.looks_like_days.then(|| {
        format!(
            "{}, column \"{time}\": the times are taken as seconds, and look like dates that a spreadsheet wrote as days; if they are, write the \
             unit into the header, \"{time} [d]\"",
            summary.file,
            time = summary.time_header
        )
    })
}

/// Sentences about readings that are far from the others, with the correction.
fn isolated(summary: &ReadSummary) -> impl Iterator<Item = String> {
    let far = summary.isolated.iter();
    far.map(|far| of_isolated(summary, far))
}

fn of_isolated(summary: &ReadSummary, far: &IsolatedReadings) -> String {
    let at = match &summary.calendar {
        Some(calendar) => calendar.at(far.time).to_string(),
        None => duration(far.time),
    };
    let shown = |value: f64| with_unit(&numbers::significant(value, 4), &far.unit);
    let (before, after) = far.neighbours;
    let what = match far.count {
        1 => "one reading is".to_string(),
        count if far.is_code => format!("{count} readings of one value are"),
        count => format!("{count} readings are"),
    };
    let correction = if far.is_code {
        format!(
            "write missing = [\"{}\"] under [columns], with the number as written in the file",
            ct_signals::shown(far.value)
        )
    } else {
        "empty the cells".to_string()
    };
    format!(
        "{}, column {}: {what} far from the others, {} at {at} between {} and {}: if it is not a measurement, {correction}",
        summary.file,
        quoted(&far.column),
        shown(far.value),
        shown(before),
        shown(after)
    )
}
