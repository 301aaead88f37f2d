//! `[controller.u]` of a user's own model: `identify` uses it, and other commands warn that they run on the measured input.

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

#[test]
fn a_loop_that_is_not_simulated_is_refused_or_said() {
    let place = place();
    let says = [
        "m.toml:6: [controller.u]: the loop of a model of your own cannot be simulated",
        "leave --loop out",
        "write the controller into plant.mo",
    ];
    for command in ["compare", "diagnose"] {
        place.refuses(
            &format!("{command} loop.csv --model m.toml --loop simulated"),
            &says,
        );
    }
    let note = "note: [controller.u]: the loop is not simulated, the model runs on the measured u";
    let unfolded = |text: String| text.split_whitespace().collect::<Vec<_>>().join(" ");
    for command in [
        "compare loop.csv --model m.toml",
        "diagnose loop.csv --model m.toml --loop measured",
        "simulate m.toml loop.csv --out y.csv --fit loop.csv",
        "export m.toml loop.csv --csv curves.csv",
    ] {
        let said = unfolded(place.succeeds(command));
        assert!(said.contains(note), "{said}");
    }
    // In a simulation, given inputs are used as they are.
    let said = unfolded(place.succeeds("simulate m.toml loop.csv --out z.csv"));
    assert!(!said.contains("note: [controller.u]"), "{said}");
    // An invalid controller is reported with its line.
    place.write("m.toml", file(0.8).replace("controller.u", "controller.w"));
    place.refuses(
        "compare loop.csv --model m.toml",
        &["m.toml:6: w is no input of Plant: it has u"],
    );
}
