//! Where the table begins: encodings, lines above the header, and units below it.

use ct_signals::{Columns, Error, ReadError, ReadOptions, Reading, csv_header, parse_csv};

use super::{named, read_bytes, rows, says, text};

fn reading(bytes: &[u8], columns: &Columns) -> Reading {
    parse_csv("rig.csv", bytes, columns, &ReadOptions::default()).unwrap()
}

fn semicolons(header: &str) -> String {
    text(header, &rows()).replace(',', ";").replace('.', ",")
}

#[test]
fn files_of_other_encodings_are_read_and_the_summary_says_so() {
    let text = text("Zeit [s],Kühlung [%],T [°C]", &rows());
    let columns = named("Zeit", "Kühlung", "T [degC]");
    let plain = reading(text.as_bytes(), &columns);
    assert_eq!(plain.summary.encoding, None);
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(c).unwrap()).collect();
    let wide = |bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
        let marked = format!("\u{feff}{text}");
        marked.encode_utf16().flat_map(bytes).collect()
    };
    for (bytes, encoding) in [
        (latin, "Latin-1"),
        (wide(u16::to_le_bytes), "UTF-16"),
        (wide(u16::to_be_bytes), "UTF-16"),
    ] {
        let found = reading(&bytes, &columns);
        assert_eq!(found.record, plain.record);
        let said = found.summary.to_string();
        assert!(said.contains(&format!("; read as {encoding}")), "{said}");
        assert!(!found.summary.is_plain());
    }
}

#[test]
fn lines_above_the_header_are_left_out() {
    let columns = named("Time", "Pump", "Level");
    let plain = reading(text("Time,Pump,Level", &rows()).as_bytes(), &columns);
    assert_eq!(plain.summary.above_header, 0);
    let commas = text("Time,Pump,Level", &rows());
    let german = semicolons("Time;Pump;Level");
    for (text, above) in [
        (format!("Run 7, second day\n{commas}"), 1),
        (
            format!("Logger 12\nStart: 2026-01-05 10:00\n\n# a comment\n{commas}"),
            2,
        ),
        (
            format!("sep=;\nDevice;DAQ 4\nSerial;1234\nRate;0,5\n{german}"),
            3,
        ),
        // As spreadsheets pad them.
        (format!("Device,DAQ 4,\nChannels,2,\n,,\n{commas}"), 2),
        (
            format!("Date,2026-01-05,10:00:00,UTC\nComment, a, b, c, d\n{commas}"),
            2,
        ),
        (format!("Station\t4\n{}", commas.replace(',', "\t")), 1),
    ] {
        let found = reading(text.as_bytes(), &columns);
        assert_eq!(found.record, plain.record, "{text}");
        assert_eq!(found.summary.above_header, above, "{text}");
        let names = csv_header("rig.csv", text.as_bytes()).unwrap();
        let names: Vec<&str> = names.iter().map(|heading| heading.name.as_str()).collect();
        assert_eq!(names, ["Time", "Pump", "Level"]);
    }
    // The rows of messages are those of the file.
    let broken = format!("Run 7\nDay 2\n{commas}").replace("\n2,", "\nx,");
    let error = read_bytes(broken.as_bytes(), &columns).unwrap_err();
    says(&error, &["row 5", "\"x\""]);
    let two = reading(format!("Run 7\n\nDay 2\n{commas}").as_bytes(), &columns);
    let said = two.summary.to_string();
    assert!(
        said.contains("; the header is row 4, 2 rows above it left out"),
        "{said}"
    );
}

