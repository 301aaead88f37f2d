//! Results of the program for valid input: the documented JSON, independent of the format of the file, the number of threads and the run,
//! and files in the requested places.

#![allow(clippy::unwrap_used, clippy::panic)]

mod output;
mod records;

use std::collections::BTreeSet;

use crate::common::{Place, Tanks, bundled, csv, lasting, outcome};
use plants::CATALOGUE;
use serde_json::Value;

const DIAGNOSE: &str = "diagnose tour.csv --model tour.toml";

fn texts(value: &Value) -> Vec<&str> {
    let list = value.as_array().unwrap();
    list.iter().map(|text| text.as_str().unwrap()).collect()
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .filter(|number| number.is_finite())
        .unwrap_or_else(|| panic!("{value} is not a finite number"))
}

/// Names and values of the parameters of a step.
fn parameters(step: &Value) -> Vec<(String, f64)> {
    let named = |p: &Value| (p["name"].as_str().unwrap().to_string(), number(&p["value"]));
    step["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(named)
        .collect()
}

/// The keys, types and rules that `docs/results.md` specifies for the JSON of `diagnose`.
fn fulfils_the_contract(json: &Value, held_out: bool) {
    assert_eq!(json["schema"], 4);
    let verdict = json["verdict"].as_str().unwrap();
    let effects = texts(&json["effects"]);
    let groups: Vec<Vec<&str>> = json["groups"]
        .as_array()
        .unwrap()
        .iter()
        .map(texts)
        .collect();
    let ranked = texts(&json["ranked"]);
    let steps = json["steps"].as_array().unwrap();

    let known: BTreeSet<&str> = CATALOGUE.iter().map(|effect| effect.id).collect();
    let named = effects.iter().chain(groups.iter().flatten());
    for id in named.chain(ranked.iter().filter(|id| **id != "none")) {
        assert!(known.contains(id), "{id} is not in the catalogue");
    }
    assert_eq!(effects.len(), groups.len());
    let in_doubt = json["in_doubt"].as_array().unwrap();
    assert_eq!(effects.len(), in_doubt.len());
    let sentences = texts(&json["sentences"]);
    for (said, doubted) in sentences.iter().zip(in_doubt) {
        assert_eq!(said.contains("Uncertain:"), doubted.as_bool().unwrap());
    }
    let unexplained = json["residual_unexplained"].as_bool().unwrap();
    let not_noise = json["not_noise"].is_object();
    if verdict != "partial" {
        assert_eq!(unexplained, verdict == "unexplained" || not_noise);
    }
    for (effect, group) in effects.iter().zip(&groups) {
        assert!(group.contains(effect), "{effect} is not in {group:?}");
    }
    let distinct: BTreeSet<&&str> = ranked.iter().collect();
    assert_eq!(distinct.len(), ranked.len(), "{ranked:?}");
    assert_eq!(
        ranked.first() == Some(&"none"),
        verdict == "adequate",
        "{verdict}: {ranked:?}"
    );
    match verdict {
        "effect" => {
            assert!(!effects.is_empty());
            assert!(groups.iter().all(|group| group.len() == 1), "{groups:?}");
        }
        "partial" => {
            assert!(!effects.is_empty() && unexplained);
            let acceptance = &json["acceptance"];
            assert_eq!(texts(&acceptance["effects"]), effects);
            assert!(number(&acceptance["share"]) >= number(&acceptance["required_partial"]));
            assert!(acceptance["rejections"].as_array().unwrap().is_empty());
        }
        "undecided" => assert!(groups.iter().any(|group| group.len() > 1), "{groups:?}"),
        "unexplained" => {}
        "adequate" => assert!(effects.is_empty()),
        other => panic!("verdict {other}"),
    }

    let places = json["places"].as_array().unwrap();
    assert!(places.is_empty() || places.len() == effects.len());
    for place in places.iter().flat_map(|places| places.as_array().unwrap()) {
        assert!((0.0..=1.0).contains(&number(&place["relative_likelihood"])));
    }
    assert!(json["acceptance"].is_null() || verdict != "adequate");
    for ranking in ["white", "prewhitened"] {
        for id in texts(&json["rankings"][ranking]) {
            assert!(id == "none" || known.contains(id), "{id}");
        }
    }
    texts(&json["effort"]["left_out"]);
    assert_eq!(json["effort"]["interrupted"], false);

    assert_eq!(steps.len(), 1 + effects.len());
    assert!(steps[0]["added"].is_null());
    for (step, effect) in steps[1..].iter().zip(&effects) {
        assert_eq!(step["added"], *effect);
    }
    for pair in steps.windows(2) {
        assert!(number(&pair[1]["rmse"]) < number(&pair[0]["rmse"]));
    }
    for step in steps {
        assert!(number(&step["rmse"]) > 0.0);
        number(&step["bic"]);
        if held_out {
            assert!(number(&step["rmse_test"]) > 0.0);
        } else {
            assert!(step["rmse_test"].is_null() && step["held_out_error"].is_null());
        }
        let parameters = step["parameters"].as_array().unwrap();
        assert!(!parameters.is_empty());
        for parameter in parameters {
            assert!(!parameter["name"].as_str().unwrap().is_empty());
            assert!(parameter["unit"].is_string());
            number(&parameter["value"]);
            let error = &parameter["std_error"];
            assert!(error.is_null() || number(error) > 0.0, "{parameter}");
        }
    }
    assert!(number(&json["noise_floor"]) > 0.0);
    assert!(number(&json["seconds"]) > 0.0);
}

#[test]
fn the_bundled_records_give_the_json_of_the_contract() {
    let place = Place::new();
    let json = place.result(&format!("{DIAGNOSE} --test tour-test.csv"));
    fulfils_the_contract(&json, true);
    assert_eq!(json["verdict"], "effect");
    assert_eq!(json["effects"], serde_json::json!(["overflow"]));
    assert_eq!(json["ranked"][0], "overflow");
    let unit = |index: usize| json["steps"][0]["parameters"][index]["unit"].clone();
    assert_eq!((unit(0), unit(1)), ("cm^3/(V s)".into(), "cm^2.5/s".into()));
    fulfils_the_contract(&place.result(DIAGNOSE), false);
}

/// The exit code is 0 for any verdict: [`Place::result`] checks it.
fn diagnosed(record: &str, model: &str) -> Value {
    let place = Place::empty();
    place.write("data.csv", record);
    place.write("model.toml", model);
    let json = place.result("diagnose data.csv --model model.toml");
    fulfils_the_contract(&json, false);
    json
}

#[test]
fn an_adequate_model_is_a_result() {
    for tanks in [Tanks::single(), Tanks::cascaded()] {
        let json = diagnosed(&tanks.csv(), &tanks.model());
        assert_eq!(json["verdict"], "adequate");
        let rmse = number(&json["steps"][0]["rmse"]);
        assert!((rmse / tanks.noise - 1.0).abs() < 0.1, "{rmse}");
    }
}

#[test]
fn an_effect_of_the_lower_of_two_tanks_is_found_at_its_place() {
    let rim = 16.5;
    let tanks = Tanks {
        hidden: vec![("overflow", 1, vec![rim])],
        ..Tanks::cascaded()
    };
    let json = diagnosed(&tanks.csv(), &tanks.model());
    assert_eq!(json["effects"], serde_json::json!(["overflow"]));
    assert_eq!(json["steps"][1]["place"], "lower");
    let found = parameters(&json["steps"][1])
        .into_iter()
        .find(|(name, _)| name == "overflow.rim");
    let (_, found) = found.unwrap();
    assert!((found - rim).abs() < 0.1, "{found}");
}

#[test]
fn an_effect_with_a_stand_in_is_a_result() {
    let tanks = Tanks {
        hidden: vec![("pump_lag", 0, vec![8.0])],
        ..Tanks::single()
    };
    let json = diagnosed(&tanks.csv(), &tanks.model());
    assert_eq!(json["verdict"], "undecided");
    let group: BTreeSet<&str> = texts(&json["groups"][0]).into_iter().collect();
    assert!(group.contains("pump_lag") && group.contains("sensor_lag"));
}

#[test]
fn the_ranking_keeps_the_error_at_eighty_columns() {
    let place = Place::empty();
    for (tanks, effect) in [
        (Tanks::single(), ("sensor_lag", 0, vec![8.0])),
        (Tanks::cascaded(), ("const_leak", 0, vec![6.0])),
    ] {
        let tanks = Tanks {
            hidden: vec![effect],
            ..tanks
        };
        place.write("data.csv", tanks.csv());
        place.write("model.toml", tanks.model());
        let text = place.succeeds("diagnose data.csv --model model.toml");
        let (_, ranking) = text
            .split_once("The catalogue, one effect at a time")
            .unwrap();
        let heading = ranking.lines().nth(1).unwrap();
        assert!(heading.contains("error after"), "{ranking}");
    }
}

#[test]
fn something_that_nothing_explains_is_a_result() {
    // A sensor error that oscillates with its reading: no effect of the catalogue. By chance one of them may resemble it on a record.
    let unexplained = (1..8).any(|seed| {
        let tanks = Tanks {
            seed,
            ..Tanks::single()
        };
        let (inputs, mut outputs) = tanks.run();
        for y in &mut outputs {
            *y += 0.7 * (2.5 * *y).sin();
        }
        diagnosed(&csv(&inputs, &outputs), &tanks.model())["verdict"] == "unexplained"
    });
    assert!(unexplained);
}

#[test]
fn at_most_so_many_effects_are_added() {
    let tanks = Tanks {
        hidden: vec![("pump_lag", 0, vec![25.0]), ("overflow", 0, vec![17.0])],
        ..Tanks::single()
    };
    let place = Place::empty();
    place.write("data.csv", tanks.csv());
    place.write("model.toml", tanks.model());
    let json = place.result("diagnose data.csv --model model.toml --max-effects 1");
    fulfils_the_contract(&json, false);
    assert!(json["effects"].as_array().unwrap().len() <= 1);
    let json = place.result("diagnose data.csv --model model.toml --max-effects 3");
    fulfils_the_contract(&json, false);
    assert!(json["effects"].as_array().unwrap().len() > 1);
}

#[test]
fn add_compare_remove_is_a_round_trip() {
    for (name, text) in [
        ("as bundled", bundled("tour.toml")),
        ("windows", bundled("tour.toml").replace('\n', "\r\n")),
        (
            "no list",
            bundled("tour.toml").replace("effects = []", "# effects: none yet"),
        ),
        (
            "one a line",
            bundled("tour.toml").replace(
                "effects = []",
                "effects = [\n    \"pump_lag\", # slow relay\n]",
            ),
        ),
    ] {
        let place = Place::new();
        place.write("tour.toml", &text);
        let rmse = || {
            let json = place.result("compare tour.csv --model tour.toml");
            assert_eq!(json["steps"].as_array().unwrap().len(), 1);
            number(&json["steps"][0]["rmse"])
        };
        let before = rmse();
        let said = place.succeeds("add overflow --model tour.toml");
        assert!(said.contains("tour.toml: added overflow"), "{said}");
        let with = place.read("tour.toml");
        assert!(with.contains("\"overflow\"") && with.contains("# measured with a tape"));
        assert!(rmse() < 0.1 * before, "{name}");
        let said = place.succeeds("remove overflow --model tour.toml");
        assert!(said.contains("tour.toml: removed overflow"), "{said}");
        let after = place.read("tour.toml");
        if name == "no list" {
            // The list that `add` wrote stays, and is empty.
            assert!(after.contains("effects = []"), "{after}");
            assert_eq!(after.replace("effects = []\n", ""), text, "{name}");
        } else {
            assert_eq!(after, text, "{name}");
        }
        assert_eq!(rmse(), before, "{name}");
    }
}

#[test]
fn an_effect_at_a_place_comes_and_goes() {
    let place = Place::empty();
    let text = "plant = \"cascaded-tanks\" # two\neffects = [] # none\n";
    place.write("two.toml", text);
    let said = place.succeeds("add overflow --where lower --model two.toml");
    assert!(said.contains("at the lower vessel"), "{said}");
    let with = place.read("two.toml");
    assert!(
        with.contains("effects = [\"overflow\"] # none") && with.contains("where = \"lower\""),
        "{with}"
    );
    place.succeeds("remove overflow --model two.toml");
    assert!(place.read("two.toml").starts_with(text));
}

#[test]
fn every_effect_of_the_catalogue_is_listed_and_described() {
    let place = Place::empty();
    let list = place.succeeds("effects");
    for effect in CATALOGUE {
        let entry = list
            .lines()
            .any(|line| line.split_whitespace().next() == Some(effect.id));
        assert!(entry, "{} is not listed", effect.id);
        let description = place.succeeds(&format!("effects {}", effect.id));
        let command = format!("ctid add {} --model MODEL.toml", effect.id);
        assert!(description.contains(&command), "{description}");
    }
    assert_eq!(place.snapshot().len(), 0);
}

#[test]
fn a_result_is_the_same_in_every_run_with_any_number_of_threads() {
    let place = Place::new();
    let words = format!("{DIAGNOSE} --test tour-test.csv --json a.json --report a.html");
    let run = |threads: &str| {
        let mut command = place.command(&words);
        command.env("RAYON_NUM_THREADS", threads);
        let outcome = outcome(command);
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
        (
            outcome.out,
            lasting(place.json("a.json")),
            place.read("a.html"),
        )
    };
    let first = run("1");
    for threads in ["1", "4", "4"] {
        let again = run(threads);
        assert_eq!(first.0, again.0);
        assert_eq!(first.1, again.1);
        assert!(first.2 == again.2, "the reports differ");
    }
}
