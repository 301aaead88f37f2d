//! Dates in every form, in order and not, with zones and without.

mod zones;

use super::*;

fn utc(text: &str) -> Timestamp {
    Zone::utc().bound(text).unwrap()
}

fn one(cell: &str) -> Result<Timestamp, TimestampError> {
    TimestampReader::new(None, None, [cell])?.read(cell)
}

fn all(zone: Option<&str>, cells: &[&str]) -> Result<Vec<Timestamp>, TimestampError> {
    let mut reader = TimestampReader::new(None, zone, cells.iter().copied())?;
    cells.iter().map(|cell| reader.read(cell)).collect()
}

#[test]
fn an_instant_is_counted_from_1970() {
    let instant = one("2026-01-31T14:25:00.25Z").unwrap();
    assert_eq!(instant.seconds(), 1_769_869_500);
    assert_eq!(instant.nanoseconds(), 250_000_000);
    let before = one("1969-12-31T23:59:59.75Z").unwrap();
    assert_eq!((before.seconds(), before.nanoseconds()), (-1, 750_000_000));
}

#[test]
fn every_way_of_writing_is_understood() {
    let whole = utc("2026-01-31 14:25:00");
    for cell in [
        "2026-01-31T14:25:00",
        "2026-01-31t14:25:00z",
        "2026-01-31 14:25:00",
        "2026-01-31  14:25",
        " 2026-01-31 14:25 ",
        "2026-01-31T14:25:00,000",
        "2026-01-31T14:25Z",
        "2026-01-31 14:25:00 UTC",
        "2026-01-31T15:25:00+01:00",
        "2026-01-31T15:25:00+0100",
        "2026-01-31 15:25:00+01",
        "2026-01-31T10:55:00 -03:30",
        "20260131T142500",
        "20260131T1425Z",
        "20260131 142500.000",
        "31.01.2026 14:25",
        "31.1.2026 14:25:00,000",
        "31/01/2026 14:25:00.000",
        "31-01-2026 14:25",
        "01/31/2026 2:25 PM",
        "1/31/2026 02:25:00.000 pm",
        "01/31/2026 14:25:00",
        "31/01/2026, 14:25:00",
        "2026/01/31 14:25:00",
        "2026/1/31 14:25",
        "2026.01.31 14:25:00",
        "31-Jan-2026 14:25:00",
        "31 Jan 2026 14:25",
        "31/jan/2026 14:25",
        "31 January 2026 2:25 PM",
    ] {
        assert_eq!(one(cell), Ok(whole), "{cell}");
        assert!(TimestampReader::understands(cell), "{cell}");
    }
    let midnight = utc("2026-01-31 00:00");
    for cell in [
        "2026-01-31",
        "2026/01/31",
        "31.01.2026",
        "31/01/2026",
        "31-Jan-2026",
        "31 Jan 2026",
        "01/31/2026 12:00 AM",
        "2026-01-30T24:00:00",
    ] {
        assert_eq!(one(cell), Ok(midnight), "{cell}");
    }
    assert_eq!(
        one("1-Feb-2026 12:30 PM"),
        Ok(utc("2026-02-01T12:30:00")),
        "noon"
    );
}

#[test]
fn what_is_no_date_is_refused() {
    for cell in [
        "12.5",
        "1769869500",
        "20260131",
        "1e5",
        "-3",
        "abc",
        "2026",
        "2026-01",
        "14:25",
        "31.01.26",
        "2026-01-31T",
        "2026-01-31 14",
        "2026-01-31 14:2",
        "2026-01-31 14:25:00.",
        "2026-01-31 14:25:00 CET",
        "2026-01-31 14:25:00+1",
        "31-Foo-2026",
        "2026-01-31 14:25:00é",
        "١٢:٠٠:٠٠",
    ] {
        assert!(!TimestampReader::understands(cell), "{cell}");
        assert!(
            matches!(one(cell), Err(TimestampError::UnknownForm { .. })),
            "{cell}"
        );
    }
    assert_eq!(
        TimestampReader::new(None, None, ["", " "]).unwrap_err(),
        TimestampError::NoCells
    );
}