#[test]
fn a_row_in_which_samples_are_missing_is_neither_header_nor_units() {
    let names = |header: &str| -> Columns {
        let names: Vec<&str> = header.split(',').collect();
        named(names[0], names[1], names[2])
    };
    for (header, first) in [
        ("t [s],u [V],y [cm]", "-2,-,-"),
        ("t,u,y", "-1,-,-"),
        ("time,101,102", "-2,1,2\n-1,Bad,Bad"),
    ] {
        let text = text(header, &rows()).replacen('\n', &format!("\n{first}\n"), 1);
        let found = reading(text.as_bytes(), &names(header));
        assert_eq!(
            found.record.len(),
            rows().len() + first.lines().count(),
            "{text}"
        );
        assert_eq!(found.summary.above_header, 0);
        assert!(!found.summary.units_below_header);
    }
}

#[test]
fn a_row_of_units_below_the_header_gives_the_units() {
    let columns = named("Time", "Pump", "Level");
    let with = |units: &str| {
        let numbers = semicolons("");
        format!("Time;Pump;Level\n{units}\n{}", numbers.trim_start())
    };
    // Also with an empty row above it, and where the first samples are missing.
    for units in ["min;[V];cm", ";;\nmin;V;cm", "min;V;cm\n-1;-;-"] {
        let found = reading(with(units).as_bytes(), &columns);
        assert!(found.summary.units_below_header, "{units}");
        let rows_before = usize::from(units.contains("-1"));
        assert_eq!(found.record.time[rows_before..][..2], [0.0, 120.0]);
        assert_eq!(found.record.inputs[0].unit, "V");
        assert_eq!(found.record.outputs[0].unit, "cm");
        assert_eq!(found.record.len(), rows().len() + rows_before);
    }
    // What stands in the header's brackets and is no unit is a part of the name; two different units are refused.
    let header = |text: String, header: &str| text.replace("Time;Pump;Level", header);
    let inlet = named("Time", "Pump_A", "Level (inlet)");
    let text = header(with("s;V;cm"), "Time [s];Pump_A;Level (inlet)");
    let found = reading(text.as_bytes(), &inlet);
    assert_eq!(found.record.inputs[0].unit, "V");
    assert_eq!(found.record.outputs[0].unit, "cm");
    let two = header(with("s;V;cm"), "Time;Pump;Level [mm]");
    let error = read_bytes(two.as_bytes(), &columns).unwrap_err();
    says(&error, &["row 2", "\"Level [mm]\"", "says cm", "delete"]);
    let names = csv_header("rig.csv", with("min;V;-").as_bytes()).unwrap();
    assert_eq!(names[0].unit, "min");
    // What is no unit is asked for.
    let error = read_bytes(with("s;counts;cm").as_bytes(), &columns).unwrap_err();
    assert!(
        matches!(error, Error::Read(ReadError::UnitRow { row: 2, .. })),
        "{error:?}"
    );
    says(&error, &["write them into the header, \"Time [s]\""]);
}

#[test]
fn a_table_with_a_fault_keeps_its_first_row_as_the_header() {
    let columns = named("t", "u", "y");
    // A header in the middle does not make the rows above it a preamble.
    let table = text("t,u,y", &rows());
    let long = table.replace("\n2,", ",\n2,");
    for text in [
        format!("{long}\nt,u,y\n100,1,2\n"),
        table.replace('\n', ",\n").replacen(",\n", "\n", 1),
    ] {
        let error = read_bytes(text.as_bytes(), &columns).unwrap_err();
        says(&error, &["row 2", "the header has 3"]);
    }
}

#[test]
fn days_of_a_spreadsheet_without_a_unit_are_noticed() {
    let columns = named("Date", "u", "y");
    let days: Vec<[f64; 3]> = rows()
        .iter()
        .map(|[t, u, y]| [45_260.0 + (t / 86_400.0 * 1e5).round() / 1e5, *u, *y])
        .collect();
    let without = reading(text("Date,u,y", &days).as_bytes(), &columns);
    assert!(without.summary.looks_like_days);
    let with = reading(text("Date [d],u,y", &days).as_bytes(), &columns);
    assert!(!with.summary.looks_like_days);
    assert!((with.summary.interval - 2.0).abs() < 0.45);
}
