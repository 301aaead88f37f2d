//! An effect that is in the fitted record and not in the held-out one.

use std::fmt::Write;

use crate::common::{Place, Random};

const BLOCK: &str = r#"model Block
  parameter Real k(unit="W/K", min=0) = 0.3;
  parameter Real g(unit="W", min=0) = 1;
  final parameter Real C(unit="J/K") = 50;
  input Real u(unit="%");
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20);
equation
  C*der(T) = g*u - k*(T - 20);
end Block;
"#;

/// A row every 5 s; the sensor drifts by `drift` in a second.
fn rows(drift: f64, seed: u64) -> String {
    let mut text = String::from("t [s],u [%],y [degC]\n");
    let (mut draw, mut temperature) = (Random(seed), 20.0);
    for k in 0..500 {
        let u = ((k / 25) * 7 % 5) as f64;
        let y = temperature + drift * 5.0 * k as f64 + 0.05 * draw.normal();
        writeln!(text, "{},{u},{y:.4}", 5 * k).unwrap();
        let decay = (-0.03_f64).exp();
        temperature = 20.0 + decay * (temperature - 20.0) + (1.0 - decay) * u / 0.3;
    }
    text
}

#[test]
fn an_effect_that_raises_the_held_out_error_is_said() {
    let place = Place::empty();
    place.write("block.mo", BLOCK);
    place.write(
        "m.toml",
        "model = \"block.mo\"\neffects = []\n[columns]\ntime = \"t [s]\"\nu = \"u [%]\"\ny = \"y [degC]\"\n",
    );
    place.write("drifts.csv", rows(4e-4, 5));
    place.write("same.csv", rows(4e-4, 6));
    place.write("none.csv", rows(0.0, 7));
    let said = |test: &str| {
        let said = place.succeeds(&format!(
            "diagnose drifts.csv --model m.toml --test {test} --json {test}.json"
        ));
        said.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let rises = "the error on the held-out records rises (y from";
    let heading = "; but the error on the held-out records rises";
    for (record, is_said) in [("none.csv", true), ("same.csv", false)] {
        let said = said(record);
        assert_eq!(said.contains(rises), is_said, "{said}");
        assert_eq!(said.contains(heading), is_said, "{said}");
    }
    // The held-out record decides nothing.
    place.succeeds("diagnose drifts.csv --model m.toml --json alone.json");
    let [one, other] = ["none.csv.json", "alone.json"].map(|found| place.json(found));
    assert!(one["ranked"].is_array() && one["steps"][1]["parameters"].is_array());
    assert_eq!(one["effects"], other["effects"]);
    assert_eq!(one["ranked"], other["ranked"]);
    assert_eq!(
        one["steps"][1]["parameters"], other["steps"][1]["parameters"],
        "not a bit of the estimates depends on it"
    );
}
