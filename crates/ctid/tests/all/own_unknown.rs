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
    for row in 0..420 {
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
        shape.starts_with("place,variable,at [W],value ["),
        "{shape}"
    );
    assert_eq!(shape.lines().count(), 26);
    // The report shows the same function, and the command that keeps it.
    let report = place.read("r.html");
    for part in [
        "plot-unknown-shape",
        &format!("\"effect\":\"{effect}\""),
        "ctid add NAME --model M.toml --from RESULT.json",
    ] {
        assert!(report.contains(part), "{part}");
    }
    // The table is not enough for a model.
    place.refuses(
        "add my_shape --model m.toml --from shape.csv",
        &["shape.csv", effect, "--json RESULT.json", "ctid add NAME"],
    );
    let text = place.read("m.toml");
    place.succeeds(&format!("add {effect} --model m.toml --from found.json"));
    let before = found["steps"][0]["rmse_per_output"]["y"].as_f64().unwrap();
    let mended = place.result("compare a.csv --model m.toml");
    let after = mended["steps"][0]["rmse_per_output"]["y"].as_f64().unwrap();
    assert!(after < 0.5 * before, "{before} falls to {after}");
    place.write("m.toml", text);
    the_term_has_a_name_of_ones_choice(&place, effect, &mended);
}

/// The function under a name is the function, with other names of its parameters. `found.json` has it; `mended`: the fit with it.
fn the_term_has_a_name_of_ones_choice(place: &Place, effect: &str, mended: &serde_json::Value) {
    for (name, parts) in [
        ("k", ["`k` is a variable of Block", "choose another name"]),
        ("der", ["`der` is a reserved word", "choose another name"]),
        ("my-loss", ["begins with a letter", "as `heat_loss`"]),
        ("lag_u", ["a variable of lag(u)", "choose another name"]),
        (
            "lag",
            ["lag may act here", "the missing term of the result"],
        ),
    ] {
        place.refuses(
            &format!("add {name} --model m.toml --from found.json"),
            &parts,
        );
    }
    place.refuses("add my_heater --model m.toml", &["is not an effect"]);
    let said = place.succeeds("add my_heater --model m.toml --from found.json");
    assert!(
        said.contains(&format!("added my_heater, {effect}, with h0 = ")),
        "{said}"
    );
    let text = place.read("m.toml");
    assert!(
        text.contains(&format!("[effect.my_heater]\nfunction = \"{effect}\"\n")),
        "{text}"
    );
    let compare = "compare a.csv --model m.toml";
    let named = place.result(compare);
    let errors = |fit: &serde_json::Value| fit["steps"][0]["rmse_per_output"].clone();
    assert_eq!(errors(&named), errors(mended));
    assert_eq!(named["effects"], serde_json::json!(["my_heater"]));
    let parameters = named["steps"][0]["parameters"].to_string();
    assert!(parameters.contains("my_heater_h6"), "{parameters}");
    assert!(!parameters.contains("shape"), "{parameters}");
    assert!(!named["record_numbers"]["my_heater"].is_null());
    place.refuses(
        &format!("add {effect} --model m.toml --from found.json"),
        &["my_heater", effect, "are the same function"],
    );
    place.refuses(
        "add my_heater --model m.toml --from found.json",
        &["this file has as", "give another name"],
    );
    place.succeeds("check m.toml");
    place.succeeds("export m.toml a.csv --modelica with.mo");
    let exported = place.read("with.mo");
    assert!(exported.contains("my_heater_h0"), "{exported}");
    assert!(!exported.contains("shape"), "{exported}");
    place.succeeds("diagnose a.csv --model m.toml --json again.json --report again.html");
    let found = place.json("again.json");
    let first = found["steps"][0]["rmse_per_output"]["y"].as_f64().unwrap();
    let fitted = errors(mended)["y"].as_f64().unwrap();
    assert!((first / fitted - 1.0).abs() < 1e-3, "{first} {fitted}");
    assert!(!found["record_numbers"]["my_heater"].is_null());
    assert_ne!(found["unknown"]["effect"], effect);
    assert!(place.read("again.html").contains("my_heater"));
    // The result of a fit with the term has its values; removed, its table stays, and it can be added again.
    place.write("fit.json", named.to_string());
    let said = place.succeeds("add my_heater --model m.toml --from fit.json");
    assert!(said.contains("kept my_heater"), "{said}");
    let said = place.succeeds("remove my_heater --model m.toml");
    assert!(
        said.contains("effects = []") && said.contains("kept in the file"),
        "{said}"
    );
    let bare = place.result(compare);
    assert_ne!(errors(&bare), errors(mended));
    place.succeeds("add my_heater --model m.toml");
    let again = errors(&place.result(compare))["y"].as_f64().unwrap();
    assert!((again / fitted - 1.0).abs() < 1e-3, "{again} {fitted}");
}

/// A function that the model cannot have, and a name that it has already.
#[test]
fn the_table_of_a_term_is_checked() {
    let place = Place::empty();
    place.write("block.mo", BLOCK);
    place.write("a.csv", heated(2));
    for (name, function, parts) in [
        (
            "heater",
            "shape(T,v)",
            ["not a smooth function", "did you mean"],
        ),
        (
            "heater",
            "lag(u)",
            ["not a smooth function", "`ctid diagnose`"],
        ),
        (
            "k",
            "shape(u)",
            ["`k` is a variable", "choose another name"],
        ),
    ] {
        let text = format!(
            "model = \"block.mo\"\neffects = [\"{name}\"]\n[effect.{name}]\nfunction = \"{function}\"\n"
        );
        place.write("m.toml", text);
        place.refuses("compare a.csv --model m.toml", &parts);
    }
    let two = "model = \"block.mo\"\neffects = [\"one\", \"two\"]\n[effect.one]\nfunction = \"shape(u)\"\n[effect.two]\nfunction = \"shape(u)\"\n";
    place.write("m.toml", two);
    place.refuses(
        "compare a.csv --model m.toml",
        &["one and two are the same function"],
    );
}
