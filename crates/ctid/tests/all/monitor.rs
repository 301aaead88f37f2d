//! `ctid monitor` from outside: rows go in through a pipe.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Stdio};
use std::thread;
use std::time::Duration;

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
        // It may stop reading.
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

/// What it says on standard error.
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
    // Without a terminal nothing steers one.
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

/// A logger that begins anew with its columns in another order swaps nothing.
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
    let said = "row 702: the header comes again in another form, and the rows behind it are read as it says: a header: \"t [s]\" is the time, \"u\" the command, \"y [cm]\" the reading";
    assert_says(&outcome, said);

    let other_unit =
        text(HEADER, &rows[..700]) + &text("t [s],r [mm],u [V],y [mm]\n", &rows[700..]);
    let outcome = fed(&place, "", other_unit);
    assert_eq!(outcome.code, Some(2), "{}", outcome.err);
    let said = "row 702: the header comes again with [mm] where it was [cm]";
    assert_says(&outcome, said);
}

/// A cable comes loose, and is mended.
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

#[test]
fn a_reading_far_above_the_tank_is_refused() {
    let place = place();
    place.write("m.toml", MODEL.to_string() + "tank_height = 60.0\n");
    let clean = text(HEADER, &rows(1100, 9999));
    let bad = clean.replacen("\n2,", "\n1,15,5,160\n2,", 1);
    assert_ne!(clean, bad);
    let outcome = fed(&place, "", bad);
    let said =
        "row 3: column \"y [cm]\": 160 is far above the tank, tank_height = 60; check the sensor";
    assert_says(&outcome, said);
}

#[test]
fn bad_rows_are_said_skipped_and_not_flooded_with() {
    let rows = rows(1400, 1100);
    let clean = text(HEADER, &rows);
    let mut bad = String::new();
    for (k, line) in clean.lines().enumerate() {
        bad += line;
        bad += "\n";
        match k {
            100 => bad += "text,15,5,16\n",
            101 => bad += "203,15,,16\n",
            102 => bad += "1,15,5,16\n",
            1200..1300 => bad += "2403,15\n",
            _ => {}
        }
    }
    let place = place();
    let outcome = fed(&place, "", &bad);
    assert_eq!(outcome.code, Some(0));
    assert_eq!(outcome.out, fed(&place, "", &clean).out);
    for said in [
        "standard input, row 102: column \"t [s]\": \"text\" is not a number",
        "standard input, row 104: column \"u [V]\": the cell is empty",
        "standard input, row 106: column \"t [s]\": the time goes back from 202 s to 1 s",
        "2 fields where 4 are read",
        "; the row is skipped",
    ] {
        assert_says(&outcome, said);
    }
    assert!(outcome.err.lines().count() < 40, "{}", outcome.err);
    assert_says(&outcome, "103 of them with something wrong");
}

/// Who listens to a running line hears the end of a row first.
/// Empty, no number, not finite, or a word: the rows' commands count, and the tank is followed.
#[test]
fn a_row_without_a_reading_is_said_and_its_command_used() {
    let rows = rows(2000, 9999);
    let words = ["", "NaN", "missing", "-", "inf"];
    let mut lines = HEADER.to_string();
    let mut lost = 0;
    for k in 0..rows.len() {
        let [t, u, y] = rows[k];
        if k > 0 && u != rows[k - 1][1] {
            lines += &format!("{t},15,{u},{}\n", words[lost % words.len()]);
            lost += 1;
        } else {
            lines += &format!("{t},15,{u},{y:.4}\n");
        }
    }
    let outcome = fed(&place(), "", &lines);
    assert_eq!((outcome.code, outcome.out.as_str()), (Some(0), ""));
    assert_says(
        &outcome,
        "column \"y [cm]\": the cell is empty; check what writes the rows; the reading is lost, the command of the row is used",
    );
    assert_says(
        &outcome,
        "column \"y [cm]\": \"NaN\" stands for a missing sample; the reading is lost",
    );
    assert_says(
        &outcome,
        "column \"y [cm]\": \"missing\" stands for a missing sample; the reading is lost",
    );
    assert_says(&outcome, &format!("{lost} of them with something wrong"));
}

