//! Effects at the ports of a user's own model: added, kept, seen in every command, removed; and what is refused.

mod commands;
mod refused;

use std::fmt::Write;

use serde_json::Value;

use crate::common::Place;

const BLOCK: &str = r#"model Block "a block with a heater, in a room"
  parameter Real k(unit="W/K", min=0) = 0.8;
  parameter Real g(unit="W/%", min=0) = 1.6;
  final parameter Real C(unit="J/K") = 50;
  input Real u(unit="%") "power of the heater";
  input Real Ta(unit="degC") "room";
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20) "block";
equation
  C*der(T) = g*u - k*(T - Ta);
end Block;
"#;

const MODEL: &str = "model = \"block.mo\"   # the block on the bench\neffects = []          # nothing yet\n\n[columns]\ntime = \"t [s]\"\n";

/// Time constant of the sensor that the model lacks [s].
const LAG: f64 = 25.0;

/// A record of the block whose sensor lags, in steps of 5 s; levels of the heater up to `most`.
fn record(rows: usize, most: f64, sigma: f64) -> String {
    let mut text = String::from("t [s],u [%],Ta [degC],y [degC]\n");
    let (mut block, mut sensor) = (20.0, 20.0);
    // A sequence that is the same everywhere.
    let mut state = 7_u64;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
    };
    for k in 0..rows {
        let u = (((k / 17) * 7919) % 13) as f64 * most / 12.0;
        let room = 15.0 + 4.0 * (0.013 * k as f64).sin();
        let noise = sigma * 2.0 * (uniform() + uniform() + uniform());
        writeln!(text, "{},{u:.4},{room:.4},{:.4}", 5 * k, sensor + noise).unwrap();
        for _ in 0..500 {
            let step = 0.01;
            let rate = (2.0 * u - 0.6 * (block - room)) / 50.0;
            sensor += step * (block - sensor) / LAG;
            block += step * rate;
        }
    }
    text
}

fn place() -> Place {
    let place = Place::empty();
    place.write("block.mo", BLOCK);
    place.write("m.toml", MODEL);
    place.write("a.csv", record(400, 36.0, 0.1));
    place
}

fn last(result: &Value) -> &Value {
    result["steps"].as_array().unwrap().last().unwrap()
}

fn parameter(step: &Value, name: &str) -> (f64, Option<f64>) {
    let parameters = step["parameters"].as_array().unwrap();
    let one = parameters.iter().find(|one| one["name"] == name).unwrap();
    (one["value"].as_f64().unwrap(), one["std_error"].as_f64())
}

