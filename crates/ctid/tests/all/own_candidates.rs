//! Candidates of the user's own on the command line: named with their place, also in the monitor's isolation.

use std::fmt::Write;
use std::io::Write as _;
use std::process::Stdio;

use serde_json::Value;

use crate::common::{Place, Random};

const BLOCK: &str = r#"model Block "a block with a heater, in a room"
  parameter Real k(unit="W/K", min=0) = 0.3 "loss";
  parameter Real g(unit="W/%", min=0) = 0.5 "heater";
  final parameter Real C(unit="J/K") = 50;
  input Real u(unit="%");
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20) "block";
equation
  C*der(T) = g*u - k*(T - 20);
end Block;
"#;

const CANDIDATE: &str = "[candidates.vent]\nparameters = { q = { unit = \"W/K\", min = 0.0, start = 0.1 } }\nterms = { T = \"-q*max(T - 60, 0)\" }\n";

/// k = 0.4 W/K, g = 0.6 W/%, every 5 s; from row `vent` on there is an additional loss above 60 degC.
fn rows(count: usize, vent: usize) -> String {
    let mut text = String::from("t [s],u [%],y [degC]\n");
    let mut draw = Random(11);
    let (mut t, mut u, mut until) = (20.0_f64, 30.0, 20);
    for k in 0..count {
        if k == until {
            u = (10.0 + 50.0 * draw.uniform()).round();
            until += 20 + draw.below(40);
        }
        writeln!(text, "{},{u},{:.4}", 5 * k, t + 0.2 * draw.normal()).unwrap();
        for _ in 0..50 {
            let lost = if k < vent {
                0.0
            } else {
                0.3 * (t - 60.0).max(0.0)
            };
            t += 0.1 * (0.6 * u - 0.4 * (t - 20.0) - lost) / 50.0;
        }
    }
    text
}

fn place(candidates: &str) -> Place {
    let place = Place::empty();
    place.write("block.mo", BLOCK);
    place.write(
        "m.toml",
        format!("model = \"block.mo\"\neffects = []\n[columns]\ntime = \"t [s]\"\n{candidates}"),
    );
    place
}

#[test]
fn a_candidate_is_found_with_its_place_added_and_removed() {
    let place = place(CANDIDATE);
    place.write("a.csv", rows(600, 0));
    let said = place.succeeds("diagnose a.csv --model m.toml --json found.json");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(place.json("found.json")["groups"][0][0], "vent", "{said}");
    for part in [
        "It is vent in the equation of T (block), vent_q = 0.",
        "A candidate of the model file, which adds -q*max(T - 60, 0) to T.",
    ] {
        assert!(said.contains(part), "{said}");
    }
    // A parameter with one bound is not reported at a bound.
    let last = place.json("found.json")["steps"][1].clone();
    let own = last["parameters"].as_array().unwrap().iter();
    let own = own.clone().find(|one| one["name"] == "vent_q").unwrap();
    assert!(own["std_error"].as_f64().unwrap() < 0.01, "{own}");
    let said = place.succeeds("effects --model m.toml");
    assert!(said.contains("adds -q*max(T - 60, 0) to T."), "{said}");
    let said = place.succeeds("add vent --model m.toml --from found.json");
    assert!(said.contains("added vent with q = 0."), "{said}");
    let again = place.result("diagnose a.csv --model m.toml");
    assert_eq!(again["verdict"], "adequate");
    let said = place.succeeds("remove vent --model m.toml");
    assert!(said.contains("effects = []"), "{said}");
}

#[test]
fn a_candidate_that_the_model_contains_already_is_named() {
    let again = "[candidates.again]\nparameters = { h = { unit = \"W/K\", start = 0.1 } }\nterms = { T = \"-h*(T - 20)\" }\n";
    let place = place(again);
    place.write("a.csv", rows(200, 200));
    let said = place.succeeds("diagnose a.csv --model m.toml --json found.json");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        said.contains("Note: again cannot be found: its term changes the outputs as the model's parameter k does"),
        "{said}"
    );
    let absorbed = &place.json("found.json")["absorbed"];
    assert_eq!(absorbed[0]["effect"], "again");
    assert_eq!(absorbed[0]["parameter"], "k");
}

/// Another member of a group is added with the size of its single fit.
#[test]
fn what_stands_in_for_an_effect_is_added_with_its_size_too() {
    let other = "[candidates.draught]\nparameters = { w = { unit = \"W/K\", min = 0.0, start = 0.1 } }\nterms = { T = \"-w*max(T - 60.3, 0)\" }\n";
    let place = place(&format!("{CANDIDATE}{other}"));
    place.write("a.csv", rows(150, 0));
    place.succeeds("diagnose a.csv --model m.toml --json found.json");
    let groups = place.json("found.json")["groups"].clone();
    let named: Vec<&str> = groups[0]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_str)
        .collect();
    assert!(
        ["vent", "draught"].iter().all(|own| named.contains(own)),
        "{named:?}"
    );
    for own in named.iter().filter(|own| ["vent", "draught"].contains(own)) {
        let said = place.succeeds(&format!("add {own} --model m.toml --from found.json"));
        assert!(said.contains(&format!("added {own} with ")), "{said}");
        let kept: toml::Table = place.read("m.toml").parse().unwrap();
        let sizes = kept["effect"][*own].as_table().unwrap();
        let size = sizes
            .values()
            .next()
            .and_then(toml::Value::as_float)
            .unwrap();
        assert!((size - 0.3).abs() < 0.02, "{said}");
        place.succeeds(&format!("remove {own} --model m.toml"));
    }
}

/// Alarms of rows that go through a pipe.
fn alarms(place: &Place, rows: &str) -> Vec<Value> {
    let mut child = place
        .command("monitor --model m.toml")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let bytes = rows.as_bytes().to_vec();
    let writer = std::thread::spawn(move || drop(input.write_all(&bytes)));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let events = text
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap());
    // Alarms, with growing evidence.
    events
        .filter(|event| event["verdict"].is_string())
        .collect()
}

#[test]
fn the_monitor_names_a_candidate_that_begins() {
    let rows = rows(2600, 2000);
    let declared = place(CANDIDATE);
    let alarms_with = alarms(&declared, &rows);
    let last = alarms_with.last().unwrap();
    assert_eq!(last["effects"][0], "vent", "{last}");
    assert!(
        (last["size"]["value"].as_f64().unwrap() - 0.3).abs() < 0.1,
        "{last}"
    );
    // Without the candidate another effect is named, or none.
    let alarms_without = alarms(&place(""), &rows);
    let last = alarms_without.last().unwrap();
    assert_ne!(last["effects"][0], "vent", "{last}");
    // A candidate in the model is not tested, and the rows agree with the model.
    let text = declared
        .read("m.toml")
        .replace("effects = []", "effects = [\"vent\"]");
    declared.write("m.toml", text + "[effect.vent]\nq = 0.3\n");
    let with_vent = alarms(&declared, &self::rows(2000, 0));
    assert!(with_vent.is_empty(), "{with_vent:?}");
}
