//! `ctid monitor` as a process: rows go in through a pipe.

mod bad_rows;
mod dates;
mod own;
mod process;

use std::io::Write;
use std::process::{Child, ChildStdin, Stdio};
use std::thread;

use serde_json::Value;

use crate::common::{INTERVAL, Outcome, Place, Random};

const MODEL: &str = "plant = \"single-tank\"\n[known]\narea = 154.0\n";

/// Rows t, u, y of a single tank; from row `leak` on it loses 2 cm^3/s more.
fn rows(count: usize, leak: usize) -> Vec<[f64; 3]> {
    let mut random = Random(7);
    let (mut level, mut u, mut until) = (16.0_f64, 5.0, 30);
    (0..count)
        .map(|k| {
            if k == until {
                u = ((3.5 + 3.0 * random.uniform()) * 100.0).round() / 100.0;
                until += 30 + random.below(60);
            }
            let row = [k as f64 * INTERVAL, u, level + 0.05 * random.normal()];
            let lost = if k < leak { 0.0 } else { 2.0 };
            let rate = |level: f64| (10.0 * u - 12.5 * level.sqrt() - lost) / 154.0;
            for _ in 0..20 {
                let h = INTERVAL / 20.0;
                level += h * rate(level + 0.5 * h * rate(level));
            }
            row
        })
        .collect()
}

fn text(header: &str, rows: &[[f64; 3]]) -> String {
    let lines = rows.iter().map(|[t, u, y]| format!("{t},15,{u},{y:.4}\n"));
    header.to_string() + &lines.collect::<String>()
}

const HEADER: &str = "t [s],r [cm],u [V],y [cm]\n";

fn place() -> Place {
    let place = Place::empty();
    place.write("m.toml", MODEL);
    place
}

/// Begins a monitor.
fn begun(place: &Place, words: &str) -> (Child, ChildStdin) {
    let mut child = place
        .command(&format!("monitor --model m.toml {words}"))
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    let input = child.stdin.take().unwrap();
    (child, input)
}

