//! Files that are refused, each with its own message, and limits of what is read.

use ct_signals::{ColumnFault, Columns, Error, ReadError, ReadOptions, parse_csv, read_csv};
use std::path::Path;

use super::{HEADER, fault, missing, named, read, read_bytes, rows, says, text, with_line};

#[test]
fn no_such_file() {
    let error = read_csv(
        Path::new("nowhere/tank.csv"),
        &Columns::default(),
        &ReadOptions::default(),
    );
    let error = error.unwrap_err();
    assert!(matches!(error, Error::Read(ReadError::CannotOpen { .. })));
    says(&error, &["nowhere/tank.csv", "check the path"]);
}

#[test]
fn empty_file() {
    for text in ["", "\n\n", "\u{feff}", "# only a comment\n"] {
        let error = read(text).unwrap_err();
        assert!(
            matches!(error, Error::Read(ReadError::EmptyFile { .. })),
            "{text:?}: {error}"
        );
        says(&error, &["tank.csv", "empty"]);
    }
}

#[test]
fn not_text() {
    for bytes in [
        &b"PK\x03\x04rest"[..],
        b"\xff\xfet\x00\x00\x00,\x00",
        b"\xff\xfe\x00\xd8t\x00",
        b"t,u,y\n\x000,1,2\n",
        b"t,u [\xb0C],y\n\x01\x02",
        "t,u,Kühlung\n0,1,2 \u{b0}"
            .as_bytes()
            .strip_suffix(b"\xb0")
            .unwrap(),
        b"t,K\xc3\xbchlung,y\n0,1,\xb0\n",
    ] {
        let error = read_bytes(bytes, &Columns::default()).unwrap_err();
        assert!(
            matches!(error, Error::Read(ReadError::NotText { .. })),
            "{error}"
        );
        says(&error, &["export it as CSV"]);
    }
}

#[test]
fn no_header() {
    let plain = text(HEADER, &rows());
    let (_, data) = plain.split_once('\n').unwrap();
    let error = read(data).unwrap_err();
    assert!(matches!(
        error,
        Error::Read(ReadError::NoHeader { row: 1, .. })
    ));
}

#[test]
fn missing_column_lists_those_that_are_there_and_the_closest() {
    let text = text("t [s],pump [V],level [cm]", &rows());
    let columns = named("t [s]", "pump [V]", "leve [cm]");
    let error = read_bytes(text.as_bytes(), &columns).unwrap_err();
    assert!(missing(&error, "output"));
    says(
        &error,
        &[
            "tank.csv",
            "row 1",
            "\"leve [cm]\"",
            "\"t [s]\", \"pump [V]\", \"level [cm]\"",
            "did you mean \"level [cm]\"? Set `Columns::outputs`",
        ],
    );
    let error = read(&text).unwrap_err();
    assert!(missing(&error, "input"));
    says(&error, &["beginning with \"u\"", "`Columns::inputs`"]);
    assert!(!error.to_string().contains("did you mean"));
}

#[test]
fn ambiguous_column() {
    let error = read(&text("t,y1,y2", &rows())).unwrap_err();
    assert!(missing(&error, "input"));
    let mut wide = text("t,u", &[]);
    wide = wide.replace("t,u", "t,u,y1,y2");
    let error = read(&wide).unwrap_err();
    assert!(matches!(
        fault(&error),
        Some(ColumnFault::Ambiguous { role: "output", .. })
    ));
    says(&error, &["\"y1\", \"y2\"", "`Columns::outputs`"]);
    let error = read("t,u,y,y\n").unwrap_err();
    assert!(matches!(
        fault(&error),
        Some(ColumnFault::Ambiguous { role: "output", .. })
    ));
}

#[test]
fn one_column_for_two_roles() {
    let error = read_bytes(
        text(HEADER, &rows()).as_bytes(),
        &named("t [s]", "y", "y [cm]"),
    )
    .unwrap_err();
    assert!(matches!(fault(&error), Some(ColumnFault::Shared { .. })));
    says(&error, &["input", "output"]);
}

