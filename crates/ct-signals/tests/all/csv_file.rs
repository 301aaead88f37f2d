//! Reading records from files: what is understood, and what is refused with which words.

use std::path::Path;

use approx::assert_relative_eq;
use ct_signals::{
    ColumnFault, Columns, Error, ReadOptions, Record, parse_csv, read_csv, require_samples,
};

/// 40 rows of a plausible experiment: time step 2, input and output moving.
fn rows() -> Vec<[f64; 3]> {
    (0..40)
        .map(|k| {
            let k = f64::from(k);
            [2.0 * k, 3.0 + (0.7 * k).sin(), 10.0 + (0.3 * k).cos()]
        })
        .collect()
}

fn text(header: &str, rows: &[[f64; 3]]) -> String {
    let mut text = format!("{header}\n");
    for [t, u, y] in rows {
        text += &format!("{t},{u},{y}\n");
    }
    text
}

const HEADER: &str = "t [s],u [V],y [cm]";

fn read_bytes(bytes: &[u8], columns: &Columns) -> Result<Record, Error> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("tank.csv");
    std::fs::write(&path, bytes).unwrap();
    let strict = ReadOptions {
        strict: true,
        ..ReadOptions::default()
    };
    let result = read_csv(&path, columns, &strict).map(|reading| reading.record);
    assert_eq!(std::fs::read(&path).unwrap(), bytes, "the file was changed");
    result
}

fn read(text: &str) -> Result<Record, Error> {
    read_bytes(text.as_bytes(), &Columns::default())
}

fn named(time: &str, input: &str, output: &str) -> Columns {
    Columns {
        time: Some(time.into()),
        inputs: vec![input.into()],
        outputs: vec![output.into()],
        ..Columns::default()
    }
}

