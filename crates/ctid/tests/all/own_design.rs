//! `ctid design` of a user's own model: at one input or at several, written as a record that the model can be simulated on.

use std::fmt::Write;

use crate::common::{Place, Random};

const PAIR: &str = r#"model Pair "two heated blocks"
  parameter Real k1(unit="W/K", min=0) = 0.8 "loss";
  parameter Real k2(unit="W/K", min=0) = 0.5 "loss";
  final parameter Real C(unit="W.min/K") = 0.8333333;
  input Real u(unit="W") "heater 1";
  input Real w(unit="W") "heater 2";
  output Real y1(unit="degC") = T1;
  output Real y2(unit="degC") = T2;
  Real T1(unit="degC", start=20);
  Real T2(unit="degC", start=20);
equation
  C*der(T1) = u - k1*(T1 - 20);
  C*der(T2) = w - k2*(T2 - 20);
end Pair;
"#;
const FILE: &str = "model = \"pair.mo\"\n[columns]\ntime = \"t [min]\"\nu = \"heater [W]\"\nw = \"other [W]\"\ny1 = \"first [degC]\"\ny2 = \"second [degC]\"\n";

/// Both temperatures every 10 s, the first heater with a delay of 5 s.
fn heated() -> String {
    let mut text = String::from("t [min],heater [W],other [W],first [degC],second [degC]\n");
    let mut draw = Random(1);
    let (mut first, mut second, mut before) = (0.0, 0.0, 0.0);
    for row in 0..400 {
        let (u, w) = (((row / 25) * 13 % 37) as f64, ((row / 18) * 7 % 23) as f64);
        let read = |level: f64, draw: &mut Random| 20.0 + level + 0.2 * draw.normal();
        let (y1, y2) = (read(first, &mut draw), read(second, &mut draw));
        writeln!(text, "{:.6},{u},{w},{y1:.4},{y2:.4}", row as f64 / 6.0).unwrap();
        // In half of the interval the previous command is still active.
        for command in [before, u] {
            let decay = (-5.0 * 0.8 / 50.0_f64).exp();
            first = decay * first + (1.0 - decay) * command / 0.8;
        }
        before = u;
        let decay = (-10.0 * 0.5 / 50.0_f64).exp();
        second = decay * second + (1.0 - decay) * w / 0.5;
    }
    text
}

fn place() -> Place {
    let place = Place::empty();
    place.write("pair.mo", PAIR);
    place.write("m.toml", FILE);
    place.write("a.csv", heated());
    place
}

#[test]
fn an_experiment_at_one_input_or_at_both_is_written_as_a_record() {
    let place = place();
    let said = place.succeeds(
        "design a.csv --model m.toml --between delay(u) lag(u) --input u=0..50 --duration 2000 --json d.json",
    );
    assert!(said.contains("wrote next.csv"), "{said}");
    assert!(said.contains("Hold w = "), "{said}");
    let found = place.json("d.json");
    assert_eq!(found["between"][0]["effect"], "delay(u)");
    assert!(found["experiments"][0]["power"]["power"].as_f64().unwrap() > 1.0);
    let record = place.read("next.csv");
    let mut lines = record.lines();
    assert_eq!(lines.next().unwrap(), "t [min],heater [W],other [W]");
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 201);
    // The last row is that of 2000 s, as the instants of the record are rounded; the heater moves within its range, the other is held.
    assert!((rows[200][0] * 60.0 - 2000.0).abs() < 0.1);
    assert!(
        rows.iter()
            .all(|row| (0.0..=50.0).contains(&row[1]) && row[2] == rows[0][2])
    );
    assert!(rows.iter().any(|row| row[1] != rows[0][1]));
    place.succeeds("simulate m.toml next.csv --fit a.csv --out y.csv");
    // Without a name both inputs change, one by one and together.
    place.succeeds(
        "design a.csv --model m.toml --between delay(u) lag(u) --duration 2000 --json both.json --out both.csv",
    );
    let both = place.json("both.json");
    let experiments = both["experiments"].as_array().unwrap();
    let inputs = |n: usize| {
        experiments
            .iter()
            .any(|e| e["inputs"].as_array().unwrap().len() == n)
    };
    assert!(inputs(1) && inputs(2));
    // One by one also with the other one held at an end of its range.
    let sequences = experiments.iter();
    let sequences = sequences.flat_map(|e| e["inputs"].as_array().unwrap());
    let mut held = sequences.filter(|input| input["kind"] == "constant");
    let ranges = both["ranges"].as_array().unwrap();
    let is_end = |input: &serde_json::Value| {
        let range = ranges.iter().find(|range| range["input"] == input["input"]);
        let range = range.unwrap();
        input["low"] == range["low"] || input["low"] == range["high"]
    };
    assert!(held.by_ref().next().is_some_and(is_end) && held.all(is_end));
    assert_eq!(both["ranges"].as_array().unwrap().len(), 2);
}

#[test]
fn options_that_do_not_go_together_are_refused() {
    let place = place();
    for (options, wanted) in [
        (
            "--between delay(u) lag(u) --range 0 50",
            "--range: Pair has the inputs u, w; choose one with --input NAME",
        ),
        (
            "--between delay(u) lag(u) --input x",
            "--input x: the model has no such input; it has u, w",
        ),
        (
            "--between delay(u) lag(u) --input u=5..1",
            "--input u=5..1: the smaller value comes first",
        ),
        (
            "--between delay(u) lag(u) --input u=5",
            "a range such as u=0..100 is needed",
        ),
        (
            "--between delay(u) delay(u)",
            "an effect cannot be distinguished from itself",
        ),
        ("--between delay(u) clag(u)", "clag(u)"),
    ] {
        place.refuses(&format!("design a.csv --model m.toml {options}"), &[wanted]);
    }
}