/// Runs a monitor on bytes.
fn fed(place: &Place, words: &str, bytes: impl AsRef<[u8]>) -> Outcome {
    let (child, mut input) = begun(place, words);
    let bytes = bytes.as_ref().to_vec();
    let writer = thread::spawn(move || {
        // The program may stop reading.
        let _ = input.write_all(&bytes);
    });
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    Outcome {
        code: output.status.code(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

/// Checks the output on standard error.
#[track_caller]
fn assert_says(outcome: &Outcome, said: &str) {
    assert!(outcome.err.contains(said), "{said}: {}", outcome.err);
}

fn events(out: &str) -> Vec<Value> {
    out.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

#[test]
fn an_alarm_is_a_json_line_and_a_sentence() {
    let place = place();
    let outcome = fed(&place, "--estimates", text(HEADER, &rows(2200, 1600)));
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    let events = events(&outcome.out);
    let alarm = events.iter().find(|e| e["event"] == "alarm").unwrap();
    assert_eq!(alarm["schema"], 1);
    let time = alarm["time"].as_f64().unwrap();
    assert!((3200.0..3500.0).contains(&time), "{alarm}");
    for key in ["since", "evidence", "score", "threshold"] {
        assert!(alarm[key].is_number(), "{alarm}");
    }
    for key in ["verdict", "sentence"] {
        assert!(alarm[key].is_string(), "{alarm}");
    }
    assert!(!alarm["effects"].as_array().unwrap().is_empty(), "{alarm}");
    let sentence = alarm["sentence"].as_str().unwrap();
    assert!(sentence.starts_with("Consistent with ") && outcome.err.contains(sentence));
    let estimates = events.iter().find(|e| e["event"] == "estimates").unwrap();
    let gain = &estimates["parameters"][0];
    assert_eq!(gain["name"], "pump_gain");
    assert!((gain["value"].as_f64().unwrap() - 10.0).abs() < 0.5);
    let first = outcome.err.lines().next().unwrap();
    assert!(first.contains("\"t [s]\" is the time"), "{first}");
    assert_says(&outcome, "learned from 10");
    // Without a terminal there are no escape codes.
    assert!(!outcome.err.contains('\u{1b}'));
}

/// However the rows are written, the same comes out.
#[test]
fn the_ways_to_write_rows_are_those_of_the_csv_reader() {
    let rows = rows(1400, 1100);
    let place = place();
    let plain = fed(&place, "", text(HEADER, &rows));
    assert!(!plain.out.is_empty(), "{}", plain.err);
    let lines = text("", &rows);
    let semicolons = lines.replace(',', ";").replace('.', ",");
    for (what, other) in [
        (
            "CRLF and a byte-order mark",
            format!("\u{feff}{}", text(HEADER, &rows).replace('\n', "\r\n")),
        ),
        ("decimal commas", HEADER.replace(',', ";") + &semicolons),
        (
            "tabs, quotes, comments, blank lines",
            HEADER.replace(',', "\t")
                + "# rig 3\n\n"
                + &lines.replace(",15,", "\t\"15\"\t").replace(',', "\t"),
        ),
        (
            "a delimiter key, lines above the header and a row of units, as loggers and spreadsheets write them",
            "sep=;\nTest;Tank 3;;\nRate;0,5\n;;;\n\nt;r;u;y\ns;cm;V;cm\n".to_string() + &semicolons,
        ),
        (
            "the header again",
            text(HEADER, &rows[..700]) + &text(HEADER, &rows[700..]),
        ),
    ] {
        let outcome = fed(&place, "", other);
        assert_eq!(outcome.code, Some(0), "{what}: {}", outcome.err);
        assert_eq!(outcome.out, plain.out, "{what}: {}", outcome.err);
    }
    let lone = fed(&place, "", &lines);
    assert!(lone.err.starts_with("standard input: no header: the columns are taken as time, reference, command, reading (t, r, u, y)"), "{}", lone.err);
    let three = fed(&place, "", lines.replace(",15,", ","));
    assert!(
        three.err.starts_with(
            "standard input: no header: the columns are taken as time, command, reading (t, u, y)"
        ),
        "{}",
        three.err
    );
    assert_eq!(three.out, lone.out);
    assert_eq!(events(&lone.out).len(), events(&plain.out).len());
}

/// A row of units below the header is applied, also where header and units come again, and after a restart.
#[test]
fn a_row_of_units_is_applied() {
    let rows = rows(1400, 1100);
    let place = place();
    let model = place.read("m.toml") + "\n[columns]\noutput = \"y [cm]\"\n";
    place.write("m.toml", model);
    let plain = fed(&place, "", text(HEADER, &rows));
    // Several effects explain it alike, so that rounding decides which is first.
    let alarms = |out: &str| -> Vec<(serde_json::Value, serde_json::Value)> {
        let events = events(out);
        let alarm = |e: &serde_json::Value| (e["event"].clone(), e["time"].clone());
        events.iter().map(alarm).collect()
    };
    assert!(!plain.out.is_empty(), "{}", plain.err);
    let millimetres = |header: &str, rows: &[[f64; 3]]| {
        let rows = rows
            .iter()
            .map(|[t, u, y]| format!("{t},15,{u},{:.3}\n", 10.0 * y));
        header.to_string() + &rows.collect::<String>()
    };
    let header = "t,r,u,y\ns,cm,V,mm\n";
    let again = millimetres(header, &rows[..700]) + &millimetres(header, &rows[700..]);
    let outcome = fed(&place, "", again);
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    assert_eq!(alarms(&outcome.out), alarms(&plain.out), "{}", outcome.err);
    assert!(!outcome.err.contains("skipped"), "{}", outcome.err);
    assert_eq!(
        outcome.err.matches("a header:").count(),
        1,
        "{}",
        outcome.err
    );

    fed(&place, "--state a.state", millimetres(header, &rows[..700]));
    let outcome = fed(&place, "--state a.state", millimetres(header, &rows[700..]));
    assert_says(&outcome, "goes on from 700 rows");
    assert_eq!(alarms(&outcome.out), alarms(&plain.out), "{}", outcome.err);
}

/// A logger that restarts with another order of its columns does not exchange signals.
#[test]
fn a_header_that_comes_again_in_another_order_is_followed() {
    let rows = rows(1400, 1100);
    let place = place();
    let plain = fed(&place, "", text(HEADER, &rows));
    let mut swapped = text(HEADER, &rows[..700]) + "y [cm];note;u;t [s]\n";
    for [t, u, y] in &rows[700..] {
        swapped += &format!("{y:.4};-;{u};{t}\n");
    }
    let outcome = fed(&place, "", &swapped);
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    assert_eq!(outcome.out, plain.out, "{}", outcome.err);
    let said = "row 702: another header follows in a different form, and the rows after it are read accordingly: a header: \"t [s]\" is the time, \"u\" the command, \"y [cm]\" the reading";
    assert_says(&outcome, said);

    let other_unit =
        text(HEADER, &rows[..700]) + &text("t [s],r [mm],u [V],y [mm]\n", &rows[700..]);
    let outcome = fed(&place, "", other_unit);
    assert_eq!(outcome.code, Some(2), "{}", outcome.err);
    let said = "row 702: the header is repeated with [mm] instead of [cm]";
    assert_says(&outcome, said);
}

/// A cable comes loose, and is repaired.
#[test]
fn a_scatter_that_grows_is_a_json_line_of_its_own() {
    let mut rows = rows(2600, 9999);
    let mut random = Random(8);
    for row in &mut rows[1200..1500] {
        row[2] += 0.2 * random.normal();
    }
    let place = place();
    let outcome = fed(&place, "", text(HEADER, &rows));
    let events = events(&outcome.out);
    let names: Vec<&str> = events
        .iter()
        .map(|e| e["event"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["scatter_grown", "scatter_back"], "{}", outcome.err);
    for event in &events {
        assert_eq!(event["schema"], 1);
        assert!(outcome.err.contains(event["sentence"].as_str().unwrap()));
    }
    let time = events[0]["time"].as_f64().unwrap();
    assert!((2400.0..2700.0).contains(&time), "{}", events[0]);
    let [learned, now] = ["learned", "now"].map(|key| events[0][key].as_f64().unwrap());
    assert!(
        (learned - 0.05).abs() < 0.01 && now > 3.0 * learned,
        "{}",
        events[0]
    );
    assert_eq!(events[0]["unit"], "cm");
}

/// Without a message, the user would assume that no alarm occurred.
#[test]
fn rows_that_end_before_anything_is_learned() {
    let place = place();
    let outcome = fed(&place, "", text(HEADER, &rows(900, 9999)));
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    assert_says(&outcome, "learning the plant from the first rows\n");
    assert_says(
        &outcome,
        "still learning, nothing has been watched: 900 rows over 1798 s; it needs at least 1000 rows and 20 of the plant's slowest time constants\n",
    );
    // A first fit has told how long the time constants are.
    let outcome = fed(&place, "--learn 100", text(HEADER, &rows(110, 9999)));
    assert_says(
        &outcome,
        "still learning, nothing has been watched: 110 rows",
    );
    assert_says(&outcome, " s (20 time constants)\n");
    let learned = fed(&place, "", text(HEADER, &rows(2200, 9999)));
    assert!(!learned.err.contains("still learning"), "{}", learned.err);
}

/// `tail -f` begins in the middle of the file.
#[test]
fn names_without_a_header_are_refused() {
    let place = place();
    let lines = text("", &rows(10, 9999));
    let outcome = fed(&place, "", &lines);
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    let hint = "begin with the header: tail -n +1 -f FILE";
    assert_says(&outcome, hint);
    place.write(
        "m.toml",
        MODEL.to_string() + "[columns]\ninput = \"u [V]\"\n",
    );
    let outcome = fed(&place, "", &lines);
    assert_eq!(outcome.code, Some(2), "{}", outcome.err);
    assert_says(&outcome, "row 1: no header, and [columns] of m.toml");
    assert_says(&outcome, hint);
    let outcome = fed(&place, "", HEADER.to_string() + &lines);
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    assert!(!outcome.err.contains(hint), "{}", outcome.err);
}