/// Each of the first digits of the state's numbers, changed to another: the file is JSON still, and its numbers are others.
#[test]
fn a_state_in_which_a_digit_has_changed_is_refused() {
    let place = place();
    let text = text(HEADER, &rows(1500, 9999));
    assert_eq!(fed(&place, "--state s.json", &text).code, Some(0));
    let state = place.read("s.json");
    let from = state.find("\"kept\"").unwrap();
    let digits: Vec<usize> = state[from..]
        .char_indices()
        .filter(|(_, c)| c.is_ascii_digit())
        .map(|(at, _)| from + at)
        .step_by(state.len() / 8)
        .collect();
    assert!(!digits.is_empty());
    for at in digits {
        let mut spoilt = state.clone();
        let other = if &state[at..=at] == "7" { "8" } else { "7" };
        spoilt.replace_range(at..=at, other);
        place.write("s.json", spoilt);
        let outcome = fed(&place, "--state s.json", &text);
        assert_eq!(outcome.code, Some(2));
        assert_says(
            &outcome,
            "s.json: it is damaged: its numbers do not agree with its checksum; give --state another name, or delete the file to begin anew",
        );
    }
}

#[test]
fn a_line_ends_at_a_carriage_return_as_in_a_file() {
    let outcome = fed(&place(), "", "0,1,2\n1,1,3\r2,1,3\n");
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    assert_says(&outcome, "the rows have ended after 3 lines");
}

#[test]
fn a_header_that_comes_again_in_other_units_than_the_model_names_ends_it() {
    let place = place();
    place.write(
        "m.toml",
        format!("{MODEL}[columns]\ntime = \"t [s]\"\ninput = \"u [V]\"\noutput = \"y [cm]\"\n"),
    );
    for header in [
        "t [s],r [cm],u [V],y [bar]",
        "t [parsec],r [cm],u [V],y [cm]",
    ] {
        let outcome = fed(
            &place,
            "",
            format!("{HEADER}0,15,5,16\n1,15,5,16\n{header}\n2,15,5,160\n"),
        );
        assert_eq!(outcome.code, Some(2), "{}", outcome.err);
        assert_says(&outcome, "standard input, row 4, column");
    }
}

#[test]
fn a_stream_may_begin_in_the_middle_of_a_row() {
    let place = place();
    let lines = text("", &rows(1100, 9999));
    for part in ["5,4.5,14.8\n", ".5,14.8\n", "8\n"] {
        let outcome = fed(&place, "", part.to_string() + &lines);
        assert_eq!(outcome.code, Some(0), "{}", outcome.err);
        assert_says(&outcome, "t, r, u, y");
        assert_says(&outcome, "learned from");
        assert_says(&outcome, "1 of them with something wrong");
    }
}

#[test]
fn a_gap_is_said_with_its_row() {
    let mut rows = rows(1500, 9999);
    rows.drain(1200..1203);
    let outcome = fed(&place(), "", text(HEADER, &rows));
    let said = "standard input, row 1202, column \"t [s]\": 3 rows are missing (the time steps from 2398 to 2406 s)";
    assert_says(&outcome, said);
    assert_eq!(outcome.out, "");
}

#[test]
fn what_is_no_row_at_all_is_refused() {
    let place = place();
    let refused = |bytes: &str, says: &str| {
        let outcome = fed(&place, "", bytes);
        assert_eq!(outcome.code, Some(2), "{}", outcome.err);
        assert!(
            outcome.err.contains("error: ") && outcome.err.contains(says),
            "{}",
            outcome.err
        );
        assert_eq!(outcome.out, "");
    };
    refused(
        "",
        "standard input is empty; rows such as 0,15,4.5,14.8 (t, r, u, y) are needed",
    );
    refused("\n# nothing\n\n", "standard input is empty");
    refused("1,2\n1,2\n1,2\n", "2 numbers and no header");
    refused(
        "time,level\n1,2\n",
        "no column beginning with \"u\" for the input",
    );
    place.write("m.toml", MODEL.replace("single-tank", "single-tonk"));
    refused("0,1,2,3\n", "unknown plant");
    place.write(
        "m.toml",
        "plant = \"single-tank\"\neffects = [\"sensor_drift\"]\n",
    );
    refused("0,1,2,3\n", "ctid remove sensor_drift --model m.toml");
}

