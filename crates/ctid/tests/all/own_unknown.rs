//! The unexplained function: its place, its variable, its file, and its use in the model.

use std::fmt::Write;

use crate::common::{Place, Random};

const BLOCK: &str = r#"model Block "heated block"
  parameter Real C(unit="J/K", min=0) = 40 "heat capacity";
  parameter Real k(unit="W/K", min=0) = 0.4 "loss to the room";
  final parameter Real Ta(unit="degC") = 20 "room";
  input Real u(unit="W") "heater";
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20);
equation
  C*der(T) = u - k*(T - Ta);
end Block;
"#;

/// Output of the heater: smoothed stairs, which no effect of the catalogue has.
fn given(u: f64) -> f64 {
    u + 5.0 * (u / 2.6).sin()
}

/// Temperature of the block, every 10 s.
fn heated(seed: u64) -> String {
    let mut text = String::from("t [s],u [W],y [degC]\n");
    let mut draw = Random(seed);
    let (c, k) = (50.0_f64, 0.5_f64);
    let decay = (-10.0 * k / c).exp();
    let mut above = 0.0;
    for row in 0..700 {
        let u = ((row / 25) * 13 % 37) as f64;
        writeln!(
            text,
            "{},{u},{:.4}",
            10 * row,
            20.0 + above + 0.1 * draw.normal()
        )
        .unwrap();
        above = decay * above + (1.0 - decay) * given(u) / k;
    }
    text
}

#[test]
fn a_shape_that_no_effect_has_is_found_and_kept() {
    let place = Place::empty();
    place.write("block.mo", BLOCK);
    let model =
        "model = \"block.mo\"\n[columns]\ntime = \"t [s]\"\nu = \"u [W]\"\ny = \"y [degC]\"\n";
    place.write("m.toml", model);
    place.write("a.csv", heated(1));
    let said = place.succeeds(
        "diagnose a.csv --model m.toml --json found.json --unknown shape.csv --report r.html",
    );
    let found = place.json("found.json");
    assert!(
        ["unexplained", "partial"].contains(&found["verdict"].as_str().unwrap()),
        "{said}"
    );
    let unknown = &found["unknown"];
    assert_eq!(unknown["variable"], "u", "{said}");
    assert!(unknown["share"].as_f64().unwrap() > 0.8, "{said}");
    let effect = unknown["effect"].as_str().unwrap();
    assert!(said.contains(effect), "{said}");
    let shape = place.read("shape.csv");
    assert!(
        shape.starts_with("place,variable,at [W],value [W],std_error [W]\n"),
        "{shape}"
    );
    assert_eq!(shape.lines().count(), 26);
    // The report shows the same function, and the command that keeps it.
    let report = place.read("r.html");
    for part in [
        "plot-unknown-shape".to_string(),
        format!("\"effect\":\"{effect}\""),
        format!("ctid add &#39;{effect}&#39; --model M.toml --from RESULT.json"),
    ] {
        assert!(report.contains(&part), "{part}");
    }
    // The table is not enough for a model, and the term keeps its name.
    place.refuses(
        "add my_shape --model m.toml --from shape.csv",
        &[
            "shape.csv",
            "--json RESULT.json",
            &format!("ctid add '{effect}'"),
        ],
    );
    place.refuses(
        "add my_shape --model m.toml --from found.json",
        &[
            "\"my_shape\" is no effect",
            &format!("the missing term of the result is {effect}"),
        ],
    );
    place.succeeds(&format!("add {effect} --model m.toml --from found.json"));
    let before = found["steps"][0]["rmse_per_output"]["y"].as_f64().unwrap();
    let mended = place.result("compare a.csv --model m.toml");
    let after = mended["steps"][0]["rmse_per_output"]["y"].as_f64().unwrap();
    assert!(after < 0.5 * before, "{before} falls to {after}");
}
