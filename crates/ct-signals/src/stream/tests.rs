//! Lines with and without a header, with dates, with missing samples.

use super::*;

fn rows(first: &str) -> (Rows, bool) {
    Rows::begin("input", 1, first, &Columns::default()).unwrap()
}

fn read(rows: &mut Rows, line: &str) -> Result<Line, String> {
    rows.read(line.as_bytes()).map_err(|bad| bad.to_string())
}

#[test]
fn a_header_says_the_order_and_the_units() {
    let (mut rows, row) = rows("\u{feff}y [cm];u [V];t [min];note\r\n");
    assert!(!row);
    assert!(rows.units().eq(["V", "cm"]));
    assert_eq!(
        read(&mut rows, "12,5; 4 ;0,5;\"a; b\"\r\n"),
        Ok(Line::Row([30.0, 4.0]))
    );
    assert_eq!(rows.outputs(), [Ok(12.5)]);
    assert_eq!(
        read(&mut rows, "y [cm];u [V];t [min];note"),
        Ok(Line::Nothing)
    );
    assert_eq!(read(&mut rows, "# a comment"), Ok(Line::Nothing));
    // The command of a row is used whatever the reading is.
    assert_eq!(read(&mut rows, "12.5;4;1;"), Ok(Line::Row([60.0, 4.0])));
    let bad = rows.outputs()[0].clone().unwrap_err();
    assert!(
        bad.to_string()
            .contains("\"12.5\" has another decimal mark"),
        "{bad}"
    );
    let message = read(&mut rows, "12,5;4").unwrap_err();
    assert!(
        message.starts_with("2 fields where 4 are read"),
        "{message}"
    );
}

#[test]
fn without_a_header_three_or_four_numbers_have_an_order() {
    let (mut four, row) = rows("0, 15, 4.5, 14.8");
    assert!(row);
    assert_eq!(
        read(&mut four, "0, 15, 4.5, 14.8"),
        Ok(Line::Row([0.0, 4.5]))
    );
    assert_eq!(four.outputs(), [Ok(14.8)]);
    let (mut three, _) = rows("0\t4\t14");
    assert_eq!(read(&mut three, "1\t5\t15"), Ok(Line::Row([1.0, 5.0])));
    assert_eq!(three.outputs(), [Ok(15.0)]);
    assert_eq!(read(&mut three, "1\t5\t"), Ok(Line::Row([1.0, 5.0])));
    let bad = three.outputs()[0].clone().unwrap_err();
    assert_eq!(
        bad.to_string(),
        "column \"output\": the cell is empty; check the program that writes the rows"
    );
    let message = read(&mut three, "1\t\t5").unwrap_err();
    assert_eq!(
        message,
        "column \"input\": the cell is empty; check the program that writes the rows"
    );
    let message = read(&mut three, "12:30\t5\t1").unwrap_err();
    assert!(message.contains("write it so throughout"), "{message}");
    let error = Rows::begin("input", 3, "1,2", &Columns::default()).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("input, row 3: 2 numbers and no header")
    );
    assert_eq!(three.read(&[0xff, 0xfe]), Err(BadLine::NotText));
}

#[test]
fn several_outputs_are_read_in_the_order_in_which_they_are_named() {
    let columns = Columns {
        outputs: vec!["upper [cm]".into(), "lower [cm]".into()],
        ..Columns::default()
    };
    let begin = |line: &str| Rows::begin("input", 1, line, &columns);
    let (mut rows, _) = begin("t,lower [mm],u [V],upper [cm]").unwrap();
    assert!(rows.units().eq(["V", "cm", "cm"]));
    assert_eq!(read(&mut rows, "1,100,4,12"), Ok(Line::Row([1.0, 4.0])));
    assert_eq!(rows.outputs(), [Ok(12.0), Ok(10.0)]);
    assert_eq!(rows.name("output", 1), "lower [mm]");
    // Each reading may be missing alone.
    assert_eq!(read(&mut rows, "2,,4,12"), Ok(Line::Row([2.0, 4.0])));
    assert_eq!(rows.outputs()[0], Ok(12.0));
    let bad = rows.outputs()[1].clone().unwrap_err();
    assert_eq!(
        bad.to_string(),
        "column \"lower [mm]\": the cell is empty; check the program that writes the rows"
    );

    let (mut rows, _) = begin("0,15,4.5,14.8,9.1").unwrap();
    assert_eq!(
        rows.order(),
        "no header: the columns are taken as time, reference, command, readings (t, r, u, y1, y2)"
    );
    read(&mut rows, "0,15,4.5,14.8,9.1").unwrap();
    assert_eq!(rows.outputs(), [Ok(14.8), Ok(9.1)]);
    let message = begin("0,4.5,14.8").unwrap_err().to_string();
    assert!(message.contains("3 numbers and no header"), "{message}");
    assert!(message.contains("t,u,y1,y2"), "{message}");
}