#[test]
fn a_state_goes_on_where_it_was() {
    let rows = rows(2200, 1600);
    let place = place();
    let whole = fed(&place, "", text(HEADER, &rows));
    let mut parts = String::new();
    for (from, to) in [(0, 500), (500, 1300), (1300, 1640), (1640, 2200)] {
        // The log is given from a little before where it ended: what was seen is skipped.
        let again = if from == 1300 { 1290 } else { from };
        let outcome = fed(&place, "--state s.json", text(HEADER, &rows[again..to]));
        assert_eq!(outcome.code, Some(0), "{}", outcome.err);
        assert_eq!(
            outcome.err.contains("goes on from"),
            from > 0,
            "{}",
            outcome.err
        );
        let before = "10 rows up to here were seen before";
        assert_eq!(
            outcome.err.contains(before),
            from == 1300,
            "{}",
            outcome.err
        );
        parts += &outcome.out;
    }
    assert!(!whole.out.is_empty());
    assert_eq!(parts, whole.out);

    let refused = |words: &str, bytes: &str, says: &str| {
        let kept = place.snapshot();
        let outcome = fed(&place, words, bytes);
        assert_eq!(outcome.code, Some(2), "{}", outcome.err);
        assert!(outcome.err.contains(says), "{}", outcome.err);
        assert_eq!(place.snapshot(), kept);
    };
    refused(
        "--state s.json",
        "t [s],u [mV],y [mm]\n",
        "the saved state is in command [V], reading [cm]",
    );
    refused("--state m.toml", "0,1,2,3\n", "it is the model file");
    place.write("notes.txt", "mine");
    refused(
        "--state notes.txt",
        "0,1,2,3\n",
        "it is no state that `ctid monitor` wrote",
    );
    refused("--state no/s.json", "0,1,2,3\n", "choose another folder");
    place.write("m.toml", MODEL.replace("154", "155"));
    refused(
        "--state s.json",
        "0,1,2,3\n",
        "the state belongs to another model: area: 154 then, 155 now; name another state file",
    );
}

/// Interrupted or terminated while no row comes, it saves its state and ends well; killed, it leaves the last state whole.
#[test]
#[cfg(unix)]
fn a_signal_ends_it_with_its_state_saved() {
    let rows = rows(1500, 9999);
    for (signal, code) in [("INT", Some(0)), ("TERM", Some(0)), ("KILL", None)] {
        let place = place();
        let (mut child, mut input) = begun(&place, "--state s.json --estimates");
        input.write_all(text(HEADER, &rows).as_bytes()).unwrap();
        input.flush().unwrap();
        // The first estimates: the rows have come.
        let mut first = String::new();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        out.read_line(&mut first).unwrap();
        thread::sleep(Duration::from_millis(300));
        let kill = std::process::Command::new("kill")
            .args([format!("-{signal}"), child.id().to_string()])
            .status()
            .unwrap();
        assert!(kill.success());
        let mut err = String::new();
        child
            .stderr
            .take()
            .unwrap()
            .read_to_string(&mut err)
            .unwrap();
        assert_eq!(child.wait().unwrap().code(), code, "{signal}: {err}");
        assert_eq!(place.path("s.json").exists(), code.is_some());
        let left: Vec<_> = place.snapshot().into_keys().collect();
        assert_eq!(left.len(), if code.is_some() { 2 } else { 1 }, "{left:?}");
        if code.is_some() {
            assert!(err.contains("stopped after 1501 lines"), "{err}");
            let more = fed(&place, "--state s.json", text(HEADER, &rows[1490..]));
            assert_eq!(more.code, Some(0), "{}", more.err);
        }
        drop(input);
    }
}

