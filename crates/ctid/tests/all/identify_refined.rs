//! SRIVC and RIVC on files: delays, integrators, two inputs, several records, loops, and errors.

use ct_lti::{Hold, Simulator, StateSpace, TransferFunction};
use ct_signals::{excitation, noise};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde_json::Value;

use crate::common::Place;

const ROWS: usize = 1200;

fn steps(every: usize, seed: u32) -> Vec<f64> {
    excitation::prbs(ROWS, every, 2.0, 6.0, seed).unwrap()
}

fn white(sigma: f64, seed: u64) -> Vec<f64> {
    noise::white(ROWS, sigma, &mut ChaCha8Rng::seed_from_u64(seed))
}

/// The response to a held input, a whole number of samples late, from rest at the first value.
fn respond(b: &[f64], a: &[f64], u: &[f64], late: usize) -> Vec<f64> {
    let model = TransferFunction::from_coefficients(b, a).unwrap();
    let mut plant = Simulator::new(StateSpace::controllable(&model).unwrap(), Hold::Zero);
    let value = |k: usize| u[k.saturating_sub(late)] - u[0];
    (0..u.len())
        .map(|k| plant.update(value(k), 1.0).unwrap())
        .collect()
}

fn csv(header: &str, columns: &[&[f64]]) -> String {
    let mut text = format!("{header}\n");
    for k in 0..columns[0].len() {
        let row: Vec<String> = columns.iter().map(|c| c[k].to_string()).collect();
        text += &format!("{k},{}\n", row.join(","));
    }
    text
}

fn add(parts: &[&[f64]]) -> Vec<f64> {
    (0..parts[0].len())
        .map(|k| parts.iter().map(|part| part[k]).sum())
        .collect()
}

/// A parameter of the result is within this number of standard errors of the truth, and its standard error is below a tenth.
fn holds(found: &Value, name: &str, truth: f64) {
    let parameters = found["parameters"].as_array().unwrap();
    let parameter = parameters.iter().find(|p| p["name"] == name).unwrap();
    let [value, error] = ["value", "std_error"].map(|key| parameter[key].as_f64().unwrap());
    assert!((value - truth).abs() < 4.0 * error, "{name}: {parameter}");
    assert!(error < 0.1 * truth.abs(), "{name}: {parameter}");
}

#[test]
fn a_delay_is_estimated_beside_coloured_noise() {
    let place = Place::new();
    let u = steps(20, 9);
    let v = noise::ar1(ROWS, 0.1, 0.8, &mut ChaCha8Rng::seed_from_u64(1));
    let y = add(&[&respond(&[2.0], &[1.0, 8.0], &u, 4), &v, &[30.0; ROWS]]);
    place.write("late.csv", csv("t [s],u [V],y [cm]", &[&u, &y]));
    for delay in ["auto", "0..30"] {
        let command =
            format!("identify late.csv --method rivc --delay {delay} --json {delay}.json");
        let text = place.succeeds(&command);
        for words in ["u(t - delay)", "RIVC", "autoregressive", "converged"] {
            assert!(text.contains(words), "no {words} in {text}");
        }
        let found = place.json(&format!("{delay}.json"));
        holds(&found, "a1", 8.0);
        holds(&found, "b0", 2.0);
        holds(&found, "delay", 4.0);
    }
    // A missing delay, or a delay in another unit, is detected.
    for forgotten in ["", " --delay 0.07"] {
        let text = place.succeeds(&format!("identify late.csv --method rivc{forgotten}"));
        assert!(text.contains("the simulation error depends on"), "{text}");
    }
    let text = place.succeeds("identify late.csv --method srivc --delay 4");
    assert!(!text.contains("the simulation error depends on"), "{text}");
    assert!(text.contains("4.000 s, as given"), "{text}");
    // With several methods, the option applies to those with delays.
    let text = place.succeeds("identify late.csv --method rivc,fcloe --delay auto --report a.html");
    assert!(text.contains("violated"), "{text}");
    assert!(place.read("a.html").contains("rivc"));
}

/// A sampled PI controller fills a leaking vessel; its gains are unknown to the method.
#[test]
fn an_integrator_in_a_loop_of_an_unknown_controller() {
    let place = Place::new();
    let (r, v) = (steps(60, 9), white(0.05, 2));
    let (mut u, mut y) = (Vec::new(), Vec::new());
    let (mut level, mut sum) = (r[0], 0.0);
    for k in 0..ROWS {
        y.push(level + v[k]);
        let error = r[k] - y[k];
        sum += 0.02 * error;
        u.push(0.6 * error + sum);
        level += 0.2 * u[k] - 0.03;
    }
    place.write("loop.csv", csv("t [s],r [cm],u [V],y [cm]", &[&r, &u, &y]));
    let text = place.succeeds(
        "identify loop.csv --method srivc --integrator --json loop.json --report loop.html",
    );
    for words in ["s y = (b0) u + offset", "CLSRIVC", "integrator"] {
        assert!(text.contains(words), "no {words} in {text}");
    }
    let found = place.json("loop.json");
    holds(&found, "b0", 0.2);
    holds(&found, "offset", -0.03);
    assert_eq!(found["parameters"][0]["unit"], "cm/(V s)");
    assert!(place.read("loop.html").contains("CLSRIVC"));
    // Without the integrator the program gives advice.
    let text = place.succeeds("identify loop.csv --method srivc");
    assert!(text.contains("--integrator"), "{text}");
}

