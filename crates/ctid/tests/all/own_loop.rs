//! `[controller.u]` of a user's own model: `identify` uses it, and fits simulate the loop.

use std::fmt::Write;

use crate::common::{Place, Random};

const TEXT: &str = r#"model Plant "first order"
  parameter Real K(unit="cm/V") = 1;
  parameter Real tau(unit="min", min=0) = 2;
  input Real u(unit="V");
  output Real y(unit="cm") = x;
  Real x(unit="cm", start=0);
equation
  tau*der(x) = K*u - x;
end Plant;
"#;

fn file(gain: f64) -> String {
    format!(
        "model = \"plant.mo\"\n[columns]\ntime = \"t [min]\"\nu = \"u [V]\"\ny = \"y [mm]\"\n\
         [controller.u]\ntype = \"PI\"\noutput = \"y\"\nreference = \"r [mm]\"\ngain = {gain:?}\nintegral_time = 1.0\n"
    )
}

/// K = 2 cm/V, tau = 1 min in a loop of gain 0.8 V/cm and an integral time of 1 min, every second; lengths in mm.
fn record() -> String {
    let mut text = String::from("t [min],r [mm],u [V],y [mm]\n");
    let mut draw = Random(5);
    let (mut x, mut integral, mut noise) = (0.0_f64, 0.0, 0.0);
    for k in 0..2400 {
        let r = if k < 60 {
            0.0
        } else {
            ((k / 45) * 7 % 5) as f64 - 2.0
        };
        noise = 0.9 * noise + 0.05 * draw.normal();
        let y = x + noise;
        let e = r - y;
        let u = 0.8 * (e + integral / 60.0);
        writeln!(
            text,
            "{:.10},{:.3},{u:.6},{:.5}",
            f64::from(k) / 60.0,
            10.0 * r,
            10.0 * y
        )
        .unwrap();
        integral += e;
        let decay = (-1.0_f64 / 60.0).exp();
        x = decay * x + (1.0 - decay) * 2.0 * u;
    }
    text
}

fn place() -> Place {
    let place = Place::empty();
    place.write("plant.mo", TEXT);
    place.write("m.toml", file(0.8));
    place.write("loop.csv", record());
    place
}

#[test]
fn identify_works_with_the_controller_in_the_units_of_the_model() {
    let place = place();
    let said =
        place.succeeds("identify loop.csv --model m.toml --method fcloe --order 1,0 --json i.json");
    // Gain and integral time in V/cm and s.
    assert!(
        said.contains("controller: (0.01333 + 0.8000 s)/(1.000 s)"),
        "{said}"
    );
    let found = place.json("i.json");
    for (name, truth) in [("a1", 60.0), ("b0", 2.0)] {
        let mut all = found["parameters"].as_array().unwrap().iter();
        let one = all.find(|one| one["name"] == name).unwrap();
        let [value, error] = ["value", "std_error"].map(|key| one[key].as_f64().unwrap());
        assert!(
            (value - truth).abs() < 4.0 * error && error < 0.1 * truth,
            "{said}"
        );
    }
    // Another controller is detected.
    place.write("other.toml", file(2.4));
    place.refuses(
        "identify loop.csv --model other.toml --method fcloe --order 1,0",
        &["the measured command disagrees with the controller of the model file"],
    );
}

/// Estimate and standard error of a parameter in the last step of a result.
fn estimate(found: &serde_json::Value, name: &str) -> [f64; 2] {
    let steps = found["steps"].as_array().unwrap();
    let all = steps.last().unwrap()["parameters"].as_array().unwrap();
    let one = all.iter().find(|one| one["name"] == name).unwrap();
    ["value", "std_error"].map(|key| one[key].as_f64().unwrap())
}

/// Words of a text, whatever the lines.
fn unfolded(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn the_loop_is_simulated_in_the_units_of_the_model() {
    let place = place();
    for command in ["compare", "diagnose"] {
        let said = place.succeeds(&format!("{command} loop.csv --model m.toml --json r.json"));
        let said = unfolded(&said);
        assert!(
            said.contains("The loop is simulated from its reference"),
            "{said}"
        );
        let found = place.json("r.json");
        assert_eq!(found["control_loop"]["simulated"], true);
        assert!(found["control_loop"]["mismatch"].as_f64().unwrap() < 1e-3);
        for (name, truth) in [("K", 2.0), ("tau", 1.0)] {
            let [value, error] = estimate(&found, name);
            assert!(
                (value - truth).abs() < 4.0 * error && error < 0.05 * truth,
                "{command}, {name}: {value} {error}"
            );
        }
        let measured = format!("{command} loop.csv --model m.toml --loop measured --json r.json");
        let said = unfolded(&place.succeeds(&measured));
        assert!(
            said.contains("The loop is not simulated: as requested"),
            "{said}"
        );
        let found = place.json("r.json");
        assert_eq!(found["control_loop"]["simulated"], false);
        // With the bias of feedback in the standard error, the interval is wider and contains the true value too.
        let [value, error] = estimate(&found, "K");
        assert!((value - 2.0).abs() < 4.0 * error, "{value} {error}");
    }
    // Without its controller in the file, feedback is detected.
    let file = file(0.8);
    place.write("m.toml", &file[..file.find("[controller").unwrap()]);
    let said = unfolded(&place.succeeds("compare loop.csv --model m.toml"));
    let detected = "Feedback detected: u depends on the last 7 residuals";
    assert!(said.contains(detected), "{said}");
    assert!(said.contains("has no [controller.u]"), "{said}");
}

#[test]
fn a_loop_that_is_not_simulated_says_why() {
    let place = place();
    let compared = |file: String, why: &str| {
        place.write("m.toml", file);
        let said = unfolded(&place.succeeds("compare loop.csv --model m.toml"));
        let said = said.split_once("The loop is not simulated: ").unwrap().1;
        assert!(said.starts_with(why), "{said}");
    };
    let without_reference = file(0.8).replace("reference = \"r [mm]\"\n", "");
    compared(without_reference, "loop.csv: the record has no reference");
    compared(file(1.6), "the measured command disagrees");
    // Exports and simulations say it too; in a simulation without a fit, given inputs are used as they are.
    for command in [
        "simulate m.toml loop.csv --out y.csv --fit loop.csv",
        "export m.toml loop.csv --csv curves.csv",
    ] {
        let said = unfolded(&place.succeeds(command));
        assert!(said.contains("The loop is not simulated"), "{said}");
    }
    let said = unfolded(&place.succeeds("simulate m.toml loop.csv --out z.csv"));
    assert!(!said.contains("The loop"), "{said}");
    // An invalid controller is reported with its line.
    place.write("m.toml", file(0.8).replace("controller.u", "controller.w"));
    place.refuses(
        "compare loop.csv --model m.toml",
        &["m.toml:6: w is not an input of Plant: it has u"],
    );
    place.write("m.toml", file(0.8).replace("r [mm]", "set [mm]"));
    // A reference that the record lacks.
    let said = unfolded(&place.succeeds("compare loop.csv --model m.toml"));
    assert!(said.contains("the record has no reference"), "{said}");
}
