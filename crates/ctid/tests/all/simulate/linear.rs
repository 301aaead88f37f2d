//! Linear models identified beside their own transfer function.

use std::fmt::Write;

use super::{BLOCK, FILE, TRUTH, place, record};
use crate::common::Place;

/// A block in a room with constant temperature.
fn alone() -> Place {
    let place = place();
    let text = BLOCK.replace("  input Real Ta(unit=\"degC\") \"room\";\n", "");
    place.write("block.mo", text.replace("(T - Ta)", "(T - 20)"));
    place.write("m.toml", FILE.replace("Ta = \"room [degC]\"\n", ""));
    let (k, g, _) = TRUTH;
    let decay = (-k * 10.0 / 52.0).exp();
    let mut t = 20.0;
    let mut text = "t [s],heater [%],block [degC],loss [W]\n".to_string();
    for [time, u, ..] in record(400, 5, 0.0, 20.0) {
        // A small noise without a random generator.
        let v = 0.01 * (time * 0.7).sin() * (time * time).cos();
        writeln!(text, "{time},{u},{},{}", t + v, k * (t - 20.0)).unwrap();
        t = decay * t + (1.0 - decay) * (20.0 + g * u / k);
    }
    place.write("a.csv", text);
    place
}

#[test]
fn a_linear_model_is_identified_beside_its_own_transfer_function() {
    let place = alone();
    place.refuses(
        "identify a.csv --model m.toml --method srivc",
        &[
            "m.toml: HeatedBlock has 2 outputs, y, loss",
            "--output NAME",
        ],
    );
    place.refuses(
        "identify a.csv --model m.toml --method srivc --output z",
        &["HeatedBlock has no output z: it has y, loss"],
    );
    let text =
        place.succeeds("identify a.csv --model m.toml --method srivc --output y --json i.json");
    assert!(
        text.contains("its own transfer function from u to y"),
        "{text}"
    );
    let json = place.json("i.json");
    let own = &json["own_model"];
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    // C/k and g/k of the text and of [known].
    assert!((number(&own["a"][1]) - 520.0).abs() < 1e-9, "{own}");
    assert!((number(&own["b"][0]) - 0.2).abs() < 1e-12, "{own}");
    // The identified model equals the plant.
    let found = |name: &str| {
        let all = json["parameters"].as_array().unwrap();
        number(&all.iter().find(|p| p["name"] == name).unwrap()["value"])
    };
    let (k, g, _) = TRUTH;
    assert!(
        (found("a1") / (52.0 / k) - 1.0).abs() < 0.01,
        "{}",
        found("a1")
    );
    assert!(
        (found("b0") / (g / k) - 1.0).abs() < 0.01,
        "{}",
        found("b0")
    );
    // The heat flow has the same pole; for other orders the program names the comparable one.
    let text =
        place.succeeds("identify a.csv --model m.toml --method srivc --order 2,0 --output y");
    assert!(text.contains("--order 1,0 compares"), "{text}");
    // In minutes the model has another text, and the transfer function in seconds is the same.
    let minutes = place.read("block.mo").replace("C*der(T)", "C/60*der(T)");
    place.write("block.mo", minutes);
    let header = place.read("a.csv").replacen("t [s]", "t [min]", 1);
    let rows = header.lines().map(|line| match line.split_once(',') {
        Some((t, rest)) if t.parse::<f64>().is_ok() => {
            format!("{},{rest}\n", t.parse::<f64>().unwrap() / 60.0)
        }
        _ => format!("{line}\n"),
    });
    place.write("a.csv", rows.collect::<String>());
    place.write("m.toml", place.read("m.toml").replace("t [s]", "t [min]"));
    place.succeeds("identify a.csv --model m.toml --method srivc --output y --json m.json");
    let own = &place.json("m.json")["own_model"];
    assert!((number(&own["a"][1]) - 520.0).abs() < 1e-9, "{own}");
}

#[test]
fn a_model_that_is_not_linear_is_not_identified() {
    let place = alone();
    let text = place.read("block.mo").replace("k*(T - 20)", "k*(T - 20)*T");
    place.write("block.mo", text);
    place.refuses(
        "identify a.csv --model m.toml --method srivc --output y",
        &[
            "m.toml: HeatedBlock is not linear in the equation of loss",
            "`ctid compare`",
        ],
    );
    place.write("tank.toml", "plant = \"single-tank\"\n");
    place.refuses(
        "identify a.csv --model tank.toml --method srivc --output y",
        &["tank.toml", "--input and --output"],
    );
}
