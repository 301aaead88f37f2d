//! Destinations of results: pipes, files, and additional files.

use std::fs;
use std::process::Stdio;

use super::{DIAGNOSE, number};
use crate::common;
use crate::common::{Place, Tanks, bundled, outcome};

#[test]
fn a_pipe_gets_plain_text() {
    let place = Place::new();
    for words in [
        "effects",
        "effects overflow",
        "compare tour.csv --model tour.toml",
        DIAGNOSE,
        "--help",
        "",
    ] {
        for (name, value) in [("NO_COLOR", "1"), ("TERM", "xterm-256color")] {
            let mut command = place.command(words);
            command.env(name, value);
            let outcome = outcome(command);
            assert_eq!(outcome.code, Some(0));
            assert!(outcome.out.len() > 100, "{words}: {}", outcome.out);
            let plain = |c: char| c == '\n' || !c.is_control();
            assert!(outcome.out.chars().all(plain), "{words}: {}", outcome.out);
            assert_eq!(outcome.err, "");
        }
    }
}

#[test]
fn a_reader_that_goes_early_is_no_error() {
    let place = Place::new();
    for words in [
        "effects".to_string(),
        "--help".to_string(),
        format!("{DIAGNOSE} --json early.json"),
    ] {
        let mut child = place.command(&words).spawn().unwrap();
        drop(child.stdout.take());
        let end = child.wait_with_output().unwrap();
        let err = String::from_utf8(end.stderr).unwrap();
        assert_eq!(end.status.code(), Some(0), "{words}: {err}");
        assert_eq!(err, "", "{words}");
    }
    // The requested result is written nevertheless.
    assert_eq!(place.json("early.json")["verdict"], "effect");
}

#[cfg(target_os = "linux")]
#[test]
fn standard_output_that_takes_nothing_is_an_error() {
    let place = Place::new();
    for words in ["effects", "compare tour.csv --model tour.toml"] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let mut command = place.command(words);
        command.stdout(Stdio::from(full));
        let outcome = outcome(command);
        assert_eq!(outcome.code, Some(2));
        assert!(
            outcome
                .err
                .starts_with("error: cannot write to standard output"),
            "{}",
            outcome.err
        );
        assert_eq!(outcome.err.lines().count(), 1);
    }
}

#[test]
fn an_earlier_result_of_ctid_is_replaced_and_nothing_is_left_beside_it() {
    let place = Place::new();
    let words = "compare tour.csv --model tour.toml --json a.json --report a.html";
    place.succeeds(words);
    let (json, page) = (place.json("a.json"), place.read("a.html"));
    let files: Vec<_> = place.snapshot().into_keys().collect();
    place.succeeds("add overflow --model tour.toml");
    let said = place.succeeds(words);
    assert!(
        said.contains("wrote a.json") && said.contains("wrote a.html"),
        "{said}"
    );
    assert!(number(&place.json("a.json")["steps"][0]["rmse"]) < number(&json["steps"][0]["rmse"]));
    assert!(place.read("a.html") != page);
    assert_eq!(files, place.snapshot().into_keys().collect::<Vec<_>>());
}

#[test]
fn the_inputs_stay_as_they_are() {
    let place = Place::new();
    place.succeeds(&format!("{DIAGNOSE} --test tour-test.csv --json a.json"));
    for name in common::BUNDLED {
        assert_eq!(place.read(name), bundled(name));
    }
    assert_eq!(place.snapshot().len(), common::BUNDLED.len() + 1);
}

#[test]
fn a_tour_writes_its_report_and_a_second_one_destroys_nothing() {
    let place = Place::empty();
    let first = place.succeeds("");
    assert!(first.contains("report.html holds all of this"), "{first}");
    assert_eq!(place.snapshot().len(), 1);
    let page = place.read("report.html");
    assert!(page.starts_with(&ctid::report::head()) && page.contains("tour.csv"));

    // Again: the page of ctid is overwritten.
    assert_eq!(place.succeeds(""), first);
    assert_eq!(place.snapshot().len(), 1);
    assert!(place.read("report.html") == page);

    // A page of another program, or of ctid for other data, is not overwritten.
    let tanks = Tanks::single();
    place.write("my.csv", tanks.csv());
    place.write("my.toml", tanks.model());
    place.succeeds("compare my.csv --model my.toml --report report.html");
    place.write("report-2.html", "<p>notes</p>");
    let mut before = place.snapshot();
    let said = place.succeeds("");
    assert!(said.contains("report-3.html holds all of this"), "{said}");
    assert!(place.read("report-3.html") == page);
    before.insert(place.path("report-3.html"), Some(page.into_bytes()));
    assert!(place.snapshot() == before);
}

/// A shell's `--model <(...)` is a pipe, which can be read once.
#[cfg(unix)]
#[test]
fn a_model_file_may_be_a_pipe() {
    for words in [
        "compare tour.csv",
        "design tour.csv --between pump_lag sensor_lag",
    ] {
        let place = Place::new();
        let mut child = place
            .command(&format!("{words} --model /dev/stdin"))
            .stdin(Stdio::piped())
            .spawn()
            .unwrap();
        let mut input = child.stdin.take().unwrap();
        std::io::Write::write_all(&mut input, bundled("tour.toml").as_bytes()).unwrap();
        drop(input);
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{words}: {said}");
    }
}