/// Whoever reads the alarms has gone: it saves and ends.
#[test]
fn a_closed_pipe_ends_it() {
    let place = place();
    let (mut child, mut input) = begun(&place, "--state s.json --estimates --interval 2");
    drop(child.stdout.take());
    let bytes = text(HEADER, &rows(2000, 9999));
    let writer = thread::spawn(move || {
        let _ = input.write_all(bytes.as_bytes());
        input
    });
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{err}");
    assert!(err.contains("standard output was closed"), "{err}");
    assert!(place.path("s.json").exists());
    drop(writer.join().unwrap());
}

/// A line without an end is not kept: the memory stays as it is.
#[test]
#[cfg(target_os = "linux")]
fn a_line_without_an_end_is_thrown_away() {
    let place = place();
    let (mut child, mut input) = begun(&place, "");
    input
        .write_all(text(HEADER, &rows(1200, 9999)).as_bytes())
        .unwrap();
    let before = peak(&child);
    let part = vec![b'7'; 1 << 20];
    for _ in 0..200 {
        input.write_all(&part).unwrap();
    }
    let after = peak(&child);
    input.write_all(b"\n").unwrap();
    drop(input);
    let mut err = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut err)
        .unwrap();
    assert!(child.wait().unwrap().success(), "{err}");
    assert!(
        err.contains("row 1202: more than 65536 bytes without an end of line"),
        "{err}"
    );
    assert!(after < before + 20_000, "{before} kB, then {after} kB");
}

/// Largest resident size so far \[kB\].
#[cfg(target_os = "linux")]
fn peak(child: &Child) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("VmHWM"))
        .unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// Silence would say that all is well.
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

/// The same rows with dates of Berlin, from shortly before its clocks go forward.
fn dated(rows: &[[f64; 3]]) -> String {
    let mut text = "time,u [V],y [cm]\n".to_string();
    for [t, u, y] in rows {
        let mut second = 3600 + 1800 + *t as u64;
        if second >= 2 * 3600 {
            second += 3600;
        }
        let (h, m, s) = (second / 3600, second / 60 % 60, second % 60);
        text += &format!("2026-03-29 {h:02}:{m:02}:{s:02},{u},{y:.4}\n");
    }
    text
}

const BERLIN: &str =
    "plant = \"single-tank\"\n[columns]\ntime_zone = \"Europe/Berlin\"\n[known]\narea = 154.0\n";

