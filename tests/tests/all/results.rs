//! The result as other programs read it: the same however many threads compute it, and every key of it explained.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeSet;

use ctid::output::Written;
use ctid_tests::{Drive, Rig};
use effect_search::HeldOutError;
use missing_effect::{
    Acceptance, Diagnosis, Effort, Options, PerOutput, PlaceScore, Primitive, Problem, Rejection,
    Verdict, diagnose,
};
use plants::{Fitted, Place, Term, Variable};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// A lag in a loop under coloured noise.
fn named() -> Problem {
    let rig = Rig {
        drive: Drive::Closed,
        colour: 0.8,
        hidden: vec![("sensor_lag", 0, vec![12.0])],
        samples: 800,
        ..Rig::single_tank()
    };
    let record = rig.run(&mut ChaCha8Rng::seed_from_u64(1));
    Problem {
        controller: Some(rig.controller()),
        ..rig.problem(record)
    }
}

/// A loss over a range of levels, which no effect describes.
fn unexplained() -> Problem {
    let rig = Rig {
        colour: 0.5,
        terms: vec![Term {
            name: "hidden".to_string(),
            place: Place::Vessel,
            vessel: 0,
            variable: Variable::Level,
            knots: vec![0.0, 12.0, 14.0, 16.0, 40.0],
            ordinates: vec![0.0, 0.0, -5.0, 0.0, 0.0],
            fitted: Fitted::Scale,
        }],
        ..Rig::single_tank()
    };
    let record = rig.run(&mut ChaCha8Rng::seed_from_u64(1));
    rig.problem(record)
}

fn found(problem: &Problem, threads: usize) -> Diagnosis {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build()
        .unwrap()
        .install(|| diagnose(problem, &Options::default(), &|_| {}).unwrap())
}

/// What `--json` writes.
fn json(found: &Diagnosis) -> Value {
    serde_json::to_value(Written::of(found)).unwrap()
}

#[test]
fn a_result_is_the_same_with_any_number_of_threads() {
    for problem in [named(), unexplained()] {
        let [mut alone, mut beside] = [1, 4].map(|threads| json(&found(&problem, threads)));
        for result in [&mut alone, &mut beside] {
            assert_ne!(result["noise"][0]["coefficients"], serde_json::json!([]));
            result.as_object_mut().unwrap().remove("seconds").unwrap();
        }
        assert!(alone == beside, "{alone:#}\n{beside:#}");
    }
}

/// A part of the page: its rows, each the keys of its first cell, and all of it.
type Part<'p> = Vec<(BTreeSet<&'p str>, &'p str)>;

fn quoted(text: &str) -> BTreeSet<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// The part under a heading; the first one has none.
fn part_of<'p>(page: &'p str, heading: &str) -> Option<Part<'p>> {
    let mut parts = page.split("\n## ");
    let text = if heading.is_empty() {
        parts.next()?
    } else {
        parts.find(|text| text.starts_with(&format!("`{heading}`\n")))?
    };
    let rows = text.lines().filter(|line| line.starts_with("| `"));
    let keys = |row: &'p str| quoted(row.split('|').nth(1).unwrap());
    Some(rows.map(|row| (keys(row), row)).collect())
}

/// All keys within a value.
fn keys(value: &Value) -> BTreeSet<&str> {
    match value {
        Value::Object(entries) => entries
            .iter()
            .flat_map(|(key, value)| std::iter::once(key.as_str()).chain(keys(value)))
            .collect(),
        Value::Array(values) => values.iter().flat_map(keys).collect(),
        _ => BTreeSet::new(),
    }
}

/// All that a result has is explained.
fn explained(page: &str, result: &Value) {
    explained_of(page, "", result, &outputs(result));
}

/// The names of the outputs, which stand for keys where there is a number of each.
fn outputs(result: &Value) -> Vec<&str> {
    let names = result["outputs"].as_array().unwrap().iter();
    names.filter_map(Value::as_str).collect()
}

/// What is in objects is explained in a part of their own or, where there is none, in their row; no row explains what is not there, unless
/// it says with what alone it is.
fn explained_of(page: &str, name: &str, value: &Value, outputs: &[&str]) {
    let part = part_of(page, name).unwrap();
    let entries = value.as_object().unwrap();
    for (key, value) in entries {
        let objects = |values: &[Value]| values.iter().all(Value::is_object);
        let row = part.iter().find(|(keys, _)| keys.contains(key.as_str()));
        let (_, row) = row.unwrap_or_else(|| panic!("no row for {key} of {name:?}"));
        match value {
            Value::Array(values) if objects(values) && part_of(page, key).is_some() => {
                let of = |value| explained_of(page, key, value, outputs);
                values.iter().for_each(of);
            }
            Value::Object(_) if part_of(page, key).is_some() => {
                explained_of(page, key, value, outputs)
            }
            _ => {
                let known = quoted(row);
                let unknown = keys(value).into_iter().filter(|key| !known.contains(key));
                let lacking: Vec<_> = unknown.filter(|key| !outputs.contains(key)).collect();
                assert!(lacking.is_empty(), "{lacking:?} of {key} of {name:?}");
            }
        }
    }
    for (keys, row) in part {
        for key in keys {
            let there = entries.contains_key(key) || row.contains("nly with ");
            assert!(there, "there is no {key} in {name:?}");
        }
    }
}