#[test]
fn what_is_not_in_the_calendar_is_refused() {
    for cell in [
        "2026-02-29",
        "2026-13-01 00:00",
        "2026-01-31 24:00:01",
        "2026-01-31 14:60",
        "2026-01-31 14:25:60",
        "01/31/2026 13:00 PM",
        "2026-01-31 14:25+24:00",
        "13/13/2026",
    ] {
        assert!(
            matches!(one(cell), Err(TimestampError::NoSuchTime { .. })),
            "{cell}: {:?}",
            one(cell)
        );
    }
}

#[test]
fn the_column_says_which_number_is_the_day() {
    let day_first = all(None, &["03/04/2026", "12/04/2026", "13/04/2026"]).unwrap();
    assert_eq!(day_first[0], utc("2026-04-03"));
    let month_first = all(None, &["3-4-2026 1:00", "4-13-2026 1:00"]).unwrap();
    assert_eq!(month_first[0], utc("2026-03-04 01:00"));
    assert_eq!(
        all(None, &["03/03/2026 1:00", "03/03/2026 2:00"]).unwrap()[1],
        utc("2026-03-03 02:00")
    );
    // A point is never between month and day.
    assert_eq!(all(None, &["03.04.2026"]).unwrap()[0], utc("2026-04-03"));
}

#[test]
fn where_nothing_says_which_number_is_the_day_two_formats_are_named() {
    for (time, clock) in [
        ("", "00:00"),
        (" 14:25", "14:25"),
        (" 2:25:00.5 PM", "14:25:00.5"),
        (" 14:25:00,5", "14:25:00.5"),
        (" 15:25:00+01:00", "14:25"),
        (" 10:55 -0330", "14:25"),
    ] {
        let cell = format!("03/04/2026{time}");
        let error = one(&cell).unwrap_err();
        let TimestampError::DayOrMonth {
            day_first,
            month_first,
            ..
        } = &error
        else {
            panic!("{error}");
        };
        assert!(error.to_string().contains("time_format"));
        for (format, date) in [(day_first, "2026-04-03"), (month_first, "2026-03-04")] {
            let mut reader = TimestampReader::new(Some(format), None, [cell.as_str()]).unwrap();
            assert_eq!(reader.read(&cell).unwrap(), utc(&format!("{date} {clock}")));
        }
    }
    // Later cells may be the first ambiguous ones, or have the other order.
    let mut reader = TimestampReader::new(None, None, ["03/03/2026"]).unwrap();
    assert!(matches!(
        reader.read("04/03/2026"),
        Err(TimestampError::DayOrMonth { .. })
    ));
    assert_eq!(
        all(None, &["13/04/2026", "04/13/2026"]),
        Err(TimestampError::BothOrders {
            text: "04/13/2026".into(),
            first_here: "month"
        })
    );
}

#[test]
fn all_cells_are_written_alike_but_for_what_is_zero() {
    let times = all(
        None,
        &["31.01.2026", "31.01.2026 00:01", "31.01.2026 00:01:00,5"],
    )
    .unwrap();
    assert_eq!(times[2].seconds_since(times[0]), 60.5);
    for second in [
        "01.02.2026 00:00",
        "2026/02/01 00:00",
        "2026-02-01 00:00Z",
        "x",
        "",
    ] {
        assert!(matches!(
            all(None, &["2026-01-31 00:00", second]),
            Err(TimestampError::OtherForm { .. })
        ));
    }
}

#[test]
fn a_time_of_day_passes_midnight() {
    let cells = [
        "23:59:59.5",
        "00:00:00.5",
        "12:00:00",
        "11:00:00",
        "23:00:00",
        "1:00:00",
    ];
    let mut reader = TimestampReader::new(None, None, cells).unwrap();
    assert!(!reader.has_dates());
    let times: Vec<Timestamp> = cells.iter().map(|c| reader.read(c).unwrap()).collect();
    assert_eq!(times[1].seconds_since(times[0]), 1.0);
    // A fall by less than half a day is an error of the file.
    assert_eq!(times[3].seconds_since(times[2]), -3600.0);
    assert_eq!(times[5].seconds_since(times[0]), 86_400.0 + 3600.5);
    assert_eq!(reader.format(times[0]), "23:59:59.5");
    assert_eq!(reader.format(times[5]), "01:00:00 (2 days later)");
    assert_eq!(reader.bound("12:30").unwrap().seconds(), 45_000);
    // Hours since the start of the record.
    let hours = all(None, &["0:00:00", "23:59:59", "24:00:00", "100:00:00"]).unwrap();
    assert_eq!(hours[3].seconds_since(hours[0]), 360_000.0);
    let noon = all(None, &["11:59 AM", "12:00 PM", "11:59 PM", "12:00 AM"]).unwrap();
    assert_eq!(noon[3].seconds_since(noon[0]), 43_260.0);
}

