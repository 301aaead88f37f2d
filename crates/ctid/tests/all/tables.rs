//! `ctid tables`: what it writes, and what it refuses.

#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::Place;
use serde_json::Value;

fn check(comparison: &Value) {
    let cells = comparison["tables"].as_array().unwrap();
    assert_eq!(cells.len(), 72);
    assert_eq!(comparison["of"], 72);
    let inside = cells.iter().filter(|cell| cell["inside"] == true).count();
    assert_eq!(comparison["inside"], inside);
    let outside = comparison["outside"].as_array().unwrap();
    assert_eq!(outside.len(), 72 - inside);
    assert!(outside.iter().all(|cell| cell["why"].is_string()));
    for cell in cells {
        let number = |key: &str| cell[key].as_f64().unwrap();
        assert!((1..=4).contains(&cell["table"].as_u64().unwrap()));
        assert!(cell["cell"].is_string());
        assert!(number("q05") <= number("median") && number("median") <= number("q95"));
        let [low, high] = [number("q05"), number("q95")];
        // beside rounding of the printed figure, at most half a unit of the first digit
        if (low..=high).contains(&number("paper")) {
            assert_eq!(cell["inside"], true, "{cell}");
        }
    }
    assert_eq!(cells[0]["cell"], "K avg");
    assert_eq!(cells[0]["paper"], 1.079);
}

#[test]
fn the_result_holds_every_cell_for_both_rules() {
    let place = Place::empty();
    let text = place.succeeds("tables udink --runs 25 --seed 3 --json a.json --report a.html");
    for words in [
        "Table 4",
        "of 72 cells inside",
        "consistent",
        "Assumed, as the paper does not print it",
        "Table 3 - 2",
        "Changes that the comparison would not detect",
        "diag(0.8, 0.008), 0.8",
        "Table 1 with larger P(0)",
        "block-diagonal  exact",
    ] {
        assert!(text.contains(words), "no {words} in {text}");
    }
    assert!(!text.contains("identical"));
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "wider than 80: {line}");
    }
    let json = place.json("a.json");
    assert_eq!(json["schema"], 1);
    assert_eq!(json["paper"], "udink");
    assert_eq!(json["runs"], 25);
    check(&json["euler"]);
    check(&json["exact"]);
    let page = place.read("a.html");
    assert!(page.starts_with(&ctid::report::head()));
    for id in ["responses", "cells-1", "cells-4", "counterexample", "gains"] {
        assert!(page.contains(&format!("id=\"plot-{id}\"")), "no plot {id}");
        assert!(
            page.contains(&format!("\"id\":\"{id}\"")),
            "nothing draws {id}"
        );
    }
    assert!(!page.contains("http://") && !page.contains("https://"));

    // The result depends on the seed and not on the threads; and files of the program may be overwritten.
    let mut threads = place.command("tables --runs 25 --seed 3 --json b.json --report a.html");
    threads.env("RAYON_NUM_THREADS", "3");
    assert_eq!(common::outcome(threads).code, Some(0));
    assert!(place.json("b.json") == json);
}

#[test]
fn what_cannot_be_is_refused() {
    let place = Place::empty();
    place.write("notes.json", "{\"mine\": 1}");
    place.refuses("tables --runs 0", &["--runs is 0", "20 or more"]);
    place.refuses("tables --runs 19", &["--runs is 19", "20 or more"]);
    place.refuses("tables --runs many", &["--runs", "many"]);
    place.refuses("tables --seed -1", &["-1"]);
    place.refuses("tables nobody", &["nobody", "udink"]);
    place.refuses("tables --json notes.json", &["ctid did not write it"]);
    place.refuses("tables --report no/where.html", &["there is no folder"]);
    place.refuses("tables --json a --report a", &["cannot share"]);
}