/// The monitor sees what it sees of times in seconds, says dates, and goes on with the same clock.
#[test]
fn dates_are_read_and_said_also_after_a_restart() {
    let rows = rows(2200, 1600);
    let place = place();
    let plain = fed(&place, "", text(HEADER, &rows));
    place.write("m.toml", BERLIN);
    let whole = fed(&place, "", dated(&rows));
    assert_eq!(whole.code, Some(0), "{}", whole.err);
    let pairs = || events(&plain.out).into_iter().zip(events(&whole.out));
    assert!(pairs().count() > 0 && plain.out.lines().count() == whole.out.lines().count());
    for (seconds, dates) in pairs() {
        for key in ["event", "time", "since", "effects", "evidence", "score"] {
            assert_eq!(seconds[key], dates[key], "{key}");
        }
        let of_day = |time: &Value| {
            let second = 2 * 3600 + 1800 + time.as_f64().unwrap() as u64;
            let (h, m, s) = (second / 3600, second / 60 % 60, second % 60);
            format!("{h:02}:{m:02}:{s:02}")
        };
        let at = of_day(&dates["time"]);
        assert_eq!(dates["date"], format!("2026-03-29T{at}+02:00"));
        let since = of_day(&dates["since"]);
        assert_eq!(dates["since_date"], format!("2026-03-29T{since}+02:00"));
        let sentence = dates["sentence"].as_str().unwrap();
        let said = format!(" since 2026-03-29 {since}");
        assert!(
            sentence.contains(said.trim_end_matches(":00")),
            "{sentence}"
        );
        assert!(seconds.get("date").is_none());
    }
    assert!(!whole.err.contains("t = "), "{}", whole.err);

    let mut parts = String::new();
    for (from, to) in [(0, 500), (490, 1300), (0, 1640), (1640, 2200)] {
        let outcome = fed(&place, "--state s.json", dated(&rows[from..to]));
        assert_eq!(outcome.code, Some(0), "{}", outcome.err);
        parts += &outcome.out;
    }
    assert_eq!(parts, whole.out);

    let refused = |bytes: &str, says: &str| {
        let kept = place.snapshot();
        let outcome = fed(&place, "--state s.json", bytes);
        assert_eq!(outcome.code, Some(2), "{}", outcome.err);
        assert!(outcome.err.contains(says), "{}", outcome.err);
        assert_eq!(place.snapshot(), kept);
    };
    let header = "time,u [V],y [cm]\n";
    refused(
        &format!("{header}9999,4,12\n"),
        "row 2, column \"time\": the times are numbers, and the saved state has dates",
    );
    refused(
        &format!("{header}23:59:59,4,12\n"),
        "times of day do not say where a saved state goes on; give dates, or leave out --state",
    );
    place.write("m.toml", BERLIN.replace("Berlin", "London"));
    refused(
        &dated(&rows),
        "the times are dates of Europe/London, and the saved state has dates of Europe/Berlin",
    );
}

#[test]
fn dates_that_no_row_can_make_plain_end_it() {
    let place = place();
    let outcome = fed(&place, "", "time,u [V],y [cm]\n03/04/2026 10:00,4,12\n");
    assert_eq!(outcome.code, Some(2), "{}", outcome.err);
    assert_says(
        &outcome,
        "standard input, row 2, column \"time\": \"03/04/2026 10:00\" has two meanings",
    );
    // A row that begins in the middle says no form.
    let lines = "5:00,4.5,14.8\n2026-03-29 10:00:02,4,12\n2026-03-29 10:00:04,4,12\n";
    let outcome = fed(&place, "", lines);
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    assert_says(&outcome, "1 of them with something wrong");
    // The times go back, and what comes is said as it is written.
    let lines = "2026-03-29 10:00:02,4,12\n2026-03-29 10:00:04,4,12\n2026-03-29 10:00:03,4,12\n";
    let outcome = fed(&place, "", lines);
    assert_says(
        &outcome,
        "row 3: column \"time\": the time goes back from 2026-03-29 10:00:04 to 2026-03-29 10:00:03; rows have to come in the order of time",
    );
}

/// A block with a heater, in a room: per hour, as its time column is.
const BLOCK: &str = r#"model Block
  constant Real C(unit="W.h/K") = 15;
  parameter Real k(unit="W/K", min=0) = 0.3;
  parameter Real g(unit="W", min=0) = 0.3;
  input Real u(unit="%");
  input Real Ta(unit="degC");
  output Real y(unit="degC") = T;
  output Real p(unit="kW") = g*u/1000;
  Real T(unit="degC", start=20);
equation
  C*der(T) = g*u - k*(T - Ta);
end Block;
"#;

/// Rows time \[min\], heater, room, block \[degC\], power \[W\], every 30 min; from row `change` on more is lost to the room.
fn block_rows(count: usize, change: usize) -> String {
    let mut random = Random(11);
    let (mut block, mut u, mut until) = (40.0_f64, 50.0_f64, 20);
    let mut text = "t [min],heater [%],room [degC],block [degC],power [W]\n".to_string();
    for j in 0..count {
        if j == until {
            u = (100.0 * random.uniform()).round();
            until += 3 + random.below(40);
        }
        let room = 20.0 + 3.0 * (j as f64 / 15.0).sin();
        // Every sixth power is lost.
        let power = if j % 6 == 2 {
            String::new()
        } else {
            format!("{:.3}", 0.6 * u + 0.5 * random.normal())
        };
        let reading = block + 0.2 * random.normal();
        text += &format!("{},{u},{room:.6},{reading:.4},{power}\n", 30 * j);
        let k = if j < change { 0.4 } else { 0.55 };
        let to = room + 0.6 * u / k;
        block = to + (block - to) * f64::exp(-k / 15.0 * 0.5);
    }
    text
}