#[test]
fn a_format_by_hand_is_followed() {
    let by = |format: &str, cell: &str| {
        TimestampReader::new(Some(format), Some("+01:00"), [cell])?.read(cell)
    };
    let instant = utc("2026-01-31 13:25:00");
    for (format, cell) in [
        ("%d.%m.%Y %H:%M:%S", "31.01.2026 14:25:00"),
        ("%d.%m.%y %H:%M", "31.01.26 14:25"),
        ("%b %d, %Y %I:%M %p", "Jan 31, 2026 2:25 PM"),
        ("%Y-%m-%d %H:%M %z", "2026-01-31 08:25 -0500"),
        ("%Y-%jT%H:%M", "2026-031T14:25"),
        ("%s", "1769865900"),
    ] {
        assert_eq!(by(format, cell), Ok(instant), "{format}");
    }
    assert_eq!(by("%Y%m%d", "20260131"), Ok(utc("2026-01-30 23:00")));
    assert_eq!(by("%H:%M", "14:25").unwrap().seconds(), 51_900);
    for (format, cell) in [
        ("%d.%m.%Y", "31.01.2026 14:25"),
        ("%d.%m. %H:%M", "31.01. 14:25"),
        ("%M:%S", "25:00"),
        ("%Q", "Europe/Berlin"),
        ("%!", "x"),
        ("", "x"),
    ] {
        let error = by(format, cell).unwrap_err();
        assert!(matches!(error, TimestampError::Format { .. }), "{error}");
    }
}

#[test]
fn a_bound_has_one_meaning() {
    let zone = Zone::named("Europe/Berlin").unwrap();
    let begin = zone.bound("2026-01-31").unwrap();
    assert_eq!(begin, utc("2026-01-30 23:00"));
    assert_eq!(zone.bound(" 31.01.2026 ").unwrap(), begin);
    assert_eq!(zone.bound("01/31/2026").unwrap(), begin);
    for text in ["", "now", "14:25:00", "03/04/2026", "2026"] {
        let error = zone.bound(text).unwrap_err();
        assert!(
            matches!(error, TimestampError::UnknownBound { .. }),
            "{text}"
        );
    }
    assert!(matches!(
        zone.bound("2026-02-30"),
        Err(TimestampError::NoSuchTime { .. })
    ));
    // With the known format of the column.
    let reader = TimestampReader::new(None, Some("Europe/Berlin"), ["01/31/2026 14:25"]).unwrap();
    assert_eq!(
        reader.bound("03/04/2026 1:00").unwrap(),
        utc("2026-03-04 00:00")
    );
    assert_eq!(reader.bound("2026-01-31").unwrap(), begin);
    assert!(reader.bound("12:30").is_err());
}

#[test]
fn people_see_seconds_only_where_there_are_any() {
    for (cell, said) in [
        ("2026-01-31", "2026-01-31 00:00"),
        ("2026-01-31 14:25:00", "2026-01-31 14:25"),
        ("2026-01-31 14:25:07", "2026-01-31 14:25:07"),
        ("2026-01-31 14:25:00.250", "2026-01-31 14:25:00.25"),
        ("0001-01-01", "0001-01-01 00:00"),
        ("9999-12-29 23:59:59", "9999-12-29 23:59:59"),
    ] {
        assert_eq!(Zone::utc().format(utc(cell)), said);
    }
    let first = utc("2026-01-31 23:59:59.9");
    assert_eq!(Zone::utc().format(first.after(0.1)), "2026-02-01 00:00");
    assert_eq!(
        Zone::utc().format(first.after(1e7 + 0.3)),
        "2026-05-27 17:46:40.2"
    );
    assert_eq!(first.after(-0.9), utc("2026-01-31 23:59:59"));
    assert!(Zone::utc().format(first.after(1e30)).contains("since 1970"));
    let _ = first.after(f64::NAN);
}
