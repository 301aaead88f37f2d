//! Checks that need the whole record.

use std::collections::HashMap;

use super::{ReadOptions, fewest_rows, table::Table, text::line_number};
use crate::columns::{Found, Layout, Purpose};
use crate::quote::rounded;
use crate::record::median_step;
use crate::series::constant;
use crate::{Error, Shortage, quoted};

/// A record is rejected if more than this share of the output is exactly at its limits ...
const SATURATED_SHARE: f64 = 1.0 / 3.0;

/// ... and that is more than this many times what the commonest other value has: a coarsely
/// quantised output has many samples at every level, a saturated one only at its limits.
const SATURATED_RATIO: usize = 4;

/// Inputs, outputs and sampling intervals between the inverse of this and this do not overflow in the powers that a fit computes.
const LARGEST: f64 = 1e15;

impl Table {
    pub(super) fn check(
        &self,
        file: &str,
        text: &str,
        layout: &Layout,
        (options, purpose): (&ReadOptions, Purpose),
    ) -> Result<(), Error> {
        let rows = self.time.len();
        if rows + self.outside == 0 && self.without_time > 0 {
            let (end, words) = &self.untimed;
            return Err(Error::NoSample {
                file: file.into(),
                row: line_number(text, *end),
                column: quoted(&layout.time.header),
                rows: self.without_time,
                words: listed(words),
            });
        }
        let needed = fewest_rows(purpose);
        if rows < needed {
            let why = match self.outside {
                0 => Shortage::Short,
                rows => Shortage::Outside { rows },
            };
            return Err(Error::TooFewRows {
                record: file.into(),
                rows,
                needed,
                why,
            });
        }
        if options.strict {
            self.check_gaps(file, text, &layout.time)?;
        }
        let channels = || layout.channels().zip(&self.values).zip(&self.missing);
        let needed = match purpose {
            Purpose::Fit => self.values.len(),
            Purpose::Simulation => layout.inputs.len(),
        };
        for ((column, values), words) in channels().take(needed) {
            if values.iter().all(|value| value.is_nan()) {
                return Err(Error::NoSample {
                    file: file.into(),
                    row: line_number(text, self.ends[0]),
                    column: quoted(&column.header),
                    rows,
                    words: listed(words),
                });
            }
        }
        if purpose == Purpose::Simulation {
            return self.check_scale(file, text, layout, purpose);
        }
        let outputs = layout.inputs.len()..layout.inputs.len() + layout.outputs.len();
        for ((column, values), _) in channels().take(outputs.end).skip(outputs.start) {
            if let Some(value) = constant(values) {
                return Err(Error::ConstantOutput {
                    file: file.into(),
                    column: quoted(&column.header),
                    value,
                    rows,
                });
            }
        }
        self.check_scale(file, text, layout, purpose)?;
        channels()
            .take(outputs.end)
            .skip(outputs.start)
            .try_for_each(|((column, values), _)| check_saturation(file, column, values))
    }

    fn check_scale(
        &self,
        file: &str,
        text: &str,
        layout: &Layout,
        purpose: Purpose,
    ) -> Result<(), Error> {
        let interval = median_step(&self.time);
        if !(1.0 / LARGEST..=LARGEST).contains(&interval) {
            return Err(Error::InvalidInterval {
                file: file.into(),
                column: quoted(&layout.time.header),
                interval: rounded(interval),
                low: 1.0 / LARGEST,
                high: LARGEST,
            });
        }
        let own = layout.inputs.len() + layout.outputs.len();
        let columns = layout.channels().zip(&self.values).take(own);
        for (i, (column, values)) in columns.enumerate() {
            if let Some(k) = values.iter().position(|value| value.abs() > LARGEST) {
                return Err(Error::TooLarge {
                    file: file.into(),
                    row: line_number(text, self.ends[k]),
                    column: quoted(&column.header),
                    value: values[k],
                    limit: LARGEST,
                });
            }
            let largest = values.iter().fold(0.0, |high: f64, v| high.max(v.abs()));
            // A signal for simulation may be zero for a long time, and so may one of several inputs.
            let inputs = layout.inputs.len();
            let unused = largest == 0.0 && inputs > 1 && i < inputs;
            if purpose == Purpose::Fit && largest < 1.0 / LARGEST && !unused {
                return Err(Error::TooSmall {
                    file: file.into(),
                    column: quoted(&column.header),
                    value: rounded(largest),
                    limit: 1.0 / LARGEST,
                });
            }
        }
        Ok(())
    }

    fn check_gaps(&self, file: &str, text: &str, column: &Found) -> Result<(), Error> {
        let Some((k, missing)) = crate::gaps::first_gap(&self.time) else {
            return Ok(());
        };
        let shown = |time: f64| self.shown(time, column);
        Err(Error::Gap {
            file: file.into(),
            row: line_number(text, self.ends[k + 1]),
            column: quoted(&column.header),
            missing: missing as u64,
            previous: shown(self.time[k]).into(),
            time: shown(self.time[k + 1]).into(),
            interval: rounded(median_step(&self.time)),
        })
    }

    /// A time as the file writes it: in its unit, or as a date.
    fn shown(&self, time: f64, column: &Found) -> String {
        match &self.calendar {
            Some(calendar) => calendar.at(time),
            None => {
                let seconds = crate::unit::seconds(&column.unit).unwrap_or(1.0);
                crate::shown(rounded(time / seconds)).to_string()
            }
        }
    }
}

/// The contents of the cells with missing samples.
fn listed(words: &[(String, usize)]) -> String {
    let word = |(word, _): &(String, usize)| match word.as_str() {
        "" => "empty cells".to_string(),
        word => format!("\"{}\"", quoted(word)),
    };
    words.iter().map(word).collect::<Vec<_>>().join(", ")
}

fn check_saturation(file: &str, column: &Found, values: &[f64]) -> Result<(), Error> {
    let present = || values.iter().copied().filter(|value| !value.is_nan());
    let rows = present().count();
    let low = present().fold(f64::INFINITY, f64::min);
    let high = present().fold(f64::NEG_INFINITY, f64::max);
    // The single lowest or highest sample of a record is no limit.
    let at = |value: f64| Some(present().filter(|v| *v == value).count()).filter(|n| *n > 1);
    let (at_low, at_high) = (at(low).unwrap_or(0), at(high).unwrap_or(0));
    let count = at_low + at_high;
    if count as f64 <= SATURATED_SHARE * rows as f64 {
        return Ok(());
    }
    let mut counts: HashMap<u64, usize> = HashMap::new();
    for value in present().filter(|value| *value != low && *value != high) {
        *counts.entry(value.to_bits()).or_default() += 1;
    }
    let commonest = counts.values().copied().max().unwrap_or(0);
    if count <= SATURATED_RATIO * commonest {
        return Ok(());
    }
    let unit = if column.unit.is_empty() {
        String::new()
    } else {
        format!(" {}", quoted(&column.unit))
    };
    let limits = [(at_low, low), (at_high, high)]
        .iter()
        .filter(|(samples, _)| *samples > 0)
        .map(|(samples, value)| format!("{samples} at {value}{unit}"))
        .collect::<Vec<_>>()
        .join(", ");
    Err(Error::Saturated {
        file: file.into(),
        column: quoted(&column.header),
        count,
        rows,
        limits,
    })
}