#[test]
fn every_key_of_a_result_is_explained() {
    let page = include_str!("../../../docs/results.md");
    let named = json(&found(&named(), 2));
    assert!(named["control_loop"]["mismatch"].is_number());
    explained(page, &named);
    let mut found = found(&unexplained(), 2);
    assert_eq!(found.verdict, Verdict::Unexplained);
    // A dip comes near to no simple shape; a step would.
    found.unknown.as_mut().unwrap().primitive = Some(Primitive {
        name: "step",
        at: Some(14.0),
        effects: vec!["overflow"],
    });
    explained(page, &json(&found));
    let partial = partial(found);
    explained(page, &json(&partial));
    explained(page, &json(&several(partial)));
}

/// The same with everything that a partial answer has, so that every key is there.
fn partial(mut found: Diagnosis) -> Diagnosis {
    found.verdict = Verdict::Partial;
    found.places = vec![vec![PlaceScore {
        place: "upper".to_string(),
        relative_likelihood: 1.0,
    }]];
    found.acceptance = Some(Acceptance {
        effects: vec!["overflow".to_string()],
        share: Some(0.6),
        share_test: Some(0.5),
        required: 0.9,
        required_partial: 0.5,
        floor: PerOutput(vec![(found.outputs[0].clone(), 0.1)]),
        bic_fall: Some(100.0),
        required_bic_fall: 6.0,
        rejections: vec![
            Rejection::Share {
                share: 0.6,
                required: 0.9,
                of_time: true,
            },
            Rejection::RandomWalk,
        ],
    });
    found.effort = Effort {
        limit: Some(20.0),
        left_out: vec!["pairs of effects".to_string()],
        interrupted: false,
    };
    for step in &mut found.steps {
        step.rmse_test = Some(0.4);
        step.rmse_test_per_output = Some(step.rmse_per_output.clone());
        step.weighted_rmse_test = Some(4.0);
        step.outputs[0].rmse_test = Some(0.4);
        step.outputs[0].held_out_error = Some(HeldOutError {
            offset: 0.1,
            gain: 0.2,
            shape: 0.3,
        });
    }
    found
}

/// The same as if its output had been measured twice.
fn several(mut found: Diagnosis) -> Diagnosis {
    let twice = |values: &PerOutput| {
        let (_, value) = values.0[0];
        PerOutput(vec![
            ("upper".to_string(), value),
            ("lower".to_string(), value),
        ])
    };
    found.outputs = vec!["upper".to_string(), "lower".to_string()];
    found.noise = vec![found.noise[0].clone(); 2];
    found.noise_floor = f64::NAN;
    for step in &mut found.steps {
        (step.rmse, step.rmse_test) = (f64::NAN, None);
        step.rmse_per_output = twice(&step.rmse_per_output);
        step.rmse_test_per_output = step.rmse_test_per_output.as_ref().map(twice);
        step.outputs = vec![step.outputs[0].clone(); 2];
    }
    for score in &mut found.scores {
        score.rmse = f64::NAN;
    }
    if let Some(test) = &mut found.acceptance {
        test.floor = twice(&test.floor);
    }
    found
}

#[test]
fn what_several_outputs_have_not_in_common_is_not_written() {
    let found = json(&several(partial(found(&unexplained(), 2))));
    for (part, key) in [
        (&found, "noise_floor"),
        (&found["steps"][0], "rmse"),
        (&found["scores"][0], "rmse"),
    ] {
        assert!(part.get(key).is_none(), "{key}");
    }
    assert!(found["steps"][0]["rmse_test"].is_null());
    let by_name = &found["steps"][0]["rmse_per_output"];
    assert_eq!(by_name["upper"], found["steps"][0]["outputs"][0]["rmse"]);
    assert_eq!(found["acceptance"]["floor"]["lower"], 0.1);
}

#[test]
fn every_verdict_is_explained() {
    let page = include_str!("../../../docs/results.md");
    let part = part_of(page, "").unwrap();
    let row = part.iter().find(|(keys, _)| keys.contains("verdict"));
    let named = quoted(row.unwrap().1);
    for verdict in [
        Verdict::Effect,
        Verdict::Undecided,
        Verdict::Partial,
        Verdict::Unexplained,
        Verdict::Adequate,
    ] {
        let name = serde_json::to_value(verdict).unwrap();
        assert!(named.contains(name.as_str().unwrap()), "{name}");
    }
}
