//! The program as a library: what it prints, what it writes, and what it leaves alone.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use ctid::look::Look;
use ctid::progress::Bar;
use ctid::{Cli, Error, run, tour};
use tempfile::TempDir;

/// A folder with the bundled records and their model file.
struct Place {
    folder: TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let records = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/records");
        for name in ["tour.csv", "tour-test.csv", "tour.toml"] {
            fs::copy(records.join(name), folder.path().join(name)).unwrap();
        }
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs `ctid` with words that name files by `@name`.
    fn ctid(&self, words: &str) -> Result<String, Error> {
        let words = words
            .split_whitespace()
            .map(|word| match word.strip_prefix('@') {
                Some(name) => self.path(name).display().to_string(),
                None => word.to_string(),
            });
        let cli = Cli::try_parse_from(["ctid".to_string()].into_iter().chain(words)).unwrap();
        let mut out = Vec::new();
        run(cli, &mut out, Look::plain())?;
        Ok(String::from_utf8(out).unwrap())
    }

    fn refusal(&self, words: &str) -> String {
        let message = self.ctid(words).unwrap_err().to_string();
        assert!(!message.contains('\n'), "more than one line: {message}");
        message
    }

    fn files(&self) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}

fn fits_the_width(text: &str) {
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "wider than 80: {line}");
        assert!(
            !line.contains('\u{1b}'),
            "a colour code without a terminal: {line}"
        );
    }
}

#[test]
fn compare_shows_the_error_and_writes_both_files() {
    let place = Place::new();
    let text = place
        .ctid("compare @tour.csv --model @tour.toml --test @tour-test.csv --json @out.json --report @out.html")
        .unwrap();
    // The lines that name the written files are as long as their paths.
    fits_the_width(text.split("\nwrote").next().unwrap());
    for words in [
        "Simulation error, root mean square",
        "pump_gain",
        "Where single-tank fails",
        "held-out data",
    ] {
        assert!(text.contains(words), "{text}");
    }
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(place.path("out.json")).unwrap()).unwrap();
    assert_eq!(json["schema"], 4);
    assert_eq!(json["steps"].as_array().unwrap().len(), 1);
    assert!(json["steps"][0]["rmse_test"].is_f64());
    assert!(
        fs::read_to_string(place.path("out.html"))
            .unwrap()
            .starts_with(&ctid::report::head())
    );
    // Files of the program may be overwritten.
    place
        .ctid("compare @tour.csv --model @tour.toml --json @out.json --report @out.html")
        .unwrap();
    assert_eq!(
        place.files(),
        [
            "out.html",
            "out.json",
            "tour-test.csv",
            "tour.csv",
            "tour.toml"
        ]
    );
}

/// An error that is printed says what it is, and of which data: a prediction of one step that is near zero would mean
/// nothing. So say all lines and headings with the word, of every verdict, in the terminal and on the page.
#[test]
fn every_error_is_a_simulation_error_on_data_that_are_named() {
    let place = Place::new();
    for (command, tests) in [("compare", true), ("diagnose", true), ("diagnose", false)] {
        let test = if tests { " --test @tour-test.csv" } else { "" };
        let text = place
            .ctid(&format!(
                "{command} @tour.csv --model @tour.toml --report @out.html{test}"
            ))
            .unwrap();
        // A sentence may be split into lines.
        let flat = text.to_lowercase();
        let flat = flat.split_whitespace().collect::<Vec<_>>().join(" ");
        let errors = flat.matches("error").count();
        let explained: usize = [
            "simulation error",
            "standard error",
            "squared error",
            "held-out error",
            "error after",
        ]
        .iter()
        .map(|words| flat.matches(words).count())
        .sum();
        assert!(errors > 0 && errors == explained, "{command}: {text}");
        assert!(!flat.contains("prediction"), "{text}");
        // The table of the steps has a column for each kind of data; that of the catalogue has it in the heading.
        let table = text
            .split_once("Simulation error, root mean square\n")
            .unwrap()
            .1;
        let heading = table.lines().next().unwrap();
        assert!(heading.contains("fitted data"), "{text}");
        assert_eq!(heading.contains("held-out data"), tests, "{text}");
        assert_eq!(
            text.contains("simulation error on fitted data"),
            command == "diagnose",
            "{text}"
        );
        let page = fs::read_to_string(place.path("out.html")).unwrap();
        assert!(
            page.contains("The simulation error is that of a model that runs on the input alone")
        );
    }
}

