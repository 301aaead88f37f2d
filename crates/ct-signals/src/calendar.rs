//! Start of a record, and times in text: as dates, or as numbers in a unit that suits their length.

use serde::{Deserialize, Serialize};

use crate::{Record, Timestamp, Zone};

/// The date and time at zero of a record's clock, and the zone for display.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calendar {
    /// Date and time at `time` zero.
    pub start: Timestamp,
    /// The zone of the file.
    pub zone: Zone,
}

impl Calendar {
    /// The date and time this number of seconds after the start.
    #[must_use]
    pub fn at(&self, seconds: f64) -> String {
        self.zone.format(self.start.after(seconds))
    }

    /// Date and time for programs, with the offset from UTC: `2026-01-31T14:25:00+01:00`.
    #[must_use]
    pub fn rfc3339(&self, seconds: f64) -> String {
        self.zone.rfc3339(self.start.after(seconds))
    }
}

/// Format of the times of records: dates if they are known, otherwise numbers in a unit that suits the length.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    calendar: Option<Calendar>,
    unit: &'static str,
    seconds: f64,
    decimals: usize,
}

impl Clock {
    /// For records that are shown together.
    #[must_use]
    pub fn of<'a>(records: impl IntoIterator<Item = &'a Record>) -> Self {
        let (mut calendar, mut interval) = (None, f64::INFINITY);
        let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        for record in records {
            calendar = calendar.or_else(|| record.calendar.clone());
            if let [begin, .., end] = record.time[..] {
                (first, last) = (first.min(begin), last.max(end));
                interval = interval.min(record.sample_interval());
            }
        }
        let (unit, seconds) = time_unit(last - first);
        // Enough decimals to distinguish neighbouring samples.
        let share = if interval.is_finite() {
            interval / seconds
        } else {
            1.0
        };
        let decimals = (-share.max(1e-3).log10() - 1e-9).ceil().max(0.0) as usize;
        Self {
            calendar,
            unit,
            seconds,
            decimals,
        }
    }

    /// The unit of times that are no dates, and the seconds in it.
    #[must_use]
    pub fn unit(&self) -> (&'static str, f64) {
        (self.unit, self.seconds)
    }

    /// Milliseconds from 1970-01-01 00:00 to the zero of the times, on the clocks of the record's zone; `None` where they are no dates.
    #[must_use]
    pub fn civil_milliseconds(&self) -> Option<f64> {
        let Calendar { start, zone } = self.calendar.as_ref()?;
        let civil = start.seconds() + i64::from(zone.seconds_ahead(*start));
        Some(1e3 * civil as f64 + 1e-6 * f64::from(start.nanoseconds()))
    }

    /// A time \[s\].
    #[must_use]
    pub fn at(&self, time: f64) -> String {
        match &self.calendar {
            Some(calendar) if self.decimals == 0 || self.unit != "s" => calendar.at(time.round()),
            Some(calendar) => calendar.at(time),
            None => format!("{} {}", self.number(time), self.unit),
        }
    }

    /// From one time to another \[s\]: `from 450 to 599 s`.
    #[must_use]
    pub fn span(&self, from: f64, to: f64) -> String {
        match &self.calendar {
            Some(_) => format!("from {} to {}", self.at(from), self.at(to)),
            None => {
                // A short span needs more digits than the time axis has.
                let digits = (self.decimals..self.decimals + MORE_DIGITS)
                    .find(|&digits| self.digits(from, digits) != self.digits(to, digits));
                let digits = digits.unwrap_or(self.decimals);
                let [from, to] = [from, to].map(|time| self.digits(time, digits));
                format!("from {from} to {to} {}", self.unit)
            }
        }
    }

    /// Two lengths of time \[s\]: `450 to 900 s`.
    #[must_use]
    pub fn lengths(&self, short: f64, long: f64) -> String {
        match self.unit {
            "s" if self.calendar.is_none() => {
                format!("{} to {} s", self.number(short), self.number(long))
            }
            _ => format!("{} to {}", duration(short), duration(long)),
        }
    }

    fn number(&self, time: f64) -> String {
        self.digits(time, self.decimals)
    }

    fn digits(&self, time: f64, decimals: usize) -> String {
        format!("{:.*}", decimals, time / self.seconds)
    }
}

/// Largest number of additional digits of a short span of time.
const MORE_DIGITS: usize = 6;

/// The unit in which times of this length are read most easily, and the seconds in it: below two hours s, below two days h, above d.
fn time_unit(seconds: f64) -> (&'static str, f64) {
    const HOUR: f64 = 3600.0;
    const DAY: f64 = 86400.0;
    let length = seconds.abs();
    if length < 2.0 * HOUR || !length.is_finite() {
        ("s", 1.0)
    } else if length < 2.0 * DAY {
        ("h", HOUR)
    } else {
        ("d", DAY)
    }
}

/// A duration, from milliseconds to days, with three digits.
#[must_use]
pub fn duration(seconds: f64) -> String {
    let (value, unit) = match seconds.abs() {
        s if s >= 2.0 * 86_400.0 => (seconds / 86_400.0, "days"),
        s if s >= 2.0 * 3_600.0 => (seconds / 3_600.0, "h"),
        s if s >= 600.0 => (seconds / 60.0, "min"),
        s if s >= 1.0 || s == 0.0 => (seconds, "s"),
        _ => (seconds * 1e3, "ms"),
    };
    let whole = (value - value.round()).abs() <= 1e-9 * value.abs();
    if whole || !value.is_finite() {
        return format!("{value:.0} {unit}");
    }
    // All digits of a number of thousands, and three of a smaller one.
    let digits = (2 - value.abs().log10().floor() as i32).max(0) as usize;
    format!("{value:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_said_in_the_unit_that_fits_them() {
        for (seconds, said) in [
            (0.0, "0 s"),
            (0.0125, "12.5 ms"),
            (4.0, "4 s"),
            (119.6, "120 s"),
            (900.0, "15 min"),
            (1000.0, "16.7 min"),
            (93_600.0, "26 h"),
            (1e6, "11.6 days"),
        ] {
            assert_eq!(duration(seconds), said);
        }
    }

    #[test]
    fn times_are_said_in_one_unit_or_as_dates() {
        let record = |last: f64| Record {
            time: vec![0.0, 60.0, 120.0, last],
            ..Record::default()
        };
        let short = Clock::of([&record(1800.0)]);
        assert_eq!(short.span(450.0, 599.0), "from 450 to 599 s");
        let long = Clock::of([&record(93_600.0)]);
        assert_eq!(
            (long.at(8_460.0), long.unit().0),
            ("2.35 h".to_string(), "h")
        );
        let zone = Zone::named("Europe/Berlin").unwrap();
        let mut dated = record(93_600.0);
        let start = zone.bound("2026-03-02 06:00").unwrap();
        dated.calendar = Some(Calendar { start, zone });
        let clock = Clock::of([&dated]);
        assert_eq!(
            clock.span(60.0, 3600.0),
            "from 2026-03-02 06:01 to 2026-03-02 07:00"
        );
        assert_eq!(clock.civil_milliseconds(), Some(1_772_431_200_000.0));
    }
}
