//! A user's own model beside a stream.

use serde_json::Value;

use super::{assert_says, events, fed};
use crate::common::{Place, Random};

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

/// Rows time \[min\], heater, room, block \[degC\], power \[W\], every 30 min; from row `change` on the loss to the room is larger.
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
        // Every sixth power is missing.
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

/// With `time_unit` the model's time is in hours, whatever unit the column of the time has.
#[test]
fn a_time_unit_of_the_model_file_is_that_of_the_estimates() {
    let estimates = |model: &str| -> Value {
        let place = own_place();
        place.write("m.toml", model);
        let outcome = fed(&place, "--estimates", block_rows(3400, 3400));
        assert_eq!(outcome.code, Some(0), "{}", outcome.err);
        let events = events(&outcome.out);
        let estimates = events.iter().find(|e| e["event"] == "estimates");
        estimates.unwrap()["parameters"].clone()
    };
    let per_hour = estimates(OWN);
    let declared = OWN.replace("time = \"t [h]\"", "time = \"t [min]\"\ntime_unit = \"h\"");
    assert_eq!(estimates(&declared), per_hour);
    let per_minute = estimates(&OWN.replace("t [h]", "t [min]"));
    let k = |found: &Value| found[0]["value"].as_f64().unwrap();
    assert_eq!(per_hour[0]["name"], "k");
    assert!(
        (60.0 * k(&per_minute) / k(&per_hour) - 1.0).abs() < 0.05,
        "{per_minute}"
    );
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
    // Its sensor has no lag.
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
    // Rows in a unit that the model does not have.
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

/// Dates of the rows of [`block_rows`] in January and February of 2026, without a change of the clocks.
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

    // Also after a restart; numbers in place of dates are rejected.
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