#[test]
fn rows_of_a_model_without_inputs_have_a_time_and_outputs() {
    let columns = Columns {
        without_inputs: true,
        ..Columns::default()
    };
    for (first, order) in [
        (
            "t,y [rad]",
            "a header: \"t\" is the time, \"y [rad]\" the reading",
        ),
        (
            "0,1.5",
            "no header: the columns are taken as time, reading (t, y)",
        ),
    ] {
        let (mut rows, is_row) = Rows::begin("input", 1, first, &columns).unwrap();
        assert_eq!(is_row, first == "0,1.5");
        assert_eq!(rows.order(), order);
        assert!(matches!(read(&mut rows, "1,2.5"), Ok(Line::Row([1.0, _]))));
        assert_eq!(rows.outputs(), [Ok(2.5)]);
        assert_eq!(rows.inputs().count(), 0);
        // The row is used although its reading is missing.
        assert!(matches!(read(&mut rows, "2,"), Ok(Line::Row([2.0, _]))));
        assert!(rows.outputs()[0].is_err());
    }
    let (mut rows, _) = Rows::begin("input", 1, "u,t,y", &columns).unwrap();
    read(&mut rows, "7,1,2.5").unwrap();
    assert_eq!(rows.outputs(), [Ok(2.5)]);
}

#[test]
fn times_may_be_dates_and_words_stand_for_missing_samples() {
    let columns = Columns {
        time_zone: Some("Europe/Berlin".into()),
        missing: vec!["-999".into()],
        ..Columns::default()
    };
    let (mut rows, _) = Rows::begin("input", 1, "t;u;y", &columns).unwrap();
    assert_eq!(rows.times(), None);
    // Across the hour that is skipped in spring.
    for (line, time, reading) in [
        ("29.03.2026 01:59:58,5;4;12,5", 0.0, Some(12.5)),
        ("29.03.2026 03:00:00;4;Bad", 1.5, None),
        ("29.03.2026 03:00:01;4;-999", 2.5, None),
    ] {
        assert_eq!(read(&mut rows, line), Ok(Line::Row([time, 4.0])), "{line}");
        assert_eq!(rows.outputs()[0].clone().ok(), reading, "{line}");
    }
    let message = read(&mut rows, "29.03.2026 02:30:00;4;12").unwrap_err();
    assert!(
        message.contains("does not exist in Europe/Berlin"),
        "{message}"
    );
    let message = read(&mut rows, "I/O Timeout;4;12").unwrap_err();
    assert!(message.contains("stands for a missing sample"), "{message}");
    let Some(RowTimes::Dates { calendar, civil }) = rows.times() else {
        panic!("{:?}", rows.times());
    };
    assert!(civil);
    assert_eq!(calendar.at(0.0), "2026-03-29 01:59:58.5");

    // Other rows of the same stream count from the same zero.
    let again = || Rows::begin("input", 9, "y;t;u", &columns).unwrap().0;
    let mut on = again();
    on.go_on(&rows);
    assert_eq!(
        read(&mut on, "1;29.03.2026 03:00:08;4"),
        Ok(Line::Row([9.5, 4.0]))
    );
    let mut restored = again();
    restored.count_from(&calendar, 9.5);
    assert_eq!(
        read(&mut restored, "1;29.03.2026 03:00:09;4"),
        Ok(Line::Row([10.5, 4.0]))
    );
    // The hour that occurs twice: the order of the rows decides.
    let october = 210.0 * 86_400.0;
    let mut second = again();
    second.count_from(&calendar, october + 3.0 * 3600.0);
    read(&mut second, "1;25.10.2026 02:30:00;4").unwrap();
    let mut first = again();
    first.count_from(&calendar, october - 7200.0);
    read(&mut first, "1;25.10.2026 02:30:00;4").unwrap();
    let time = |rows: &Rows| *rows.values[0].as_ref().unwrap();
    assert_eq!(time(&second) - time(&first), 3600.0);
}

