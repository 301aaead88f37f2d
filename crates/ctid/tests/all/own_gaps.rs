//! Records with gaps, of a model of the user's own.

use std::fmt::Write;

use crate::common::{Place, Random};

const BLOCK: &str = r#"model Block
  parameter Real k(unit="W/K", min=0) = 0.1;
  parameter Real g(unit="W", min=0) = 1;
  final parameter Real C(unit="J/K") = 50;
  input Real u(unit="%");
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20);
equation
  C*der(T) = g*u - k*(T - 20);
end Block;
"#;

/// A time constant of 500 s, a row every 5 s; some rows and cells of the heater are missing, at which it does not change.
fn place(lacks: impl Fn(usize) -> bool, empty: impl Fn(usize) -> bool) -> Place {
    let place = Place::empty();
    place.write("block.mo", BLOCK);
    place.write(
        "m.toml",
        "model = \"block.mo\"\neffects = []\n[columns]\ntime = \"t [s]\"\nu = \"u [%]\"\ny = \"y [degC]\"\n",
    );
    let mut text = String::from("t [s],u [%],y [degC]\n");
    let (mut draw, mut temperature) = (Random(3), 20.0);
    for k in 0..600 {
        let u = ((k / 25) * 7 % 5) as f64;
        let y = temperature + 0.05 * draw.normal();
        if !lacks(k) {
            let u = if empty(k) {
                String::new()
            } else {
                u.to_string()
            };
            writeln!(text, "{},{u},{y:.4}", 5 * k).unwrap();
        }
        let decay = (-0.01_f64).exp();
        temperature = 20.0 + decay * (temperature - 20.0) + (1.0 - decay) * u / 0.1;
    }
    place.write("r.csv", text);
    place
}

#[test]
fn gaps_are_said_and_initial_states_named_by_their_part() {
    let place = place(|k| (200..260).contains(&k), |k| k % 25 == 12);
    let said = place.succeeds("compare r.csv --model m.toml");
    let flat = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        flat.contains("60 rows are missing in")
            && flat.contains("the simulation restarts after 1, where the input would have to be held longer than 10 % of the fastest time constant ("),
        "{said}"
    );
    assert!(
        said.contains("T(0), part 1") && said.contains("T(0), part 2"),
        "{said}"
    );
    // One plot of the record, not one for each part.
    assert_eq!(said.matches("measured and model").count(), 1);
    let found = place.result("diagnose r.csv --model m.toml");
    assert_eq!(found["verdict"], "adequate");
    assert_eq!(
        (&found["gaps"]["cut"], &found["gaps"]["rows"]),
        (&1.into(), &60.into())
    );
    let time_constant = found["gaps"]["time_constant"].as_f64().unwrap();
    assert!(
        (time_constant / 500.0 - 1.0).abs() < 0.1,
        "{time_constant} s"
    );
    place.write("other.csv", place.read("r.csv"));
    place.succeeds("diagnose r.csv --model m.toml --test other.csv --report r.html");
    assert!(
        place
            .read("r.html")
            .contains("the simulation restarts after")
    );
}

#[test]
fn a_short_gap_does_not_cut_a_record() {
    let place = place(|k| (205..211).contains(&k), |_| false);
    let found = place.result("compare r.csv --model m.toml");
    let names = found["steps"][0]["parameters"].as_array().unwrap();
    let names: Vec<&str> = names
        .iter()
        .map(|one| one["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["k", "g", "C", "T(0)"]);
    assert_eq!(found["gaps"]["held"], 1);
}
