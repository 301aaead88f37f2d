//! Time zones: from civil time to instants and back.

use jiff::Timestamp as Instant;
use jiff::tz::{AmbiguousOffset, Offset, TimeZone, TimeZoneDatabase};
use serde::{Deserialize, Serialize};

use super::form::{self, Form};
use super::{Timestamp, TimestampError};
use crate::quoted;

/// A time zone: a name of the IANA database, `UTC`, or a fixed offset such as `+01:00`.
///
/// The database is part of the program, so that a record is read alike on every machine.
///
/// ```
/// use ct_signals::Zone;
///
/// let zone = Zone::named("Europe/Berlin")?;
/// let begin = zone.bound("2026-01-31 14:25")?;
/// assert_eq!(begin, Zone::utc().bound("2026-01-31T13:25:00Z")?);
/// assert_eq!(zone.format(begin), "2026-01-31 14:25");
/// # Ok::<(), ct_signals::TimestampError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Zone {
    name: String,
    rules: Rules,
}

#[derive(Debug, Clone, PartialEq)]
enum Rules {
    /// Seconds ahead of UTC, all the year.
    Fixed(i32),
    /// A zone with daylight saving time, now or in some years.
    Changing(TimeZone),
}

impl From<Zone> for String {
    fn from(zone: Zone) -> Self {
        zone.name
    }
}

impl TryFrom<String> for Zone {
    type Error = TimestampError;

    fn try_from(name: String) -> Result<Self, Self::Error> {
        Self::named(&name)
    }
}

/// Civil times, as seconds since 1970-01-01 00:00 on the same clock, that have one offset in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct KnownOffset {
    begin: i64,
    end: i64,
    offset: i32,
}

impl KnownOffset {
    /// Zero duration.
    pub(super) const NONE: Self = Self {
        begin: 0,
        end: 0,
        offset: 0,
    };
}

/// A civil time as a cell gives it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Civil {
    /// Seconds since 1970-01-01 00:00 on the same clock.
    pub seconds: i64,
    pub nanoseconds: u32,
    /// Whether a time of day was given.
    pub timed: bool,
}

/// Reason why a civil time is not a valid instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoInstant {
    /// Clocks go forward over it.
    Skipped,
    /// The year is outside the range of the computation.
    Range,
}

impl Zone {
    /// Coordinated universal time.
    #[must_use]
    pub fn utc() -> Self {
        Self {
            name: "UTC".into(),
            rules: Rules::Fixed(0),
        }
    }

    /// A zone by its name, in small letters or capitals: `Europe/Berlin`, `UTC`, `+01:00`.
    ///
    /// # Errors
    /// [`TimestampError::UnknownZone`].
    pub fn named(name: &str) -> Result<Self, TimestampError> {
        let name = name.trim();
        if name.eq_ignore_ascii_case("UTC") || name.eq_ignore_ascii_case("Z") {
            return Ok(Self::utc());
        }
        if let Some(offset) = form::offset(name) {
            return Ok(Self {
                name: name.into(),
                rules: Rules::Fixed(offset),
            });
        }
        let found = TimeZoneDatabase::bundled().get(name).ok();
        // Jiff's name for an unknown zone is rejected.
        let zone = found
            .filter(|zone| !zone.is_unknown())
            .ok_or_else(|| TimestampError::UnknownZone { zone: quoted(name) })?;
        Ok(Self {
            name: zone.iana_name().unwrap_or(name).into(),
            rules: match zone.to_fixed_offset() {
                Ok(offset) => Rules::Fixed(offset.seconds()),
                Err(_) => Rules::Changing(zone),
            },
        })
    }

    /// The name, as the database spells it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Seconds that its clocks are ahead of UTC at an instant.
    #[must_use]
    pub fn seconds_ahead(&self, instant: Timestamp) -> i32 {
        match (&self.rules, Instant::from_second(instant.seconds())) {
            (Rules::Fixed(offset), _) => *offset,
            (Rules::Changing(zone), Ok(utc)) => zone.to_offset(utc).seconds(),
            (Rules::Changing(_), Err(_)) => 0,
        }
    }

    /// An instant for people: `2026-01-31 14:25`, with seconds and a fraction only where they are not zero.
    #[must_use]
    pub fn format(&self, instant: Timestamp) -> String {
        let beyond = || format!("{} s since 1970", instant.seconds());
        let offset = self.seconds_ahead(instant);
        let local = instant.seconds().saturating_add(offset.into());
        let Ok(local) = Instant::from_second(local) else {
            return beyond();
        };
        let civil = Offset::UTC.to_datetime(local);
        let mut text = format!(
            "{:04}-{:02}-{:02} {:02}:{:02}",
            civil.year(),
            civil.month(),
            civil.day(),
            civil.hour(),
            civil.minute()
        );
        text += &seconds_text(civil.second().unsigned_abs(), instant.nanoseconds());
        text
    }

    /// An instant for programs, with the offset from UTC (RFC 3339): `2026-01-31T14:25:00+01:00`.
    #[must_use]
    pub fn rfc3339(&self, instant: Timestamp) -> String {
        let offset = self.seconds_ahead(instant);
        let Ok(utc) = Instant::from_second(instant.seconds()) else {
            return format!("{} s since 1970", instant.seconds());
        };
        let civil = Offset::from_seconds(offset)
            .unwrap_or(Offset::UTC)
            .to_datetime(utc);
        let mut text = format!(
            "{:04}-{:02}-{:02}T{:02}:{:02}:{:02}",
            civil.year(),
            civil.month(),
            civil.day(),
            civil.hour(),
            civil.minute(),
            civil.second()
        );
        if instant.nanoseconds() != 0 {
            text += format!(".{:09}", instant.nanoseconds()).trim_end_matches('0');
        }
        let sign = if offset < 0 { '-' } else { '+' };
        let minutes = offset.unsigned_abs() / 60;
        text + &format!("{sign}{:02}:{:02}", minutes / 60, minutes % 60)
    }

