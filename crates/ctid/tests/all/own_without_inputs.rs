//! Models of their user's own without inputs: a pendulum that oscillates freely, a ball that falls. Records have time and outputs alone.

use std::fmt::Write;
use std::io::Write as _;
use std::process::Stdio;

use serde_json::Value;

use crate::common::{Place, Random};

const PENDULUM: &str = r#"model Pendulum "free swing, viscous friction"
  parameter Real w2(unit="1/s2", min=0) = 30 "gravity over length";
  parameter Real b(unit="1/s", min=0) = 0.05 "viscous friction";
  output Real theta(unit="rad") = a;
  Real a(unit="rad", start=1) "angle from hanging";
  Real w(unit="rad/s", start=0) "speed";
equation
  der(a) = w;
  der(w) = -w2*sin(a) - b*w;
end Pendulum;
"#;

const BALL: &str = r#"model Ball "a ball that falls"
  final parameter Real g(unit="m/s2") = 9.81;
  output Real y(unit="m") = h;
  Real h(unit="m", start=47) "height";
  Real w(unit="m/s", start=0) "speed, up";
equation
  der(h) = w;
  der(w) = -g;
end Ball;
"#;

const FILE: &str = "effects = []\n[columns]\ntime = \"t [s]\"\n";

/// The angle of a pendulum whose dry friction is `dry` \[1/s2\], every 20 ms.
fn swing(rows: usize, dry: f64, seed: u64) -> String {
    let mut text = String::from("t [s],theta [rad]\n");
    let mut draw = Random(seed);
    let (mut a, mut w): (f64, f64) = (1.2, 0.3);
    for k in 0..rows {
        let noise = 0.002 * draw.normal();
        writeln!(text, "{:.2},{:.6}", 0.02 * k as f64, a + noise).unwrap();
        for _ in 0..200 {
            let step = 1e-4;
            w += step * (-40.0 * a.sin() - 0.1 * w - dry * w.signum());
            a += step * w;
        }
    }
    text
}

/// The height of a ball with a drag of `drag` \[1/m\], every 50 ms.
fn fall(rows: usize, drag: f64, seed: u64) -> String {
    let mut text = String::from("t [s],y [m]\n");
    let mut draw = Random(seed);
    let (mut h, mut w): (f64, f64) = (45.0, -0.5);
    for k in 0..rows {
        let noise = 0.02 * draw.normal();
        writeln!(text, "{:.2},{:.6}", 0.05 * k as f64, h + noise).unwrap();
        for _ in 0..500 {
            let step = 1e-4;
            w += step * (-9.81 - drag * w * w.abs());
            h += step * w;
        }
    }
    text
}

fn place() -> Place {
    let place = Place::empty();
    place.write("pendulum.mo", PENDULUM);
    place.write("p.toml", format!("model = \"pendulum.mo\"\n{FILE}"));
    place.write(
        "ball.toml",
        format!(
            "model = \"ball.mo\"\n{FILE}[candidates.drag]\nparameters = {{ d = {{ unit = \"1/m\", min = 0.0, start = 0.01 }} }}\nterms = {{ w = \"-d*w*abs(w)\" }}\n"
        ),
    );
    place.write("ball.mo", BALL);
    place
}

fn parameter(step: &Value, name: &str) -> (f64, f64) {
    let parameters = step["parameters"].as_array().unwrap();
    let one = parameters.iter().find(|one| one["name"] == name).unwrap();
    (
        one["value"].as_f64().unwrap(),
        one["std_error"].as_f64().unwrap(),
    )
}

fn is_near(step: &Value, name: &str, value: f64) {
    let (fitted, error) = parameter(step, name);
    assert!(
        (fitted - value).abs() < 4.0 * error,
        "{name} = {fitted} +- {error}, and {value} was simulated"
    );
}