/// The message, which has to be one line and to contain each of the words.
#[track_caller]
fn says(error: &Error, words: &[&str]) {
    let message = error.to_string();
    assert!(!message.contains('\n'), "more than one line: {message}");
    for word in words {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}

/// What is wrong with the columns, where that is the error.
fn fault(error: &Error) -> Option<&ColumnFault> {
    match error {
        Error::Column { fault, .. } => Some(fault),
        _ => None,
    }
}

/// No column was found for this role.
fn missing(error: &Error, of: &str) -> bool {
    matches!(fault(error), Some(ColumnFault::Missing { role, .. }) if *role == of)
}

/// The plain file with one line (by its number in the file) replaced.
fn with_line(number: usize, line: &str) -> String {
    let plain = text(HEADER, &rows());
    let mut lines: Vec<&str> = plain.lines().collect();
    lines[number - 1] = line;
    lines.join("\n")
}

// What is understood.

#[test]
fn plain_file() {
    let record = read(&text(HEADER, &rows())).unwrap();
    assert_eq!(record.name, "tank.csv");
    assert_eq!(record.len(), 40);
    assert_eq!(
        (
            record.inputs[0].name.as_str(),
            record.inputs[0].unit.as_str()
        ),
        ("u", "V")
    );
    assert_eq!(
        (
            record.outputs[0].name.as_str(),
            record.outputs[0].unit.as_str()
        ),
        ("y", "cm")
    );
    assert_eq!(record.references, []);
    assert_eq!(record.sample_interval(), 2.0);
    assert_eq!(record.duration(), 78.0);
    for (k, row) in rows().into_iter().enumerate() {
        let [t, u, y] = [
            record.time[k],
            record.inputs[0].values[k],
            record.outputs[0].values[k],
        ];
        assert_eq!([t, u, y], row);
    }
    record.validate().unwrap();
}

#[test]
fn byte_order_mark_crlf_comments_blank_lines_and_blanks_change_nothing() {
    let plain = text(HEADER, &rows());
    let mut lines: Vec<String> = plain.lines().map(|line| line.replace(',', " , ")).collect();
    lines.insert(0, "# recorded by hand".into());
    lines.insert(5, String::new());
    lines.insert(9, "# a coffee break".into());
    lines.push("   ".into());
    lines.push(" , , ".into());
    let text = format!("\u{feff}{}\r\n", lines.join("\r\n"));
    assert_eq!(read(&text).unwrap(), read(&plain).unwrap());
}

#[test]
fn semicolons_tabs_and_decimal_commas() {
    let plain = text(HEADER, &rows());
    let expected = read(&plain).unwrap();
    assert_eq!(read(&plain.replace(',', ";")).unwrap(), expected);
    assert_eq!(read(&plain.replace(',', "\t")).unwrap(), expected);
    let german = plain.replace(',', ";").replace('.', ",");
    assert_eq!(read(&german).unwrap(), expected);
}

#[test]
fn quoted_headers_and_cells() {
    let plain = text(HEADER, &rows());
    let quoted: Vec<String> = plain
        .lines()
        .map(|line| format!("\"{}\"", line.replace(',', "\",\"")))
        .collect();
    assert_eq!(read(&quoted.join("\n")).unwrap(), read(&plain).unwrap());
}

#[test]
fn names_and_units_are_printable_text() {
    let header = "t [s],\u{1b}[31mu\u{202e} [V],\u{1b}[2Jy [\u{7}cm]";
    let text = text(header, &rows());
    let columns = named("t [s]", "\u{1b}[31mu\u{202e}", "\u{1b}[2Jy");
    let record = read_bytes(text.as_bytes(), &columns).unwrap();
    assert_eq!(record.inputs[0].name, "\\u{1b}[31mu\\u{202e}");
    assert_eq!(record.outputs[0].name, "\\u{1b}[2Jy");
    assert_eq!(record.outputs[0].unit, "\\u{7}cm");
}

#[test]
fn units_as_suffixes() {
    let text = text("t_s,u_pump_V,y_level2_V", &rows());
    let guessed = read(&text).unwrap();
    assert_eq!(guessed.inputs[0].name, "u_pump");
    assert_eq!(guessed.inputs[0].unit, "V");
    assert_eq!(guessed.outputs[0].name, "y_level2");
    let columns = named("t_s", "u_pump", "y_level2 [V]");
    assert_eq!(read_bytes(text.as_bytes(), &columns).unwrap(), guessed);
    let columns = named("t_s", "u_pump_V", "y_level2_V");
    assert_eq!(read_bytes(text.as_bytes(), &columns).unwrap(), guessed);
}

#[test]
fn a_unit_may_be_missing_on_either_side() {
    let bare = text("t,u,y", &rows());
    let record = read_bytes(bare.as_bytes(), &named("t [s]", "u", "y [cm]")).unwrap();
    assert_eq!(record.outputs[0].unit, "cm");
    assert_eq!(record.inputs[0].unit, "");
    let full = text(HEADER, &rows());
    let record = read_bytes(full.as_bytes(), &named("t", "u", "y")).unwrap();
    assert_eq!(record.outputs[0].unit, "cm");
    let round = text("t (s),u (V),y (cm)", &rows());
    let record = read_bytes(round.as_bytes(), &named("t [s]", "u [V]", "y [cm]")).unwrap();
    assert_eq!(record.outputs[0].name, "y");
    assert_eq!(record.outputs[0].unit, "cm");
}

#[test]
fn time_is_converted_to_seconds() {
    for (unit, seconds) in [("ms", 1e-3), ("min", 60.0), ("h", 3600.0), ("sec", 1.0)] {
        let record = read(&text(&format!("t [{unit}],u [V],y [cm]"), &rows())).unwrap();
        assert_relative_eq!(
            record.sample_interval(),
            2.0 * seconds,
            max_relative = 1e-12
        );
        assert_relative_eq!(record.duration(), 78.0 * seconds, max_relative = 1e-12);
    }
}

#[test]
fn reference_is_optional_unless_named() {
    let with = text(HEADER, &rows())
        .lines()
        .enumerate()
        .map(|(k, line)| format!("{line},{}\n", if k == 0 { "r [cm]" } else { "10" }))
        .collect::<String>();
    let record = read(&with).unwrap();
    assert_eq!(record.references[0].values, vec![10.0; 40]);

    let columns = Columns {
        references: vec!["r [cm]".into()],
        ..Columns::default()
    };
    let error = read_bytes(text(HEADER, &rows()).as_bytes(), &columns).unwrap_err();
    assert!(missing(&error, "reference"));
}

#[test]
fn only_the_columns_in_use_are_read() {
    let text = text(HEADER, &rows())
        .lines()
        .enumerate()
        .map(|(k, line)| format!("{line},{}\n", if k == 0 { "note" } else { "n/a" }))
        .collect::<String>();
    assert_eq!(read(&text).unwrap().len(), 40);
}

#[test]
fn jitter_is_no_gap() {
    let mut rows = rows();
    for (k, row) in rows.iter_mut().enumerate() {
        row[0] += if k % 3 == 0 { 0.4 } else { -0.4 };
    }
    let record = read(&text(HEADER, &rows)).unwrap();
    assert_eq!(record.len(), 40);
}

#[test]
fn columns_of_a_model_file() {
    // Any format that serde knows will do; a file with one row is at hand.
    let parse = |text: &str| -> Result<Columns, csv::Error> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        reader.deserialize().next().unwrap()
    };
    let columns = parse("time,output\nt [s],y [cm]\n").unwrap();
    assert_eq!(columns.time.as_deref(), Some("t [s]"));
    assert_eq!(columns.outputs, ["y [cm]"]);
    assert!(columns.inputs.is_empty() && columns.references.is_empty());
    let misspelt = parse("time,outptu\nt,y\n").unwrap_err();
    assert!(misspelt.to_string().contains("outptu"), "{misspelt}");
}