const OWN: &str = "model = \"block.mo\"\n[columns]\ntime = \"t [h]\"\nu = \"heater\"\nTa = \"room\"\ny = \"block\"\np = \"power\"\n";

fn own_place() -> Place {
    let place = Place::empty();
    place.write("m.toml", OWN);
    place.write("block.mo", BLOCK);
    place
}

#[test]
fn a_model_of_ones_own_is_watched() {
    let place = own_place();
    let outcome = fed(&place, "--estimates", block_rows(3400, 2600));
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    assert_says(&outcome, "\"heater [%]\", \"room [degC]\" the inputs");
    assert_says(
        &outcome,
        "the reading is lost, the inputs of the row are used",
    );
    let events = events(&outcome.out);
    let estimates = events.iter().find(|e| e["event"] == "estimates").unwrap();
    let of = |name: &str| {
        let all = estimates["parameters"].as_array().unwrap();
        all.iter().find(|p| p["name"] == name).unwrap().clone()
    };
    for (name, truth, unit) in [("k", 0.4, "W/K"), ("g", 0.6, "W")] {
        let estimate = of(name);
        let value = estimate["value"].as_f64().unwrap();
        assert!((value / truth - 1.0).abs() < 0.02, "{estimate}");
        assert!(estimate["half_width"].is_number() && estimate["unit"] == unit);
    }
    // 2600 rows of 30 min; the time constant is 15/0.4 h.
    let onset = 2600.0 * 1800.0;
    let alarm = events.iter().find(|e| e["event"] == "alarm").unwrap();
    let time = alarm["time"].as_f64().unwrap();
    assert!((onset..onset + 40.0 * 3600.0).contains(&time), "{alarm}");
    assert_eq!(alarm["output"], "y");
    let last = events
        .iter()
        .rfind(|e| e["event"] == "update" || e["event"] == "final")
        .unwrap();
    let effects = last["effects"].as_array().unwrap();
    assert!(effects.contains(&"step(k)".into()), "{last}");
    let since = last["since"].as_f64().unwrap();
    assert!((since - onset).abs() < 20.0 * 3600.0, "{since} {onset}");
}

#[test]
fn a_model_of_ones_own_is_watched_with_its_effects() {
    let place = own_place();
    let with = |kept: &str| {
        let file = OWN.replacen('\n', "\neffects = [\"lag(y)\"]\n", 1);
        place.write(
            "m.toml",
            format!("{file}[effect.\"lag(y)\"]\ntau = 2.0\n{kept}"),
        );
        fed(&place, "--estimates", block_rows(2600, 2600))
    };
    let refused = with("");
    assert_eq!(refused.code, Some(2));
    assert_says(
        &refused,
        "m.toml: lag(y) is written in numbers of a record (duration, interval)",
    );
    let outcome = with("record = { duration = 600.0, interval = 0.5 }\n");
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    let events = events(&outcome.out);
    let estimates = events.iter().rfind(|e| e["event"] == "estimates").unwrap();
    let all = estimates["parameters"].as_array().unwrap();
    let tau = all.iter().find(|p| p["name"] == "lag_y_tau").unwrap();
    // Its sensor does not lag.
    let value = tau["value"].as_f64().unwrap();
    assert!(value.abs() < 0.1 && tau["unit"] == "h", "{tau}");
}