    /// An instant that a person gives: `2026-01-31`, `2026-01-31 14:25`, or any date that [`TimestampReader`](super::TimestampReader)
    /// understands and that has one meaning only. A date alone is the beginning of its day.
    ///
    /// Of the hour that occurs twice in autumn the earlier is taken.
    ///
    /// # Errors
    /// [`TimestampError::UnknownBound`], [`TimestampError::NoSuchTime`], [`TimestampError::SkippedTime`].
    pub fn bound(&self, text: &str) -> Result<Timestamp, TimestampError> {
        let text = text.trim();
        let fields = Form::of(text)
            .filter(|form| form.date != form::DateForm::TimeOnly && !form.is_ambiguous(text))
            .ok_or_else(|| TimestampError::UnknownBound { text: quoted(text) })?
            .parse(text)
            .map_err(|_| TimestampError::NoSuchTime { text: quoted(text) })?;
        self.instant(text, &fields, &mut KnownOffset::NONE.clone(), None)
    }

    /// The instant of a cell that has a date.
    #[inline]
    pub(super) fn instant(
        &self,
        text: &str,
        fields: &form::Fields,
        known: &mut KnownOffset,
        previous: Option<Timestamp>,
    ) -> Result<Timestamp, TimestampError> {
        let civil = Civil {
            seconds: fields.days.unwrap_or(0) * 86_400 + fields.seconds,
            nanoseconds: fields.nanoseconds,
            timed: fields.timed,
        };
        let seconds = match fields.offset {
            Some(offset) => Ok(civil.seconds - i64::from(offset)),
            None => self.seconds(civil, known, previous),
        };
        match seconds {
            Ok(seconds) => Ok(Timestamp::new(seconds, civil.nanoseconds)),
            Err(NoInstant::Range) => Err(TimestampError::NoSuchTime { text: quoted(text) }),
            Err(NoInstant::Skipped) => Err(TimestampError::SkippedTime {
                text: quoted(text),
                zone: self.name.clone(),
            }),
        }
    }

    /// Seconds since the epoch of a civil time. `known` contains the times with known offset from the preceding call.
    #[inline]
    fn seconds(
        &self,
        civil: Civil,
        known: &mut KnownOffset,
        previous: Option<Timestamp>,
    ) -> Result<i64, NoInstant> {
        match &self.rules {
            Rules::Fixed(offset) => Ok(civil.seconds - i64::from(*offset)),
            Rules::Changing(_) if (known.begin..known.end).contains(&civil.seconds) => {
                Ok(civil.seconds - i64::from(known.offset))
            }
            Rules::Changing(zone) => changing(zone, civil, known, previous),
        }
    }
}

fn changing(
    zone: &TimeZone,
    civil: Civil,
    known: &mut KnownOffset,
    previous: Option<Timestamp>,
) -> Result<i64, NoInstant> {
    let local = Instant::from_second(civil.seconds).map_err(|_| NoInstant::Range)?;
    let ambiguous = zone.to_ambiguous_timestamp(Offset::UTC.to_datetime(local));
    let at = |offset: Offset| civil.seconds - i64::from(offset.seconds());
    match ambiguous.offset() {
        AmbiguousOffset::Unambiguous { offset } => {
            *known = known_around(zone, at(offset), offset);
            Ok(at(offset))
        }
        // Of two possible instants the earlier, unless the time would not increase.
        AmbiguousOffset::Fold { before, after } => {
            let earlier = Timestamp::new(at(before), civil.nanoseconds);
            let forward = previous.is_none_or(|previous| previous < earlier);
            Ok(if forward { at(before) } else { at(after) })
        }
        // Cannot occur. A day whose first hour is skipped begins when the clocks have gone forward.
        AmbiguousOffset::Gap { before, .. } if !civil.timed => Ok(at(before)),
        AmbiguousOffset::Gap { .. } => Err(NoInstant::Skipped),
    }
}

/// The civil times around an instant until the clocks change, without those that occur twice.
fn known_around(zone: &TimeZone, seconds: i64, offset: Offset) -> KnownOffset {
    let offset_at = |seconds| {
        let instant = Instant::from_second(seconds).ok()?;
        Some(zone.to_offset(instant).seconds())
    };
    let own = offset.seconds();
    let change = |seconds: i64, forward: bool| {
        let instant = Instant::from_second(seconds).ok()?;
        let transition = if forward {
            zone.following(instant).next()
        } else {
            zone.preceding(instant).next()
        }?;
        Some(transition.timestamp().as_second())
    };
    // A change at this very instant comes before the times that follow it.
    let begin = change(seconds + 1, false).and_then(|change| {
        let before = offset_at(change - 1)?;
        Some(change + i64::from(own.max(before)))
    });
    let end = change(seconds, true).and_then(|change| {
        let after = offset_at(change)?;
        Some(change + i64::from(own.min(after)))
    });
    KnownOffset {
        begin: begin.unwrap_or(i64::MIN),
        end: end.unwrap_or(i64::MAX),
        offset: own,
    }
}

/// Text such as `:07.25`, or empty for zero.
pub(super) fn seconds_text(seconds: u8, nanoseconds: u32) -> String {
    let mut text = String::new();
    if seconds != 0 || nanoseconds != 0 {
        text = format!(":{seconds:02}");
    }
    if nanoseconds != 0 {
        text += format!(".{nanoseconds:09}").trim_end_matches('0');
    }
    text
}