#[test]
fn unit_contradiction_names_both_units() {
    let text = text("t [s],u [V],y [bar]", &rows());
    let error = read_bytes(text.as_bytes(), &named("t [s]", "u [V]", "y [cm]")).unwrap_err();
    assert!(matches!(fault(&error), Some(ColumnFault::Unit { .. })));
    says(
        &error,
        &[
            "tank.csv",
            "row 1",
            "\"y [bar]\"",
            "says bar ",
            "says cm",
            "convert",
        ],
    );
    says(&error, &["the model's constants in bar"]);
    // Units of the time are converted, whatever the model's unit is.
    let record = read_bytes(text.as_bytes(), &named("t [ms]", "u [V]", "y")).unwrap();
    assert_eq!(record.sample_interval(), 2.0);
}

#[test]
fn unknown_unit_of_time() {
    let error = read(&text("t [fortnight],u,y", &rows())).unwrap_err();
    assert!(matches!(
        error,
        Error::Read(ReadError::UnknownTimeUnit { .. })
    ));
    says(&error, &["fortnight", "min"]);
}

#[test]
fn wrong_number_of_fields() {
    for (line, count) in [("8,3", 2), ("8,3,10,4", 4)] {
        let error = read(&with_line(6, line)).unwrap_err();
        assert!(
            matches!(error, Error::Read(ReadError::WrongFieldCount { row: 6, expected: 3, found, .. }) if found == count)
        );
        says(&error, &["tank.csv", "row 6", "comma"]);
    }
}

#[test]
fn bad_cells() {
    let error = read(&with_line(6, "8,,10")).unwrap_err();
    assert!(matches!(
        error,
        Error::Read(ReadError::EmptyCell { row: 6, .. })
    ));
    says(
        &error,
        &["tank.csv", "row 6", "\"u [V]\"", "empty", "fill it in"],
    );

    let error = read(&with_line(7, "10,3,failed")).unwrap_err();
    assert!(matches!(
        error,
        Error::Read(ReadError::TextInCell { row: 7, .. })
    ));
    says(
        &error,
        &[
            "tank.csv",
            "row 7",
            "\"y [cm]\"",
            "\"failed\"",
            "correct the cell",
        ],
    );

    let error = read(&with_line(2, "2024-01-01 12:00,3,10")).unwrap_err();
    says(
        &error,
        &[
            "row 3",
            "\"t [s]\"",
            "2024-01-01 12:00",
            "write all times alike",
        ],
    );

    for cell in ["NaN", "nan", "inf", "-Infinity", "1e999"] {
        let error = read(&with_line(41, &format!("78,3,{cell}"))).unwrap_err();
        assert!(
            matches!(error, Error::Read(ReadError::NotFinite { row: 41, .. })),
            "{cell}: {error}"
        );
        says(
            &error,
            &["tank.csv", "row 41", "\"y [cm]\"", cell, "finite"],
        );
    }
}

#[test]
fn rows_are_line_numbers_of_the_file() {
    for newline in ["\n", "\r\n"] {
        let text = with_line(6, "8,3,failed");
        let mut lines: Vec<&str> = text.lines().collect();
        lines.insert(1, "# comment");
        lines.insert(3, "");
        lines.insert(0, "");
        lines.insert(0, "# title");
        let text = lines.join(newline);
        let line = text
            .lines()
            .position(|line| line.contains("failed"))
            .unwrap()
            + 1;
        let error = read(&text).unwrap_err();
        says(&error, &[&format!("row {line},")]);
    }
}

#[test]
fn decimal_marks_may_not_be_mixed() {
    let text = text(HEADER, &rows())
        .replace(',', ";")
        .replace("10.", "10,");
    let error = read(&text).unwrap_err();
    assert!(matches!(
        error,
        Error::Read(ReadError::MixedDecimalMarks { .. })
    ));
    says(&error, &["decimal comma", "decimal point"]);
}