/// A column r that belongs to nothing: the program says so, and three names leave it out.
#[test]
fn a_reference_that_explains_nothing() {
    let place = Place::new();
    let (u, r) = (steps(20, 9), steps(33, 13));
    let y = add(&[&respond(&[2.0], &[1.0, 8.0], &u, 0), &white(0.1, 3)]);
    place.write("r.csv", csv("t [s],r [cm],u [V],y [cm]", &[&r, &u, &y]));
    let text = place.succeeds("identify r.csv --method srivc");
    assert!(text.contains("explains only"), "{text}");
    let text = place.succeeds("identify r.csv --method srivc --columns t,u,y --json r.json");
    assert!(text.contains("open loop"), "{text}");
    holds(&place.json("r.json"), "a1", 8.0);
    let text = place.succeeds("identify r.csv --method srivc --columns t,u,y,r");
    assert!(text.contains("CLSRIVC"), "{text}");
}

#[test]
fn two_inputs_and_several_records() {
    let place = Place::new();
    for (name, seed, level) in [("a.csv", 9, 10.0), ("b.csv", 11, 20.0)] {
        let (u, q) = (steps(20, seed), steps(35, seed - 2));
        let y = add(&[
            &respond(&[2.0], &[1.0, 8.0], &u, 0),
            &respond(&[-0.5], &[1.0, 8.0], &q, 0),
            &white(0.1, u64::from(seed)),
            &[level; ROWS],
        ]);
        place.write(name, csv("t [s],u [V],q [l/min],y [cm]", &[&u, &q, &y]));
    }
    let text =
        place.succeeds("identify a.csv b.csv --method srivc --columns t,u+q,y --json both.json");
    for words in ["a.csv, b.csv", "u_2 is q"] {
        assert!(text.contains(words), "no {words} in {text}");
    }
    let found = place.json("both.json");
    holds(&found, "a1", 8.0);
    holds(&found, "b0", 2.0);
    holds(&found, "b0_2", -0.5);
    assert_eq!(found["parameters"][2]["unit"], "cm/(l/min)");
    // Two records give smaller standard errors than one.
    place.succeeds("identify a.csv --method srivc --columns t,u+q,y --json one.json");
    let error = |file: &str| {
        place.json(file)["parameters"][0]["std_error"]
            .as_f64()
            .unwrap()
    };
    let ratio = error("both.json") / error("one.json");
    assert!((0.6..0.85).contains(&ratio), "{ratio}");
}

#[test]
fn what_cannot_be_is_refused() {
    let place = Place::new();
    let identify = |rest: &str| format!("identify tour.csv --model tour.toml {rest}");
    place.refuses(
        &identify("--method srivc --delay -3"),
        &["-3", "at least 0"],
    );
    place.refuses(
        &identify("--method srivc --delay 5..9"),
        &["5..9", "from 0"],
    );
    place.refuses(&identify("--method srivc --delay soon"), &["soon", "auto"]);
    place.refuses(
        &identify("--method srivc --delay 1e6"),
        &["tour.csv", "leaves 0"],
    );
    place.refuses(
        &identify("--method fcloe --delay 3"),
        &["--delay", "srivc and rivc"],
    );
    place.refuses(&identify("--method iv --integrator"), &["--integrator"]);
    place.refuses(&identify("--method rivc --memory 30"), &["--memory"]);
    place.refuses(&identify("--method rivc --levels mean"), &["--levels"]);
    place.refuses(
        "identify tour.csv tour-test.csv --model tour.toml --method fcloe",
        &["one record, and 2 are given", "srivc or rivc"],
    );
    place.refuses(
        "identify tour.csv tour-test.csv --model tour.toml --method rivc --order 1..2",
        &["2 records", "one order"],
    );
    place.refuses(
        "identify tour.csv --columns t,u+r,y --method fcloe",
        &["several inputs", "srivc and rivc"],
    );
    place.refuses(
        "identify tour.csv tour.csv --model tour.toml --method srivc",
        &["tour.csv", "given twice"],
    );
    place.refuses(
        &identify("--method srivc --order 2,2 --delay auto"),
        &["m = n = 2"],
    );
}
