//! `ctid check` through the program.

use std::path::Path;

use crate::common::Place;

/// The model of the document.
fn documented() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/model-text.md");
    let text = std::fs::read_to_string(path).unwrap();
    let (_, rest) = text.split_once("```modelica\n").unwrap();
    let (model, _) = rest.split_once("```").unwrap();
    model.to_string()
}

#[test]
fn it_says_what_a_model_holds() {
    let place = Place::empty();
    place.write("block.mo", documented());
    let text = place.succeeds("check block.mo");
    let lines: Vec<String> = text
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
        .collect();
    for line in [
        "HeatedBlock: a block with a heater, in a room",
        "1 state, 2 inputs, 1 output, 3 parameters; linear in states and inputs",
        "T [degC] start 20 fitted block",
        "y [degC] = T",
        "C [J/K] = 50 fitted, at least 0 heat capacity",
        "loss [W] = k*(T - Ta)",
    ] {
        assert!(lines.iter().any(|own| own == line), "{line}\n{text}");
    }
    assert!(!text.contains("warning"), "{text}");
    let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "simulated exactly; time constant at the start values 500, in the equations' unit of time",
        "such records determine only a combination of C, k, g: fix one",
    ] {
        assert!(said.contains(part), "{part}\n{text}");
    }
    place.write("m.toml", "model = \"block.mo\"\n[known]\nC = 52.0\n");
    let known = place.succeeds("check m.toml");
    assert!(
        known.contains("such records determine all parameters"),
        "{known}"
    );
    place.write(
        "block.mo",
        documented().replace("g*u - loss", "g*u - loss*T"),
    );
    let text = place.succeeds("check block.mo");
    let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("not linear in the equation of T"), "{text}");
    assert!(
        said.contains("warning: block.mo:11:3: units in the equation of T: `g*u` is power"),
        "{text}"
    );
}

#[test]
fn what_is_wrong_is_said_in_one_line() {
    let place = Place::empty();
    let refused = |from: &str, to: &str, begins: &str, mend: &str| {
        assert!(documented().contains(from));
        place.write("block.mo", documented().replace(from, to));
        place.refuses("check block.mo", &[&format!("block.mo:{begins}"), mend]);
    };
    refused(
        "k*(T - Ta)",
        "kk*(T - Ta)",
        "9:25: `kk` is not declared",
        "did you mean `k`",
    );
    refused(
        "k*(T - Ta)",
        "2*(T - Ta)",
        "3:18: the parameter `k` is used nowhere",
        "delete it",
    );
    refused("C*der(T)", "connect(a, b)", "11:3: `connect`", "equations");
    place.refuses("check missing.mo", &["missing.mo"]);
}

#[test]
fn it_says_what_can_act_where() {
    let place = Place::empty();
    place.write("block.mo", documented());
    let text = place.succeeds("check block.mo");
    let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "inputs u, Ta: delay, nonlinearity, dead_zone, saturation, gain_drift, backlash, lag",
        "outputs y: lag, delay, nonlinearity, saturation, hysteresis, drift, offset, quantisation",
        "balances T: constant, loss, step, periodic, hidden_state, limit",
        "parameters C, k, g: drift, step, varies_with(p,x)",
    ] {
        assert!(said.contains(part), "{part}\n{text}");
    }
}

#[test]
fn effects_of_a_model_of_ones_own_are_listed_with_its_candidates() {
    let place = Place::empty();
    place.write("block.mo", documented());
    let file = |term: &str| {
        format!(
            "model = \"block.mo\"\n\n[candidates.radiation]\nparameters = {{ e = {{ unit = \"W/K4\", min = 0.0, start = 1e-9 }} }}\nterms = {{ T = \"{term}\" }}\n"
        )
    };
    place.write("m.toml", file("-e*((T + 273.15)^4 - (Ta + 273.15)^4)"));
    let text = place.succeeds("effects --model m.toml");
    for part in [
        "lag(u), lag(Ta)",
        "constant(T)",
        "varies_with(k,T)",
        "of the model file",
        "radiation",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    place.write("m.toml", file("-e*(Tb + 273.15)^4"));
    place.refuses(
        "effects --model m.toml",
        &[
            "m.toml",
            "m.toml:5: ",
            "candidates.radiation.terms.T: 1:5: `Tb` is not declared",
            "did you mean `Ta`?",
        ],
    );
}

#[test]
fn ports_with_the_same_effects_are_listed_together() {
    let place = Place::empty();
    place.write("m.mo", include_str!("../../models/mass-spring.mo"));
    let text = place.succeeds("check m.mo");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    // A position has no balance: it may only stop.
    assert!(
        text.contains(
            "balances v: constant, loss, step, periodic, hidden_state, limit x: limit parameters"
        ),
        "{text}"
    );
}