#[test]
fn a_nonsense_file_is_an_error_and_no_panic() {
    for text in [
        "t",
        "\"t,u,y\n0,1,2",
        ",,,\n,,,",
        "t;u,y\n0;1,2",
        "t,u,y\n\"0\",\"1\"x,2\n",
        "t\u{301},u,y\n0,1,2\n",
        "_,[],()\n1,2,3\n",
        "t [,u ],y )(\n1,2,3\n",
        "\r\r\r",
        "t,u,y\r0,1,2\r1,2,3",
    ] {
        assert!(read(text).is_err(), "{text:?}");
    }
}

#[test]
fn a_first_row_that_has_no_units() {
    let columns = named("Time", "Pump", "Level");
    let numbers = text("", &rows()).trim_start().replace(',', ";");
    let with = |units: &str| format!("Time;Pump;Level\n{units}{numbers}");
    assert!(read_bytes(with("").as_bytes(), &columns).is_ok());
    // One word among numbers, and a date, are no units.
    let error = read_bytes(with("s;1;2\n").as_bytes(), &columns).unwrap_err();
    assert!(
        matches!(error, Error::Read(ReadError::Timestamp { row: 2, .. })),
        "{error:?}"
    );
    let error = read_bytes(with("2026-01-01;1.2.3;-x\n").as_bytes(), &columns).unwrap_err();
    assert!(
        matches!(error, Error::Read(ReadError::TextInCell { row: 2, .. })),
        "{error:?}"
    );
}

fn refusal(content: &[u8]) -> String {
    let read = parse_csv(
        "a.csv",
        content,
        &Columns::default(),
        &ReadOptions::default(),
    );
    read.unwrap_err().to_string()
}

#[test]
fn a_line_and_the_number_of_columns_have_a_limit() {
    let commas = ",".repeat(1_000_000);
    assert_eq!(
        refusal(format!("t,u,y\r\n0,1,2\n{commas}\n").as_bytes()),
        "a.csv, row 3: the line has more than 65536 bytes; check what wrote the file, and end every row with a line feed"
    );
    // A cell in quotes may hold ends of lines.
    let header = "t,u,y".to_string() + &",\"a\n\"".repeat(20_000);
    assert!(refusal(header.as_bytes()).contains("20003 columns, and 4096 are the most"));
}

#[cfg(unix)]
#[test]
fn a_device_is_refused_before_it_is_read() {
    let read = read_csv(
        "/dev/zero".as_ref(),
        &Columns::default(),
        &ReadOptions::default(),
    );
    assert_eq!(
        read.unwrap_err().to_string(),
        "/dev/zero: it is a device; name a file or a pipe"
    );
}

#[test]
fn a_file_that_is_too_large_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    std::fs::write(&path, [b'a'; 101]).unwrap();
    assert_eq!(ct_signals::read_file(&path, 101).unwrap().len(), 101);
    let message = ct_signals::read_file(&path, 100).unwrap_err().to_string();
    assert!(
        message.ends_with(
            "more than 100 bytes, which is the most that is read; check that it is the right file"
        ),
        "{message}"
    );
}

#[test]
fn rows_of_a_file_whose_lines_end_at_carriage_returns_are_counted() {
    let message = refusal(b"t,u,y\r0,1,2\r1,x,2\r");
    assert!(
        message.starts_with("a.csv, row 3, column \"u\""),
        "{message}"
    );
}

#[test]
fn what_is_quoted_is_short_and_steers_nothing() {
    let long = "z".repeat(3000);
    let message =
        refusal(format!("t,u\u{202e} {long},y\n0,1,2\n1,abc\u{202e}{long},2\n").as_bytes());
    assert!(message.len() < 300, "{message}");
    assert!(
        !message.contains('\u{202e}') && message.contains("\\u{202e}"),
        "{message}"
    );
}
