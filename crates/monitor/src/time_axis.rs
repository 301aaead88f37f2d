//! Format of times: in seconds, or as dates.

use ct_signals::Calendar;
use serde::{Deserialize, Serialize};

/// Format of the times of rows \[s\]: in seconds, or as dates if the date of time zero is known.
///
/// ```
/// use ct_signals::{Calendar, Zone};
/// use monitor::TimeAxis;
///
/// let zone = Zone::utc();
/// let start = zone.bound("2026-03-02 06:00")?;
/// let dates = TimeAxis { calendar: Some(Calendar { start, zone }) };
/// assert_eq!(dates.at(90.0), "2026-03-02 06:01:30");
/// assert_eq!(TimeAxis::default().at(90.0), "t = 90 s");
/// # Ok::<(), ct_signals::TimestampError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TimeAxis {
    /// Date of time zero, and the zone of the dates.
    pub calendar: Option<Calendar>,
}

impl TimeAxis {
    /// A time \[s\] in a sentence: `t = 450 s`, or a date.
    #[must_use]
    pub fn at(&self, time: f64) -> String {
        match &self.calendar {
            Some(calendar) => calendar.at(rounded(time)),
            None => format!("t = {} s", rounded(time)),
        }
    }

    /// A time \[s\] by itself: `450 s`, or a date.
    #[must_use]
    pub fn value(&self, time: f64) -> String {
        match &self.calendar {
            Some(_) => self.at(time),
            None => format!("{} s", rounded(time)),
        }
    }

    /// A range of times \[s\]: `from 450 to 599 s`, or dates.
    #[must_use]
    pub fn span(&self, from: f64, to: f64) -> String {
        match &self.calendar {
            Some(_) => format!("from {} to {}", self.at(from), self.at(to)),
            None => format!("from {} to {} s", rounded(from), rounded(to)),
        }
    }

    /// A time \[s\] for programs (RFC 3339): `2026-01-31T14:25:00+01:00`; `None` where times are no dates.
    #[must_use]
    pub fn date(&self, time: f64) -> Option<String> {
        let calendar = self.calendar.as_ref()?;
        Some(calendar.rfc3339(rounded(time)))
    }

    pub(crate) fn is_seconds(&self) -> bool {
        self.calendar.is_none()
    }
}

/// Rounds to the millisecond; a time above 1e12 s is not rounded.
fn rounded(time: f64) -> f64 {
    if time.abs() < 1e12 {
        (time * 1e3).round() / 1e3
    } else {
        time
    }
}
