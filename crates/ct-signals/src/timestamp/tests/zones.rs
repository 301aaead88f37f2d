//! Zones, hours that occur twice or are left out, and random instants written and read back.

use proptest::prelude::*;

use super::super::*;
use super::{all, one, utc};

#[test]
fn an_hour_that_occurs_twice_goes_forward() {
    // Clocks in Berlin go back from 03:00 to 02:00 on 25 October 2026, at 01:00 UTC.
    let hour = |cells: &[&str]| -> Vec<f64> {
        let times = all(Some("Europe/Berlin"), cells).unwrap();
        let midnight = utc("2026-10-25");
        times
            .iter()
            .map(|t| t.seconds_since(midnight) / 3600.0)
            .collect()
    };
    let cells = [
        "2026-10-25 01:00",
        "2026-10-25 02:00",
        "2026-10-25 02:30",
        "2026-10-25 02:00",
        "2026-10-25 02:30",
        "2026-10-25 03:00",
    ];
    assert_eq!(hour(&cells), [-1.0, 0.0, 0.5, 1.0, 1.5, 2.0]);
    // One sample an hour: the times would not increase if the earlier hour is used twice.
    assert_eq!(
        hour(&["2026-10-25 02:00", "2026-10-25 02:00", "2026-10-25 03:00"]),
        [0.0, 1.0, 2.0]
    );
    assert_eq!(hour(&["2026-10-25 02:59:59"]), [3599.0 / 3600.0]);
}

#[test]
fn a_time_that_is_left_out_is_refused() {
    let cells = ["2026-03-29 01:59:59", "2026-03-29 03:00"];
    let times = all(Some("Europe/Berlin"), &cells).unwrap();
    assert_eq!(times[1].seconds_since(times[0]), 1.0);
    let error = all(
        Some("Europe/Berlin"),
        &["2026-03-29 01:59", "2026-03-29 02:30"],
    );
    assert_eq!(
        error,
        Err(TimestampError::SkippedTime {
            text: "2026-03-29 02:30".into(),
            zone: "Europe/Berlin".into()
        })
    );
    // Knowledge of the clocks after the change is not used for times before it.
    let mut reader = TimestampReader::new(None, Some("Europe/Berlin"), cells).unwrap();
    assert_eq!(reader.read(cells[1]), Ok(times[1]));
    assert!(reader.read("2026-03-29 02:30").is_err());
    assert_eq!(reader.read(cells[0]), Ok(times[0]));
    // The offset says what the clock does not.
    assert!(all(Some("Europe/Berlin"), &["2026-03-29T02:30+01:00"]).is_ok());
    // In Beirut the first hour of that day is left out: the day begins at 01:00.
    let days = ["2026-03-28", "2026-03-29", "2026-03-30"];
    let days = all(Some("Asia/Beirut"), &days).unwrap();
    assert_eq!(days[1].seconds_since(days[0]), 86_400.0);
    assert_eq!(days[2].seconds_since(days[1]), 82_800.0);
}

#[test]
fn a_zone_is_a_name_or_an_offset() {
    let noon = |zone: &str| all(Some(zone), &["2026-07-01 12:00"]).unwrap()[0];
    let utc = utc("2026-07-01 12:00");
    for (zone, hours) in [
        ("UTC", 0.0),
        ("utc", 0.0),
        ("Etc/UTC", 0.0),
        ("Europe/Berlin", -2.0),
        ("europe/berlin", -2.0),
        ("America/New_York", 4.0),
        ("Asia/Kolkata", -5.5),
        ("Etc/GMT+5", 5.0),
        ("+01:00", -1.0),
        ("-0330", 3.5),
    ] {
        assert_eq!(noon(zone).seconds_since(utc) / 3600.0, hours, "{zone}");
    }
    assert_eq!(
        Zone::named("europe/berlin").unwrap().name(),
        "Europe/Berlin"
    );
    for zone in ["Europe/Berlim", "CEST", "", "+25:00", "Etc/Unknown"] {
        assert_eq!(
            Zone::named(zone),
            Err(TimestampError::UnknownZone { zone: zone.into() })
        );
    }
}

/// A zone without changes in the year 2026, one with two, and one with four.
const ZONES: [&str; 4] = ["UTC", "-03:30", "Europe/Berlin", "Africa/Casablanca"];

proptest! {
    #[test]
    fn what_is_formatted_is_read_again(
        seconds in -30_000_000_000_i64..30_000_000_000,
        nanoseconds in prop_oneof![Just(0_u32), 0..1_000_000_000_u32],
        zone in 0..ZONES.len(),
    ) {
        let zone = Zone::named(ZONES[zone]).unwrap();
        let instant = Timestamp::new(seconds, nanoseconds);
        let text = zone.format(instant);
        // The later of two equal times is read as the earlier.
        let read = zone.bound(&text).unwrap();
        prop_assert!(read == instant || zone.format(read) == text && read < instant, "{text}");
        // A time one hour after the earlier one is the later one.
        let mut reader = TimestampReader::new(None, Some(zone.name()), [text.as_str()]).unwrap();
        reader.previous = Some(instant.after(-1.0));
        prop_assert_eq!(reader.read(&text).unwrap(), instant);
    }

    #[test]
    fn known_offsets_are_those_of_the_zone(
        begin in 1_700_000_000_i64..1_900_000_000,
        steps in prop::collection::vec(1..3_000_000_i64, 1..40),
        zone in 0..ZONES.len(),
    ) {
        let zone = Zone::named(ZONES[zone]).unwrap();
        let mut reader = TimestampReader::new(None, Some(zone.name()), ["2026-01-31"]).unwrap();
        let mut instant = Timestamp::new(begin, 0);
        for step in steps {
            instant = instant.after(step as f64);
            let text = zone.format(instant);
            let read = reader.read(&text).unwrap();
            prop_assert!(read == instant || zone.format(read) == text && read < instant, "{text}");
        }
    }

    #[test]
    fn differences_are_exact(
        first in -4_000_000_000_i64..4_000_000_000,
        nanoseconds in 0..1_000_000_000_u32,
        step in 0..9_000_000_000_000_i64,
    ) {
        let first = Timestamp::new(first, nanoseconds);
        let total = i64::from(nanoseconds) + step;
        let second = Timestamp::new(
            first.seconds + total / 1_000_000_000,
            (total % 1_000_000_000) as u32,
        );
        prop_assert_eq!(second.seconds_since(first), step as f64 / 1e9);
        prop_assert_eq!(first.seconds_since(second), -(step as f64) / 1e9);
    }

    #[test]
    fn no_cell_panics(cell in "\\PC{0,30}", other in "[0-9TZ:./+, -]{0,28}|[0-9]{1,4}[-/.][0-9]{1,2}[-/.][0-9]{1,4} ?[0-9:.]{0,12}( [AP]M)?") {
        for cell in [cell.as_str(), other.as_str()] {
            let _ = one(cell);
            let _ = Zone::utc().bound(cell);
            let _ = Zone::named(cell);
            let _ = TimestampReader::new(Some(cell), None, [other.as_str()]);
        }
    }
}
