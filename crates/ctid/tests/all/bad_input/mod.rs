//! Bad input, one mistake at a time, through the program: exit code 2, one line that names the place and the correction, and not a byte on
//! disk changed.

#![allow(clippy::unwrap_used, clippy::panic)]

mod controllers;
mod files;
mod models;
mod records;
mod results;
mod units;
mod usage;

use std::fs;
use std::sync::OnceLock;

use crate::common::{Place, bundled};

/// Results that ctid wrote earlier: a failed run must not change them.
fn earlier_results() -> &'static [(&'static str, Vec<u8>); 2] {
    static RESULTS: OnceLock<[(&str, Vec<u8>); 2]> = OnceLock::new();
    RESULTS.get_or_init(|| {
        let place = Place::new();
        place.succeeds("compare tour.csv --model tour.toml --json out.json --report out.html");
        ["out.json", "out.html"].map(|name| (name, fs::read(place.path(name)).unwrap()))
    })
}

/// The bundled records, their model, and results that ctid wrote earlier.
fn place() -> Place {
    let place = Place::new();
    for (name, content) in earlier_results() {
        place.write(name, content);
    }
    place
}

/// `compare` and `diagnose` refuse the record or model with these words, onto new results and onto
/// earlier ones.
fn both_refuse(place: &Place, words: &str, says: &[&str]) {
    for command in ["compare", "diagnose"] {
        for results in [
            "--json out.json --report out.html",
            "--json new.json --report new.html",
        ] {
            place.refuses(&format!("{command} {words} {results}"), says);
        }
    }
}

/// A record is refused with these words, as data and as held-out data.
fn record_refused(content: impl AsRef<[u8]>, says: &[&str]) {
    let place = place();
    place.write("bad.csv", content);
    both_refuse(&place, "bad.csv --model tour.toml", says);
    both_refuse(&place, "tour.csv --model tour.toml --test bad.csv", says);
    both_refuse(&place, "tour.csv bad.csv --model tour.toml", says);
}

/// A record is refused with these words where it is to be read strictly.
fn record_refused_strictly(content: impl AsRef<[u8]>, says: &[&str]) {
    let place = place();
    place.write("bad.csv", content);
    both_refuse(&place, "bad.csv --model tour.toml --strict", says);
    both_refuse(
        &place,
        "tour.csv --model tour.toml --test bad.csv --strict",
        says,
    );
    both_refuse(&place, "tour.csv bad.csv --model tour.toml --strict", says);
    place.succeeds("compare bad.csv --model tour.toml");
}

/// A model file is refused with these words, by `compare`, `diagnose`, `add` and `remove`.
fn model_refused(content: impl AsRef<[u8]>, says: &[&str]) {
    let place = place();
    place.write("bad.toml", content);
    both_refuse(&place, "tour.csv --model bad.toml", says);
    place.refuses("add pump_lag --model bad.toml", says);
    place.refuses("remove overflow --model bad.toml", says);
}

/// The bundled model file with one line replaced.
fn model_with(line: &str, by: &str) -> String {
    let text = bundled("tour.toml");
    assert!(text.contains(line));
    text.replace(line, by)
}

/// The cells of the bundled record; row 1 is the header, as a text editor counts.
struct Rows(Vec<Vec<String>>);

impl Rows {
    fn new() -> Self {
        let cells = |line: &str| line.split(',').map(str::to_string).collect();
        Self(bundled("tour.csv").lines().map(cells).collect())
    }

    /// Replaces one cell; column 0 is the time, 1 the input, 2 the output.
    fn with(mut self, row: usize, column: usize, text: &str) -> Self {
        self.0[row - 1][column] = text.to_string();
        self
    }

    fn without(mut self, row: usize) -> Self {
        self.0.remove(row - 1);
        self
    }

    /// A whole column changed, but for its header.
    fn each(mut self, column: usize, change: impl Fn(f64) -> f64) -> Self {
        for row in &mut self.0[1..] {
            row[column] = change(row[column].parse().unwrap()).to_string();
        }
        self
    }

    fn text(&self) -> String {
        let lines: Vec<String> = self.0.iter().map(|row| row.join(",")).collect();
        lines.join("\n") + "\n"
    }
}