#[test]
fn dates_need_no_header() {
    let (mut rows, row) = rows("2026-01-31T14:25:00+01:00,15,4.5,Bad");
    assert!(row);
    let line = "2026-01-31T14:26:00+01:00,15,4.5,12";
    read(&mut rows, "2026-01-31T14:25:00+01:00,15,4.5,Bad").unwrap();
    assert_eq!(read(&mut rows, line), Ok(Line::Row([60.0, 4.5])));
    let Some(RowTimes::Dates { calendar, civil }) = rows.times() else {
        panic!("{:?}", rows.times());
    };
    assert!(!civil);
    assert_eq!(calendar.rfc3339(60.0), "2026-01-31T14:26:00+01:00");
    let message = read(&mut rows, "12,15,4.5,12").unwrap_err();
    assert!(message.contains("write all times alike"), "{message}");

    let (mut clock, _) = super::tests::rows("23:59:59,4.5,12");
    read(&mut clock, "23:59:59,4.5,12").unwrap();
    assert_eq!(clock.times(), Some(RowTimes::TimesOfDay));
    assert_eq!(
        read(&mut clock, "00:00:01,4.5,12"),
        Ok(Line::Row([2.0, 4.5]))
    );
}

#[test]
fn the_end_of_a_date_is_no_header() {
    for end in ["5:00", ":02", "-29 10:00:02", "9T10:00:02Z", "00+01:00"] {
        let line = format!("{end},4.5,Bad");
        let (mut rows, row) = rows(&line);
        assert!(row, "{end}");
        assert!(matches!(
            rows.read(line.as_bytes()),
            Err(BadLine::Time { .. })
        ));
        assert_eq!(
            read(&mut rows, "2026-03-29 10:00:02,4,12"),
            Ok(Line::Row([0.0, 4.0]))
        );
    }
    for header in ["T1,y,u", "-,y,4.5"] {
        assert!(!matches!(
            Rows::begin("input", 1, header, &Columns::default()),
            Ok((_, true))
        ));
    }
}

/// A file has more cells to look at; of a stream the first one has to do, also where day and month are the same on this day.
#[test]
fn a_stream_does_not_wait_for_a_day_above_12() {
    for cell in ["03/04/2026 10:00", "04/04/2026 10:00"] {
        let line = format!("{cell},4,12");
        let (mut rows, _) = rows(&line);
        let message = read(&mut rows, &line).unwrap_err();
        assert!(
            message.contains("set time_format = \"%d/%m/%Y %H:%M\""),
            "{message}"
        );
        assert_eq!(rows.times(), None);
    }
    let (mut rows, _) = rows("31/03/2026 10:00,4,12");
    read(&mut rows, "31/03/2026 10:00,4,12").unwrap();
    assert_eq!(
        read(&mut rows, "01/04/2026 10:00,4,12"),
        Ok(Line::Row([86_400.0, 4.0]))
    );
}

#[test]
fn several_inputs_are_read_and_each_is_needed() {
    let columns = Columns {
        inputs: vec!["heater [%]".into(), "room [degC]".into()],
        outputs: vec!["block [degC]".into()],
        ..Columns::default()
    };
    let line = "t [h],room [degC],block [degC],heater [%]";
    let (mut rows, _) = Rows::begin("input", 1, line, &columns).unwrap();
    assert!(rows.units().eq(["%", "degC", "degC"]));
    assert_eq!(rows.name("input", 1), "room [degC]");
    assert_eq!(
        rows.order(),
        "a header: \"t [h]\" is the time, \"heater [%]\", \"room [degC]\" the inputs, \"block [degC]\" the reading"
    );
    assert_eq!(read(&mut rows, "1,21,,40"), Ok(Line::Row([3600.0, 40.0])));
    assert!(rows.inputs().eq([40.0, 21.0]));
    assert!(rows.outputs()[0].is_err());
    let bad = read(&mut rows, "2,,50,40").unwrap_err();
    assert_eq!(
        bad,
        "column \"room [degC]\": the cell is empty; check the program that writes the rows"
    );
}

/// The detection of the first line and its reading agree: otherwise the reader would start again and again.
#[test]
fn a_carriage_return_within_a_line_is_part_of_a_cell_for_both() {
    let line = "1,1,3\r2,1,3";
    assert!(Rows::begin("input", 1, line, &Columns::default()).is_err());
    let (mut rows, _) = rows("0,1,2");
    assert!(read(&mut rows, line).is_err());
}