#[test]
fn diagnose_names_the_effect_and_add_makes_the_error_fall() {
    let place = Place::new();
    let text = place
        .ctid("diagnose @tour.csv --model @tour.toml --test @tour-test.csv --max-effects 2 --json @out.json")
        .unwrap();
    fits_the_width(text.split("\nwrote").next().unwrap());
    assert!(text.contains("Missing: overflow"), "{text}");
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(place.path("out.json")).unwrap()).unwrap();
    assert_eq!(json["verdict"], "effect");
    assert_eq!(json["effects"][0], "overflow");

    let said = place.ctid("add overflow --model @tour.toml").unwrap();
    assert!(said.contains("added overflow"), "{said}");
    let model = fs::read_to_string(place.path("tour.toml")).unwrap();
    assert!(
        model.contains("effects = [\"overflow\"] ") && model.contains("# measured with a tape"),
        "{model}"
    );
    place
        .ctid("compare @tour.csv --model @tour.toml --json @out.json")
        .unwrap();
    let after: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(place.path("out.json")).unwrap()).unwrap();
    let rmse = |json: &serde_json::Value| json["steps"][0]["rmse"].as_f64().unwrap();
    assert!(rmse(&after) < 0.2 * rmse(&json));
    place.ctid("remove overflow --model @tour.toml").unwrap();
    let original = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/records/tour.toml");
    assert_eq!(
        fs::read_to_string(place.path("tour.toml")).unwrap(),
        fs::read_to_string(original).unwrap()
    );
}

#[test]
fn bad_input_is_refused_before_anything_is_written() {
    let place = Place::new();
    fs::write(place.path("bad.csv"), "t [s],u [V],y [cm]\n0,1,2\n1,x,2\n").unwrap();
    fs::write(place.path("notes.json"), "{\"mine\": true}").unwrap();
    let before = place.files();
    for (words, says) in [
        (
            "diagnose @bad.csv --model @tour.toml --json @out.json",
            "row 3",
        ),
        (
            "diagnose @none.csv --model @tour.toml --json @out.json",
            "cannot be opened",
        ),
        (
            "compare @tour.csv --model @none.toml --json @out.json",
            "cannot be opened",
        ),
        (
            "compare @tour.csv --model @tour.toml --test @bad.csv --json @out.json",
            "row 3",
        ),
        (
            "compare @tour.csv --model @tour.toml --test @tour.csv",
            "both fitted and held out",
        ),
        (
            "compare @tour.csv --model @tour.toml --json @tour.csv",
            "one of the inputs",
        ),
        (
            "compare @tour.csv --model @tour.toml --report @tour.toml",
            "one of the inputs",
        ),
        (
            "compare @tour.csv --model @tour.toml --json @notes.json",
            "choose another name or delete it",
        ),
        (
            "compare @tour.csv --model @tour.toml --json @no/out.json",
            "there is no folder",
        ),
        (
            "compare @tour.csv --model @tour.toml --json @out --report @out",
            "cannot share",
        ),
        ("add overflow --model @none.toml", "cannot be opened"),
        ("effects overfow", "did you mean overflow?"),
    ] {
        let message = place.refusal(words);
        assert!(message.contains(says), "{words}: {message}");
    }
    assert_eq!(place.files(), before);
    assert_eq!(
        fs::read_to_string(place.path("notes.json")).unwrap(),
        "{\"mine\": true}"
    );
}

#[test]
fn the_tour_finds_the_effect_and_spares_a_file_that_is_not_its_own() {
    let place = Place::new();
    fs::write(place.path("report.html"), "<p>my own</p>").unwrap();
    let mut out = Vec::new();
    let tour = tour::run(place.folder.path(), &mut out, Look::plain(), &Bar::hidden()).unwrap();
    let text = String::from_utf8(out).unwrap();
    fits_the_width(
        text.split("holds all of this")
            .next()
            .unwrap()
            .rsplit_once('\n')
            .unwrap()
            .0,
    );

    assert_eq!(tour.report, place.path("report-2.html"));
    assert_eq!(tour.diagnosis.effects, ["overflow"]);
    assert_eq!(
        fs::read_to_string(place.path("report.html")).unwrap(),
        "<p>my own</p>"
    );
    let mut from = 0;
    for title in [
        "1 Compare",
        "2 See where",
        "3 Learn what",
        "4 Add it",
        "5 Watch the error",
        "report-2.html",
    ] {
        let at = text[from..]
            .find(title)
            .unwrap_or_else(|| panic!("no {title} in order: {text}"));
        from += at;
    }
    assert!(text.contains("effects = [\"overflow\"]"), "{text}");
    let (first, last) = (&tour.diagnosis.steps[0], &tour.diagnosis.steps[1]);
    assert!(
        last.rmse < 0.1 * first.rmse && last.rmse_test.unwrap() < 0.1 * first.rmse_test.unwrap()
    );
}