/// The lag reads too low while the block warms up; with the lag in the model, no region stands out.
#[test]
fn a_comparison_says_where_the_model_fails() {
    let place = place();
    let text = place.succeeds("compare a.csv --model m.toml --json bare.json");
    assert!(text.contains("Where Block fails"), "{text}");
    let bare = place.json("bare.json");
    let output = &bare["steps"][0]["outputs"][0];
    assert_eq!(output["name"], "y");
    assert!(output["tests"]["whiteness_p"].as_f64().unwrap() < 1e-3);
    let failures = &output["failures"];
    let inputs = failures["by_input"].as_array().unwrap();
    let names: Vec<&str> = inputs.iter().map(|u| u["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["u", "Ta"]);
    assert_eq!(inputs[0]["unit"], "%");
    // The only state is read.
    assert_eq!(failures["by_state"].as_array().unwrap().len(), 0);
    let directions = failures["by_direction"].as_array().unwrap();
    let mean = |i: usize| directions[i]["mean"].as_f64().unwrap();
    assert!(mean(0) > 0.5 && mean(2) < -0.5, "{directions:?}");
    let worst = failures["worst"].as_array().unwrap();
    assert!(!worst.is_empty());

    place.write(
        "m.toml",
        MODEL.replace("effects = []", "effects = [\"lag(y)\"]"),
    );
    let text = place.succeeds("compare a.csv --model m.toml --json mended.json");
    assert!(text.contains("Tests of the residual of Block"), "{text}");
    let mended = place.json("mended.json");
    let failures = &mended["steps"][0]["outputs"][0]["failures"];
    assert_eq!(failures["worst"].as_array().unwrap().len(), 0);
    // The block itself is not read any more.
    let states = failures["by_state"].as_array().unwrap();
    assert!(
        states.iter().any(|state| state["name"] == "T"),
        "{states:?}"
    );
}

/// The sentence of an adequate model names the four most likely effects with their minimum detectable sizes, with units.
fn detectable_sizes_are_said(found: &Value, said: &str) {
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    let (_, sizes) = said
        .split_once("A test of one effect alone would have shown ")
        .unwrap();
    // Effects that lower the criterion equally are named once.
    let fall = |single: &Value| single["bic_gain"].as_f64().unwrap();
    let mut singles: Vec<&Value> = found["singles"].as_array().unwrap().iter().collect();
    singles.dedup_by(|next, kept| (fall(next) - fall(kept)).abs() < 0.01);
    let singles = singles.into_iter();
    let detectable = singles.filter(|single| single["smallest_visible"].is_number());
    let mut count = 0;
    for single in detectable.take(4) {
        let effect = single["effect"].as_str().unwrap();
        let (_, size) = sizes.split_once(&format!("{effect} of ")).unwrap();
        let (number, rest) = size.split_once([' ', ',']).unwrap();
        let shown: f64 = number.trim_end_matches('.').parse().unwrap();
        let smallest = single["smallest_visible"].as_f64().unwrap();
        assert!((shown / smallest - 1.0).abs() < 0.051, "{effect} {size}");
        let unit = single["sizes"][0]["unit"].as_str().unwrap();
        assert!(unit == "1" || rest.starts_with(unit), "{effect} {size}");
        count += 1;
    }
    assert_eq!(count, 4);
}

#[test]
fn what_a_diagnosis_finds_is_added_and_the_error_falls() {
    let place = place();
    let bare = place.result("compare a.csv --model m.toml");
    place.succeeds("diagnose a.csv --model m.toml --json found.json");
    let found = place.json("found.json");
    let groups = found["groups"].as_array().unwrap();
    assert_eq!(groups.len(), 1, "{groups:?}");
    let named = groups[0].as_array().unwrap();
    assert!(named.iter().any(|id| id == "lag(y)"), "{named:?}");
    let said = place.succeeds("add lag(y) --model m.toml --from found.json");
    assert!(said.contains("added lag(y) with tau = "), "{said}");
    let text = place.read("m.toml");
    assert!(
        text.starts_with("model = \"block.mo\"   # the block on the bench\neffects = [\"lag(y)\"]          # nothing yet\n"),
        "{text}"
    );
    let table: toml::Table = text.parse().unwrap();
    let kept = &table["effect"]["lag(y)"];
    assert_eq!(kept["record"]["duration"].as_float(), Some(1995.0));
    assert_eq!(kept["record"]["interval"].as_float(), Some(5.0));

    // The error falls to the noise, and the fitted values are the hidden ones.
    let mended = place.result("compare a.csv --model m.toml");
    assert_eq!(mended["effects"][0], "lag(y)");
    let (before, after) = (&bare["steps"][0], &mended["steps"][0]);
    let [before, after] = [before, after].map(|step| step["rmse"].as_f64().unwrap());
    assert!(before > 10.0 * after && after < 0.11, "{before} {after}");
    let (tau, error) = parameter(&mended["steps"][0], "lag_y_tau");
    assert!((tau - LAG).abs() < 4.0 * error.unwrap(), "{tau} {error:?}");
    let sizes = [("k", 0.6), ("g", 2.0)];
    for (name, value) in sizes {
        let (fitted, error) = parameter(&mended["steps"][0], name);
        assert!(
            (fitted - value).abs() < 4.0 * error.unwrap(),
            "{name} {fitted}"
        );
    }
    // The effect belongs to the believed model now: nothing more is missing.
    let said =
        place.succeeds("diagnose a.csv --model m.toml --json again.json --report again.html");
    let again = place.json("again.json");
    assert_eq!(again["verdict"], "adequate");
    detectable_sizes_are_said(&again, &said);
    assert!(place.read("again.html").contains("Visible part"));
    let rmse = again["steps"][0]["rmse"].as_f64().unwrap();
    assert!((rmse / after - 1.0).abs() < 0.01, "{rmse} {after}");

    // After removal the table is kept, and the model is as before.
    let said = place.succeeds("remove lag(y) --model m.toml");
    assert!(
        said.contains("effects = []") && said.contains("is kept in the file"),
        "{said}"
    );
    let again = place.result("compare a.csv --model m.toml");
    let rmse = again["steps"][0]["rmse"].as_f64().unwrap();
    assert!((rmse / before - 1.0).abs() < 1e-6, "{rmse} {before}");
    place.succeeds("add lag(y) --model m.toml");
    assert_eq!(place.read("m.toml"), text);
}

#[test]
fn without_a_result_the_effect_is_fitted_from_its_own_starts() {
    let place = place();
    place.succeeds("add lag(y) --model m.toml");
    assert_eq!(
        place.read("m.toml"),
        MODEL.replace("effects = []", "effects = [\"lag(y)\"]")
    );
    let mended = place.result("compare a.csv --model m.toml");
    assert!(mended["steps"][0]["rmse"].as_f64().unwrap() < 0.11);
    assert_eq!(mended["record_numbers"]["lag(y)"]["duration"], 1995.0);
    let said = place.succeeds("compare a.csv --model m.toml");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("note: lag(y) is written in numbers of these records (duration = 1995, interval = 5.000)"), "{said}");
    // A comparison and a diagnosis give the same result.
    place.succeeds("compare a.csv --model m.toml --json fit.json");
    place.succeeds("add lag(y) --model m.toml --from fit.json");
    assert!(
        !place
            .succeeds("compare a.csv --model m.toml")
            .contains("lag(y) is written in")
    );
    let table: toml::Table = place.read("m.toml").parse().unwrap();
    let tau = table["effect"]["lag(y)"]["tau"].as_float().unwrap();
    let (fitted, _) = parameter(&mended["steps"][0], "lag_y_tau");
    assert!((tau / fitted - 1.0).abs() < 1e-4, "{tau} {fitted}");
    // A fixed parameter is not fitted.
    let fixed = place
        .read("m.toml")
        .replace("tau = ", "fixed = [\"tau\"]\ntau = ");
    place.write(
        "m.toml",
        fixed.replace(&format!("tau = {tau}"), "tau = 20.0"),
    );
    let held = place.result("compare a.csv --model m.toml");
    assert_eq!(parameter(&held["steps"][0], "lag_y_tau"), (20.0, None));
}

#[test]
fn the_mended_model_is_written_and_read_and_runs() {
    let place = place();
    place.succeeds("add lag(y) --model m.toml");
    let mended = place.result("compare a.csv --model m.toml");
    place.succeeds("export m.toml a.csv --modelica mended.mo --csv fit.csv");
    let said = place.succeeds("check mended.mo");
    assert!(said.contains("lag_y_tau"), "{said}");
    // Its text is a complete model, with the fitted values.
    place.write(
        "mended.toml",
        "model = \"mended.mo\"\n[columns]\ntime = \"t [s]\"\n",
    );
    let alone = place.result("compare a.csv --model mended.toml");
    let rmse = |result: &Value| result["steps"][0]["rmse"].as_f64().unwrap();
    assert!((rmse(&alone) / rmse(&mended) - 1.0).abs() < 1e-3);
    // Without a fit it gives the curves of the fit.
    place.succeeds("simulate mended.toml a.csv --out y.csv");
    let column = |name: &str, at: usize| -> Vec<f64> {
        let text = place.read(name);
        let rows = text.lines().skip(1);
        rows.map(|row| row.split(',').nth(at).unwrap().parse().unwrap())
            .collect()
    };
    let at = place
        .read("fit.csv")
        .lines()
        .next()
        .unwrap()
        .split(',')
        .position(|c| c.starts_with("y model"))
        .unwrap();
    let (fit, run) = (column("fit.csv", at), column("y.csv", 1));
    assert_eq!(fit.len(), run.len());
    for (a, b) in fit.iter().zip(&run).skip(40) {
        assert!((a - b).abs() < 0.05, "{a} {b}");
    }
}

#[test]
fn an_effect_means_the_same_beside_another_record() {
    let place = place();
    place.write("b.csv", record(200, 24.0, 0.0));
    let bent = |record: &str| {
        format!(
            "model = \"block.mo\"\neffects = [\"nonlinearity(u)\"]\n[columns]\ntime = \"t [s]\"\n[effect.\"nonlinearity(u)\"]\nbend = 0.2\n{record}"
        )
    };
    let runs = |record: &str, inputs: &str| -> Vec<f64> {
        place.write("m.toml", bent(record));
        place.succeeds(&format!("simulate m.toml {inputs} --out y.csv"));
        let text = place.read("y.csv");
        std::fs::remove_file(place.path("y.csv")).unwrap();
        let rows = text.lines().skip(1);
        rows.map(|row| row.split(',').nth(1).unwrap().parse().unwrap())
            .collect()
    };
    let kept = "record = { high = 36.0, low = 0.0, width = 36.0 }\n";
    let whole = runs(kept, "a.csv");
    // The first rows alone have a smaller range; the curvature is that of the whole record.
    let first: String = place
        .read("a.csv")
        .lines()
        .take(60)
        .collect::<Vec<_>>()
        .join("\n");
    place.write("first.csv", first + "\n");
    let part = runs(kept, "first.csv");
    assert!(part.len() == 59 && part.iter().zip(&whole).all(|(a, b)| (a - b).abs() < 1e-6));
    // Other numbers are another bend.
    let other = runs(
        "record = { high = 24.0, low = 0.0, width = 24.0 }\n",
        "b.csv",
    );
    let same = runs(kept, "b.csv");
    assert!(other.iter().zip(&same).any(|(a, b)| (a - b).abs() > 0.5));
    // Without the kept values the curvature is not defined.
    place.write("m.toml", bent(""));
    place.refuses(
        "simulate m.toml b.csv --out z.csv",
        &[
            "m.toml: nonlinearity(u) is written in numbers of a record (high, low, width)",
            "--from",
        ],
    );
}

#[test]
fn a_candidate_of_the_file_is_added_by_its_name() {
    let place = place();
    let file = format!(
        "{MODEL}[candidates.second_store]\nparameters = {{ h = {{ start = 0.1, min = 0.0 }}, c2 = {{ start = 20.0, min = 0.1 }} }}\n\
         states = {{ Tw = {{ unit = \"degC\", start = 20.0, equation = \"c2*der(Tw) = h*(T - Tw)\" }} }}\nterms = {{ T = \"-h*(T - Tw)\" }}\n"
    );
    place.write("m.toml", &file);
    place.succeeds("add second_store --model m.toml");
    assert_eq!(
        place.read("m.toml"),
        file.replace("effects = []", "effects = [\"second_store\"]")
    );
    let mended = place.result("compare a.csv --model m.toml");
    let (bare, _) = (place.succeeds("remove second_store --model m.toml"), 0);
    assert!(bare.contains("effects = []"));
    let before = place.result("compare a.csv --model m.toml");
    let rmse = |result: &Value| result["steps"][0]["rmse"].as_f64().unwrap();
    assert!(
        rmse(&mended) <= rmse(&before),
        "{} {}",
        rmse(&mended),
        rmse(&before)
    );
    assert!(parameter(last(&mended), "second_store_h").0 >= 0.0);
}