// What is refused.

#[test]
fn no_such_file() {
    let error = read_csv(
        Path::new("nowhere/tank.csv"),
        &Columns::default(),
        &ReadOptions::default(),
    );
    let error = error.unwrap_err();
    assert!(matches!(error, Error::CannotOpen { .. }));
    says(&error, &["nowhere/tank.csv", "check the path"]);
}

#[test]
fn empty_file() {
    for text in ["", "\n\n", "\u{feff}", "# only a comment\n"] {
        let error = read(text).unwrap_err();
        assert!(
            matches!(error, Error::EmptyFile { .. }),
            "{text:?}: {error}"
        );
        says(&error, &["tank.csv", "empty"]);
    }
}

#[test]
fn not_text() {
    for bytes in [
        &b"PK\x03\x04rest"[..],
        b"\xff\xfet\x00,\x00",
        b"t,u,y\n\x000,1,2\n",
        b"t,u [\xb0C],y\n",
    ] {
        let error = read_bytes(bytes, &Columns::default()).unwrap_err();
        assert!(matches!(error, Error::NotText { .. }), "{error}");
        says(&error, &["export it as CSV"]);
    }
}

#[test]
fn no_header() {
    let plain = text(HEADER, &rows());
    let (_, data) = plain.split_once('\n').unwrap();
    let error = read(data).unwrap_err();
    assert!(matches!(error, Error::NoHeader { row: 1, .. }));
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
            "did you mean \"level [cm]\"? Set output = ",
        ],
    );
    let error = read(&text).unwrap_err();
    assert!(missing(&error, "input"));
    says(&error, &["beginning with \"u\"", "input = "]);
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
    says(&error, &["\"y1\", \"y2\"", "output = "]);
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
    // Units of the time are converted, whatever the model says.
    let record = read_bytes(text.as_bytes(), &named("t [ms]", "u [V]", "y")).unwrap();
    assert_eq!(record.sample_interval(), 2.0);
}

#[test]
fn unknown_unit_of_time() {
    let error = read(&text("t [fortnight],u,y", &rows())).unwrap_err();
    assert!(matches!(error, Error::UnknownTimeUnit { .. }));
    says(&error, &["fortnight", "min"]);
}

#[test]
fn wrong_number_of_fields() {
    for (line, count) in [("8,3", 2), ("8,3,10,4", 4)] {
        let error = read(&with_line(6, line)).unwrap_err();
        assert!(
            matches!(error, Error::WrongFieldCount { row: 6, expected: 3, found, .. } if found == count)
        );
        says(&error, &["tank.csv", "row 6", "comma"]);
    }
}

#[test]
fn bad_cells() {
    let error = read(&with_line(6, "8,,10")).unwrap_err();
    assert!(matches!(error, Error::EmptyCell { row: 6, .. }));
    says(
        &error,
        &["tank.csv", "row 6", "\"u [V]\"", "empty", "fill it in"],
    );

    let error = read(&with_line(7, "10,3,failed")).unwrap_err();
    assert!(matches!(error, Error::TextInCell { row: 7, .. }));
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
            matches!(error, Error::NotFinite { row: 41, .. }),
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
    assert!(matches!(error, Error::MixedDecimalMarks { .. }));
    says(&error, &["decimal comma", "decimal point"]);
}

#[test]
fn repeated_and_backward_time() {
    let error = read(&with_line(6, "6,3,10")).unwrap_err();
    assert!(matches!(error, Error::RepeatedTime { row: 6, .. }));
    says(
        &error,
        &["tank.csv", "row 6", "\"t [s]\"", "repeated", "remove"],
    );

    let error = read(&with_line(6, "5,3,10")).unwrap_err();
    assert!(matches!(error, Error::BackwardTime { row: 6, .. }));
    says(&error, &["from 6 to 5", "sort"]);
}

#[test]
fn one_missing_sample_is_a_gap() {
    let mut rows = rows();
    rows.remove(10);
    let error = read(&text(HEADER, &rows)).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Gap {
                row: 12,
                missing: 1,
                ..
            }
        ),
        "{error}"
    );
    says(
        &error,
        &[
            "row 12",
            "1 sample is missing",
            "from 18 to 22",
            "split the file there",
        ],
    );

    rows.drain(10..13);
    let error = read(&text(HEADER, &rows)).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Gap {
                row: 12,
                missing: 4,
                ..
            }
        ),
        "{error}"
    );
    says(&error, &["4 samples are missing", "leave out --strict"]);
}

