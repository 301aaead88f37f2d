//! Files as historians, loggers and spreadsheets write them.

use ct_signals::{Columns, Error, ReadOptions, Reading, parse_csv};

fn columns(time: &str, input: &str, output: &str) -> Columns {
    Columns {
        time: Some(time.into()),
        inputs: vec![input.into()],
        outputs: vec![output.into()],
        ..Columns::default()
    }
}

fn read_with(text: &str, columns: &Columns, options: &ReadOptions) -> Result<Reading, Error> {
    parse_csv("plant.csv", text.as_bytes(), columns, options)
}

fn read(text: &str, columns: &Columns) -> Reading {
    read_with(text, columns, &ReadOptions::default()).unwrap()
}

#[track_caller]
fn refused(text: &str, columns: &Columns, options: &ReadOptions, words: &[&str]) {
    let message = read_with(text, columns, options).unwrap_err().to_string();
    assert!(!message.contains('\n'), "{message}");
    for word in words {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}

/// A plant with an interval of one minute: stamps, a valve and litres, in the format of a German historian.
fn historian(row: impl Fn(usize) -> Option<String>) -> String {
    let rows = (0..60).filter_map(|k| Some(row(k)? + "\n"));
    "Zeit;Ventil [%];Inhalt [l]\n".to_string() + &rows.collect::<String>()
}

fn stamp(k: usize) -> String {
    format!("2026-03-28T23:{:02}:00", k % 60)
}

#[test]
fn a_historians_export_is_read_and_said_in_one_line() {
    let text = historian(|k| {
        let level = match k {
            5 => "Bad".to_string(),
            6 => String::new(),
            7 => "I/O Timeout".to_string(),
            k => format!("{},5", 200 + k % 7),
        };
        let valve = if k == 30 {
            "null".into()
        } else {
            format!("{},0", 40 + k % 3)
        };
        (!(20..23).contains(&k)).then(|| format!("{};{valve};{level}", stamp(k)))
    });
    let Reading { record, summary } = read(&text, &columns("Zeit", "Ventil", "Inhalt"));
    assert_eq!((record.len(), summary.missing_rows), (57, 3));
    assert_eq!(record.time[..2], [0.0, 60.0]);
    assert_eq!(
        (record.inputs[0].missing(), record.outputs[0].missing()),
        (1, 3)
    );
    assert_eq!(record.outputs[0].unit, "l");
    assert_eq!(record.outputs[0].values[0], 200.5);
    assert!(!summary.is_plain());
    let said = summary.to_string();
    for words in [
        "plant.csv: 57 rows from 2026-03-28 23:00 to 2026-03-28 23:59 (UTC), every 60 s",
        "3 rows are missing",
        "1 sample of \"Ventil\" missing (1 \"null\"; 2 %)",
        "3 samples of \"Inhalt\" missing (1 \"Bad\", 1 empty, 1 \"I/O Timeout\"; 5 %)",
    ] {
        assert!(said.contains(words), "no {words:?} in: {said}");
    }
    assert!(!said.contains('\n'));
    let strict = ReadOptions {
        strict: true,
        ..ReadOptions::default()
    };
    let all = columns("Zeit", "Ventil", "Inhalt");
    refused(
        &text,
        &all,
        &strict,
        &[
            "plant.csv, row 7",
            "Inhalt",
            "\"Bad\"",
            "leave out `strict`",
        ],
    );
}

#[test]
fn a_zone_lets_clocks_be_set_back_and_forward() {
    // 2026-10-25 03:00 is 02:00 once more in Berlin.
    let text = "t,u,y\n".to_string()
        + &(0..48)
            .map(|k| {
                let minutes = 60 + 5 * k;
                let minutes = if minutes >= 180 {
                    minutes - 60
                } else {
                    minutes
                };
                format!(
                    "25.10.2026 {:02}:{:02},{},{}\n",
                    minutes / 60,
                    minutes % 60,
                    k % 5,
                    k % 7
                )
            })
            .collect::<String>();
    let mut columns = columns("t", "u", "y");
    refused(
        &text,
        &columns,
        &ReadOptions::default(),
        &["row 26", "time_zone = "],
    );
    columns.time_zone = Some("Europe/Berlin".into());
    let reading = read(&text, &columns);
    assert!(
        reading
            .record
            .time
            .windows(2)
            .all(|pair| pair[1] - pair[0] == 300.0)
    );
    assert!(reading.summary.is_plain());
    columns.time_zone = Some("Europe/Berlinn".into());
    refused(
        &text,
        &columns,
        &ReadOptions::default(),
        &["row 2", "\"t\"", "Europe/Berlinn"],
    );
}

#[test]
fn a_part_is_read_by_dates_and_by_numbers() {
    let dated = historian(|k| Some(format!("{};{};{}", stamp(k), k % 5, k % 7)));
    let options = ReadOptions {
        from: Some("2026-03-28 23:10".into()),
        to: Some("2026-03-28 23:39".into()),
        ..ReadOptions::default()
    };
    let all = columns("Zeit", "Ventil", "Inhalt");
    let Reading { record, summary } = read_with(&dated, &all, &options).unwrap();
    assert_eq!((record.len(), summary.outside), (30, 30));
    assert_eq!(record.time[0], 0.0);
    let calendar = record.calendar.unwrap();
    assert_eq!(calendar.at(60.0), "2026-03-28 23:11");
    assert!(
        summary
            .to_string()
            .contains("30 rows outside `from` and `to` left out")
    );

    let numbers = (0..100).map(|k| format!("{},{},{}\n", 0.5 * k as f64, k % 5, k % 7));
    let numbers = "t [min],u,y\n".to_string() + &numbers.collect::<String>();
    let part = |from: &str, to: &str| ReadOptions {
        from: Some(from.into()),
        to: Some(to.into()),
        ..ReadOptions::default()
    };
    let default = Columns::default();
    let reading = read_with(&numbers, &default, &part("10", "25")).unwrap();
    assert_eq!(reading.record.time.first(), Some(&600.0));
    assert_eq!(reading.record.len(), 31);
    refused(
        &numbers,
        &default,
        &part("2026-01-01", "25"),
        &["`from`", "number in their unit"],
    );
    refused(
        &numbers,
        &default,
        &part("30", "25"),
        &["`to`", "not after `from`"],
    );
    refused(
        &numbers,
        &default,
        &part("48", "60"),
        &["4 rows of data", "`from` and `to` leave out 96;"],
    );
    refused(
        &dated,
        &all,
        &part("yesterday", "2026-03-29"),
        &["`from` \"yesterday\""],
    );
}

#[test]
fn dates_with_an_offset_are_shown_and_limited_with_it() {
    let text = historian(|k| Some(format!("{}+01:00;{};{}", stamp(k), k % 5, k % 7)));
    let options = ReadOptions {
        from: Some("2026-03-28 23:30".into()),
        ..ReadOptions::default()
    };
    let reading = read_with(&text, &columns("Zeit", "Ventil", "Inhalt"), &options).unwrap();
    assert_eq!(reading.record.len(), 30);
    let said = reading.summary.to_string();
    assert!(
        said.contains("from 2026-03-28 23:30 to 2026-03-28 23:59 (+01:00)"),
        "{said}"
    );
}

#[test]
fn units_of_one_dimension_are_converted() {
    let rows = (0..40).map(|k| format!("{},{},{}\n", 2 * k, 10 + k % 5, 100 + k % 7));
    let text = "t [s],q [l/min],y [mm]\n".to_string() + &rows.collect::<String>();
    let Reading { record, summary } = read(&text, &columns("t", "q [m3/h]", "y [cm]"));
    assert!((record.inputs[0].values[0] - 0.6).abs() < 1e-12);
    assert_eq!(
        (record.outputs[0].values[0], record.outputs[0].unit.as_str()),
        (10.0, "cm")
    );
    let said = summary.to_string();
    assert!(
        said.contains("\"q\" converted from l/min to m3/h; \"y\" converted from mm to cm"),
        "{said}"
    );
    refused(
        &text,
        &columns("t", "q [V]", "y"),
        &ReadOptions::default(),
        &["l/min", "V"],
    );
}

#[test]
fn any_number_of_inputs_and_outputs_is_read() {
    let rows = (0..40).map(|k| {
        let slow = if k % 4 == 0 {
            format!("{k}")
        } else {
            String::new()
        };
        format!("{k},{},{},{},{slow}\n", k % 3, k % 5, k % 7)
    });
    let text = "t,u,d,a,b\n".to_string() + &rows.collect::<String>();
    let columns = Columns {
        inputs: vec!["u".into(), "d".into()],
        outputs: vec!["a".into(), "b".into()],
        ..Columns::default()
    };
    let Reading { record, .. } = read(&text, &columns);
    let names = |channels: &[ct_signals::Channel]| {
        channels
            .iter()
            .map(|channel| channel.name.clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(
        (names(&record.inputs), names(&record.outputs)),
        (vec!["u".into(), "d".into()], vec!["a".into(), "b".into()])
    );
    // An output at another rate is an output with missing samples.
    assert_eq!(record.outputs[1].missing(), 30);
    let twice = Columns {
        outputs: vec!["a".into(), "a".into()],
        ..columns
    };
    refused(
        &text,
        &twice,
        &ReadOptions::default(),
        &["\"a\"", "named twice as output"],
    );
}

#[test]
fn what_cannot_be_read_is_one_line_with_place_and_mend() {
    let options = ReadOptions::default();
    let all = columns("Zeit", "Ventil", "Inhalt");
    let missing = historian(|k| Some(format!("{};{};Bad", stamp(k), k % 5)));
    refused(
        &missing,
        &all,
        &options,
        &[
            "plant.csv, row 2",
            "Inhalt",
            "all 60 rows are missing",
            "\"Bad\"",
        ],
    );
    let word = historian(|k| {
        let level = if k == 9 {
            "voll".to_string()
        } else {
            format!("{}", k % 7)
        };
        Some(format!("{};{};{level}", stamp(k), k % 5))
    });
    refused(
        &word,
        &all,
        &options,
        &["row 11", "\"voll\"", "missing = [\"...\"]"],
    );
    let mut own = all.clone();
    own.missing = vec!["voll".into(), "6".into()];
    assert_eq!(read(&word, &own).record.outputs[0].missing(), 9);
    let backward = historian(|k| {
        Some(format!(
            "{};{};{}",
            stamp(if k == 30 { 10 } else { k }),
            k % 5,
            k % 7
        ))
    });
    refused(
        &backward,
        &all,
        &options,
        &["row 32", "2026-03-28 23:29", "2026-03-28 23:10"],
    );
    let other = historian(|k| {
        let time = if k == 12 {
            "28.03.2026 23:12".into()
        } else {
            stamp(k)
        };
        Some(format!("{time};{};{}", k % 5, k % 7))
    });
    refused(&other, &all, &options, &["row 14", "28.03.2026 23:12"]);
}