#[test]
fn a_pendulum_is_checked_fitted_simulated_and_written() {
    let place = place();
    place.write("a.csv", swing(800, 0.0, 1));
    let said = place.succeeds("check pendulum.mo");
    assert!(
        said.contains("from displaced initial states")
            && said.contains("such records determine all parameters"),
        "{said}"
    );
    assert!(said.contains("2 states, 0 inputs, 1 output"), "{said}");
    assert!(!said.contains("warning"), "{said}");
    let fit = place.result("compare a.csv --model p.toml");
    assert!(fit["control_loop"].is_null(), "{}", fit["control_loop"]);
    for (name, value) in [("w2", 40.0), ("b", 0.1)] {
        is_near(&fit["steps"][0], name, value);
    }
    place.succeeds("export p.toml a.csv --modelica fitted.mo --csv fit.csv");
    assert!(place.succeeds("check fitted.mo").contains("0 inputs"));
    // Times alone are enough to simulate.
    let times: String = place
        .read("a.csv")
        .lines()
        .map(|line| line.split(',').next().unwrap().to_string() + "\n")
        .collect();
    place.write("times.csv", times);
    place.succeeds("simulate p.toml times.csv --out y.csv");
    assert_eq!(place.read("y.csv").lines().count(), 801);
    place.succeeds("simulate p.toml times.csv --fit a.csv --out fitted.csv");
    let said = place.succeeds("effects --model p.toml");
    assert!(
        said.contains("coulomb(w)") && !said.contains("dead_zone"),
        "{said}"
    );
}

#[test]
fn the_friction_that_a_pendulum_lacks_is_found_added_and_removed() {
    let place = place();
    place.write("a.csv", swing(800, 0.12, 2));
    place.write("b.csv", swing(400, 0.12, 3));
    place.succeeds(
        "diagnose a.csv --test b.csv --model p.toml --max-effects 1 --json found.json --report found.html",
    );
    let found = place.json("found.json");
    let group = found["groups"][0].as_array().unwrap();
    assert!(group.iter().any(|id| id == "coulomb(w)"), "{group:?}");
    // There is no plot against a missing input.
    let page = place.read("found.html");
    assert!(!page.contains("Against the input") && !page.contains("past input"));
    place.succeeds("add coulomb(w) --model p.toml --from found.json");
    let mended = place.result("compare a.csv --model p.toml");
    let rmse = mended["steps"][0]["rmse"].as_f64().unwrap();
    assert!(rmse < 0.0023, "{rmse}");
    place.succeeds("remove coulomb(w) --model p.toml");
}

#[test]
fn of_a_falling_ball_only_initial_states_are_fitted() {
    let place = place();
    place.write("smooth.csv", fall(60, 0.0, 4));
    place.write("light.csv", fall(60, 0.05, 5));
    let found = place.result("diagnose smooth.csv --model ball.toml");
    assert_eq!(found["verdict"], "adequate", "{found}");
    is_near(&found["steps"][0], "w(0)", -0.5);
    let found = place.result("diagnose light.csv --model ball.toml");
    let group = found["groups"][0].as_array().unwrap();
    let is_drag = |id: &Value| id == "drag" || id == "quadratic_drag(w)";
    assert!(group.iter().any(is_drag), "{group:?}");
}

#[test]
fn a_monitor_reads_rows_of_time_and_outputs() {
    let place = place();
    let mut command = place.command("monitor --model p.toml");
    command.stdin(Stdio::piped());
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let rows = swing(50, 0.0, 6);
    child
        .stdin
        .take()
        .unwrap()
        .write_all(rows.as_bytes())
        .unwrap();
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert!(
        said.contains("\"t\" is the time, \"theta\" the reading")
            || said.contains("\"t [s]\" is the time, \"theta [rad]\" the reading"),
        "{said}"
    );
}

#[test]
fn a_column_for_an_output_is_still_asked_for() {
    let place = place();
    place.write("a.csv", swing(100, 0.0, 7).replace("theta", "phi"));
    place.refuses(
        "compare a.csv --model p.toml",
        &["set theta = \"...\" under [columns]"],
    );
    place.refuses(
        "identify a.csv --model ball.toml --method all",
        &["Ball has no input, and identify fits one output to one input"],
    );
}