/// The bands are for 100 runs, and wider for fewer.
#[test]
fn the_second_paper_is_reproduced_cell_by_cell() {
    let place = Place::empty();
    let words = "tables baysse --runs 20 --seed 5 --json a.json --report a.html --record a.csv";
    let text = place.succeeds(words);
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "wider than 80: {line}");
    }
    for words in [
        "Table I ",
        "Table II",
        "0.0074",
        "1.895 V",
        "32 of 32 figures of the runs",
    ] {
        assert!(text.contains(words), "no {words} in {text}");
    }
    // Undetected changes are reported too.
    let sentences = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for words in [
        "the output error estimates them to 0.7 %, more than chance",
        "Not reproduced, and without a band: IV raw",
        "2.11e-3 printed",
        "q = K1 u is right",
    ] {
        assert!(sentences.contains(words), "no {words} in {text}");
    }
    let json = place.json("a.json");
    assert_eq!(
        (&json["paper"], &json["runs"]),
        (&"baysse".into(), &20.into())
    );
    let cells = json["tables"].as_array().unwrap();
    let (mut banded, mut held, mut printed_outside) = (0, 0, 0);
    for cell in cells {
        let number = |value: &Value| value.as_f64().unwrap();
        assert!(
            number(&cell["mean"]).is_finite() && number(&cell["sd"]) >= 0.0,
            "{cell}"
        );
        let Some(band) = cell["band"].as_array() else {
            assert!(cell["inside"].is_null(), "{cell}");
            continue;
        };
        let above = number(&cell["mean"]) >= number(&band[0]);
        let below = band[1].is_null() || number(&cell["mean"]) <= number(&band[1]);
        assert_eq!(cell["inside"], above && below, "{cell}");
        banded += 1;
        if let (Some(paper), Some(high)) = (cell["paper"].as_f64(), band[1].as_f64()) {
            let off = (number(&band[0]) - paper).max(paper - high) / (high - number(&band[0]));
            // The number may be off by half of its last digit.
            let said = number(&cell["paper_outside"]);
            assert!(
                said >= 0.0 && off <= said + 0.5 && said <= off.max(0.0),
                "{cell}"
            );
            held += 1;
            printed_outside += usize::from(said > 0.0);
        }
    }
    assert!(
        held >= 17 && (1..held).contains(&printed_outside),
        "{printed_outside} of {held}"
    );
    let said = format!(
        "Of the {held} printed figures that have a band {} lie inside it",
        held - printed_outside
    );
    assert!(sentences.contains(&said), "no {said} in {text}");
    assert_eq!(
        (&json["inside"], &json["of"]),
        (&banded.into(), &banded.into())
    );
    let printed: Vec<f64> = cells
        .iter()
        .filter_map(|cell| cell["paper"].as_f64())
        .collect();
    assert_eq!(printed.len(), 5 + 6 + 6 + 12);
    assert_eq!((printed[0], printed[17]), (5.91416, 2.60));
    assert!(json["first"]["diagonal_difference"].as_f64().unwrap() < 1e-9);
    let counts = &json["first"]["iterations"];
    assert_eq!(counts["plain_diagonal"], counts["normalised_diagonal"]);

    let page = place.read("a.html");
    for id in ["outputs", "clouds", "closer", "iterations"] {
        assert!(page.contains(&format!("id=\"plot-{id}\"")), "no plot {id}");
        assert!(
            page.contains(&format!("\"id\":\"{id}\"")),
            "nothing draws {id}"
        );
    }
    assert!(!page.contains("http://") && !page.contains("https://"));

    // The result depends on the seed and not on the threads.
    let mut threads = place.command("tables baysse --runs 20 --seed 5 --json b.json");
    threads.env("RAYON_NUM_THREADS", "3");
    assert_eq!(common::outcome(threads).code, Some(0));
    assert!(place.json("b.json") == json);

    // An existing record may belong to another program.
    place.refuses(words, &["a.csv", "the file exists already"]);
    place.refuses("tables baysse --runs 9", &["--runs is 9", "10 or more"]);
    place.refuses("tables --record b.csv", &["--record", "tables baysse"]);
}

#[test]
fn both_papers_at_once() {
    let place = Place::empty();
    // A file of the program may be overwritten.
    place.write("both.json", "{\"written_by\": \"ctid\", \"schema\": 1}");
    let text = place.succeeds("tables all --runs 20 --json both.json");
    assert!(text.contains("Table 4") && text.contains("Table II"));
    let both = place.json("both.json");
    assert!(both["udink"]["euler"]["tables"].is_array());
    assert!(both["baysse"]["tables"].is_array());
    place.refuses("tables all --report a.html", &["--report", "one paper"]);
}

/// docs/hidden-dead-zone.md: what the second paper's table II hides.
#[test]
fn the_emulated_rig_misses_its_dead_zone() {
    let place = Place::empty();
    place.succeeds("tables baysse --runs 10 --record rig.csv");
    place.write("secant.toml", "plant = \"first-order\"\n");
    place.write(
        "tank.toml",
        "plant = \"single-tank\"\n[known]\narea = 154.0\n",
    );
    let missing = |model: &str, options: &str| {
        let found = place.result(&format!("diagnose rig.csv --model {model} {options}"));
        let steps = found["steps"].as_array().unwrap();
        let rmse = |step: &serde_json::Value| step["rmse"].as_f64().unwrap();
        (
            found["groups"].clone(),
            rmse(&steps[0]),
            rmse(&steps[steps.len() - 1]),
        )
    };
    let (effects, before, after) = missing("secant.toml", "--max-effects 1");
    assert_eq!(effects, serde_json::json!([["pump_deadzone"]]));
    assert!(before > 0.5 && after < 0.1, "{before} {after}");
    // The best single effect would be a backlash, which resembles the dead zone and the sensor's filter together.
    let (effects, before, after) = missing("tank.toml", "");
    // A constant leak is equivalent while the command is above the dead zone.
    assert_eq!(
        effects,
        serde_json::json!([["pump_deadzone", "const_leak"], ["pump_lag", "sensor_lag"]])
    );
    assert!(before > 0.2 && after < 0.02, "{before} {after}");
}