#[test]
fn a_state_of_a_model_of_ones_own_goes_on() {
    let place = own_place();
    let all = block_rows(2600, 2000);
    let whole = fed(&place, "", &all);
    let lines: Vec<&str> = all.split_inclusive('\n').collect();
    let first = fed(&place, "--state s.json", lines[..1800].concat());
    assert_eq!(first.code, Some(0), "{}", first.err);
    let rest = lines[0].to_string() + &lines[1800..].concat();
    let second = fed(&place, "--state s.json", rest);
    assert!(!whole.out.is_empty());
    assert_eq!(first.out + &second.out, whole.out);
    // Another model is said, with what differs.
    place.write("block.mo", BLOCK.replace("= 15", "= 16"));
    let refused = fed(&place, "--state s.json", &all);
    assert_eq!(refused.code, Some(2));
    assert_says(&refused, "the state belongs to another model: model");
    // Rows in a unit that the model has not.
    let other = own_place();
    let refused = fed(&other, "", all.replace("block [degC]", "block [bar]"));
    assert_eq!(refused.code, Some(2));
    assert_says(
        &refused,
        "\"block [bar]\" is in bar, but y of the model is in degC",
    );
    let timed = own_place();
    timed.write("block.mo", BLOCK.replace("g*u - k", "g*u + sin(time) - k"));
    let refused = fed(&timed, "", &all);
    assert_eq!(refused.code, Some(2));
    assert_says(&refused, "m.toml: the model uses `time`");
}

/// Dates of the rows of [`block_rows`] in January and February of 2026, whose weeks have no change of the clocks.
fn block_date(row: usize) -> String {
    let (mut day, minute) = (row / 48, row % 48 * 30);
    let mut month = 1;
    if day >= 31 {
        (day, month) = (day - 31, 2);
    }
    let (h, m) = (minute / 60, minute % 60);
    format!("2026-{month:02}-{:02} {h:02}:{m:02}", day + 1)
}

#[test]
fn dates_are_read_and_said_for_a_model_of_ones_own() {
    let place = own_place();
    let plain = fed(&place, "", block_rows(2600, 2000));
    let mut lines = vec!["t,heater [%],room [degC],block [degC],power [W]\n".to_string()];
    for (j, line) in block_rows(2600, 2000).lines().skip(1).enumerate() {
        let (_, cells) = line.split_once(',').unwrap();
        let mut line = block_date(j) + "," + cells;
        if line.ends_with(',') {
            line += "Bad";
        }
        lines.push(line + "\n");
    }
    place.write(
        "m.toml",
        OWN.to_string() + "time_zone = \"Europe/Berlin\"\n",
    );
    let dated = fed(&place, "", lines.concat());
    assert_eq!(dated.code, Some(0), "{}", dated.err);
    let (seconds, dates) = (events(&plain.out), events(&dated.out));
    assert!(!dates.is_empty() && seconds.len() == dates.len());
    let rfc3339 = |time: &Value| {
        let row = (time.as_f64().unwrap() / 1800.0).round() as usize;
        block_date(row).replace(' ', "T") + ":00+01:00"
    };
    for (seconds, dates) in seconds.iter().zip(&dates) {
        for key in ["event", "time", "since", "score"] {
            assert_eq!(seconds[key], dates[key], "{key}");
        }
        assert_eq!(dates["date"], rfc3339(&dates["time"]));
        let sentence = dates["sentence"].as_str().unwrap();
        assert!(sentence.contains(" 2026-02-"), "{sentence}");
        assert!(seconds.get("date").is_none());
    }
    let last = dates.last().unwrap();
    assert!(last["since_date"].as_str().unwrap().starts_with("2026-02-"));
    assert!(!dated.err.contains("since t = "), "{}", dated.err);

    // After a restart too; numbers in place of dates are refused.
    let first = fed(&place, "--state s.json", lines[..1800].concat());
    let rest = lines[0].clone() + &lines[1700..].concat();
    let second = fed(&place, "--state s.json", rest);
    assert_eq!(first.out + &second.out, dated.out);
    let refused = fed(
        &place,
        "--state s.json",
        lines[0].clone() + "9e9,50,20,40,30\n",
    );
    assert_eq!(refused.code, Some(2));
    assert_says(
        &refused,
        "row 2, column \"t\": the times are numbers, and the saved state has dates",
    );
}
