//! When a record began, and times in the unit that fits their length.

use crate::{Timestamp, Zone};

/// The date and time at which the clock of a record stands at zero, and the zone in which people read it.
#[derive(Debug, Clone, PartialEq)]
pub struct Calendar {
    /// When `time` is zero.
    pub start: Timestamp,
    /// The zone of the file.
    pub zone: Zone,
}

impl Calendar {
    /// The date and time so many seconds behind the start.
    #[must_use]
    pub fn at(&self, seconds: f64) -> String {
        self.zone.format(self.start.after(seconds))
    }
}

/// The unit in which a time of this length is read most easily, and the seconds in it: below two minutes s, below two hours min, below two
/// days h, above d.
#[must_use]
pub fn time_unit(seconds: f64) -> (&'static str, f64) {
    const MINUTE: f64 = 60.0;
    const HOUR: f64 = 3600.0;
    const DAY: f64 = 86400.0;
    let length = seconds.abs();
    if length < 2.0 * MINUTE || !length.is_finite() {
        ("s", 1.0)
    } else if length < 2.0 * HOUR {
        ("min", MINUTE)
    } else if length < 2.0 * DAY {
        ("h", HOUR)
    } else {
        ("d", DAY)
    }
}

/// A time in the unit that fits its length, with three digits: `1.5 min`, `26 h`.
#[must_use]
pub fn duration(seconds: f64) -> String {
    let (unit, size) = time_unit(seconds);
    let value = seconds / size;
    let digits = if value == 0.0 || !value.is_finite() {
        0
    } else {
        (2 - value.abs().log10().floor() as i32).max(0) as usize
    };
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    format!("{text} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_said_in_the_unit_that_fits_them() {
        for (seconds, said) in [
            (0.0, "0 s"),
            (0.0125, "0.0125 s"),
            (4.0, "4 s"),
            (119.6, "120 s"),
            (150.0, "2.5 min"),
            (93_600.0, "26 h"),
            (1e6, "11.6 d"),
        ] {
            assert_eq!(duration(seconds), said);
        }
    }
}