/// Steps of 1 to 3 s are uneven, not full of gaps; 9 s among them are a gap.
#[test]
fn uneven_steps_are_no_gaps() {
    let mut rows = rows();
    let mut time = 0.0;
    for (k, row) in rows.iter_mut().enumerate() {
        row[0] = time;
        time += [1.0, 1.0, 2.0, 3.0][k % 4];
    }
    assert_eq!(read(&text(HEADER, &rows)).unwrap().len(), 40);
    for row in &mut rows[20..] {
        row[0] += 6.0;
    }
    let error = read(&text(HEADER, &rows)).unwrap_err();
    assert!(matches!(error, Error::Gap { row: 22, .. }), "{error}");
}

#[test]
fn a_missing_sample_is_found_in_jitter() {
    let mut rows = rows();
    for (k, row) in rows.iter_mut().enumerate() {
        row[0] += if k % 3 == 0 { 0.2 } else { -0.2 };
    }
    rows.remove(20);
    let error = read(&text(HEADER, &rows)).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Gap {
                row: 22,
                missing: 1,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn constant_signals() {
    let mut still = rows();
    still.iter_mut().for_each(|row| row[1] = 4.5);
    // An input that stands still is a matter of what the record is for.
    let record = read(&text(HEADER, &still)).unwrap();
    let error = record.require_moving_input().unwrap_err();
    assert!(matches!(error, Error::ConstantInput { rows: 40, .. }));
    says(&error, &["tank.csv", "\"u [V]\"", "4.5", "input"]);

    let mut still = rows();
    still.iter_mut().for_each(|row| row[2] = 0.0);
    let error = read(&text(HEADER, &still)).unwrap_err();
    assert!(matches!(error, Error::ConstantOutput { .. }));
}

#[test]
fn too_few_rows() {
    let error = read(&text(HEADER, &rows()[..19])).unwrap_err();
    assert!(matches!(
        error,
        Error::TooFewRows {
            rows: 19,
            needed: 20,
            ..
        }
    ));
    says(&error, &["tank.csv", "19 rows", "20 are needed"]);
    let record = read(&text(HEADER, &rows()[..20])).unwrap();
    require_samples(std::slice::from_ref(&record), 4).unwrap();
    let error = require_samples(&[record], 5).unwrap_err();
    says(
        &error,
        &["tank.csv", "20 rows", "25 are needed", "5 parameters"],
    );
}

#[test]
fn saturated_record() {
    // 14 of 40 at the limit is above a third, 13 is not.
    for (count, refused) in [(14, true), (13, false)] {
        for limit in [12.0, 0.0] {
            let mut rows = rows();
            rows[5..5 + count].iter_mut().for_each(|row| row[2] = limit);
            let result = read(&text(HEADER, &rows));
            assert_eq!(result.is_err(), refused, "{count} at {limit}");
            if let Err(error) = result {
                assert!(matches!(error, Error::Saturated { .. }), "{error}");
                says(
                    &error,
                    &[
                        "tank.csv",
                        "\"y [cm]\"",
                        &format!("14 at {limit} cm"),
                        "range",
                    ],
                );
            }
        }
    }
}

#[test]
fn a_coarsely_quantised_output_is_not_saturated() {
    let mut rows = rows();
    // Three levels, the highest of them with more than a third of the samples.
    rows.iter_mut()
        .for_each(|row| row[2] = (row[2] + 0.3).round());
    let highest = rows.iter().filter(|row| row[2] == 11.0).count();
    assert!(
        3 * highest > rows.len(),
        "{highest} samples at the highest level"
    );
    read(&text(HEADER, &rows)).unwrap();
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
fn a_row_of_units_below_the_header() {
    let columns = named("Time", "Pump", "Level");
    let numbers = text("", &rows()).trim_start().replace(',', ";");
    let with = |units: &str| format!("Time;Pump;Level\n{units}{numbers}");
    let error = read_bytes(with("s;V;cm\n").as_bytes(), &columns).unwrap_err();
    assert!(matches!(error, Error::UnitRow { row: 2, .. }), "{error:?}");
    says(&error, &["write them into the header, \"Time [s]\""]);
    assert!(read_bytes(with("").as_bytes(), &columns).is_ok());
    // One word among numbers, and a date, are no units.
    let error = read_bytes(with("s;1;2\n").as_bytes(), &columns).unwrap_err();
    assert!(
        matches!(error, Error::Timestamp { row: 2, .. }),
        "{error:?}"
    );
    let error = read_bytes(with("2026-01-01;1.2.3;-x\n").as_bytes(), &columns).unwrap_err();
    assert!(
        matches!(error, Error::TextInCell { row: 2, .. }),
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
