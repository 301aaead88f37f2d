//! Reading records from files: what is understood, and what is refused with which words.

mod refused;
mod signals;
mod start;

use approx::assert_relative_eq;
use ct_signals::{ColumnFault, Columns, Error, ReadError, ReadOptions, Record, read_csv};

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

/// The fault of the columns, if the error is of this kind.
fn fault(error: &Error) -> Option<&ColumnFault> {
    match error {
        Error::Read(ReadError::Column { fault, .. }) => Some(fault),
        _ => None,
    }
}

/// Whether no column was found for this role.
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
fn a_first_line_may_name_the_delimiter() {
    let plain = read(&text("t;u;y", &rows()).replace(',', ";")).unwrap();
    let named = "sep=;\r\n".to_string() + &text("t;u;y", &rows()).replace(',', ";");
    assert_eq!(read(&named).unwrap(), plain);
    let bars = "\u{feff}sep=|\n".to_string() + &text("t|u|y", &rows()).replace(',', "|");
    assert_eq!(read(&bars).unwrap(), plain);
    // Lines are those of the file.
    let error = read(&named.replacen("\n0;", "\nx;", 1)).unwrap_err();
    says(&error, &["row 3"]);
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
    // Any serde format would do; here a file with one row is used.
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
