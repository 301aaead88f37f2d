//! Priors of parameters, through the program.

use serde_json::Value;

use crate::common::{Place, Tanks};

/// A side measurement is one more reading: it narrows a parameter, and where the records disagree they say so.
#[test]
fn a_prior_counts_as_a_reading() {
    let place = Place::empty();
    place.write("a.csv", Tanks::single().csv());
    let model = Tanks::single().model();
    let alpha = |name: &str, prior: &str| {
        place.write(name, model.clone() + prior);
        let result = place.result(&format!("compare a.csv --model {name}"));
        let parameters = result["steps"][0]["parameters"].as_array().unwrap().clone();
        let of = |name: &str| {
            parameters
                .iter()
                .find(|p| p["name"] == name)
                .unwrap()
                .clone()
        };
        of("alpha")
    };
    let number = |parameter: &Value, key: &str| parameter[key].as_f64().unwrap();
    let without = alpha("without.toml", "");
    let (value, error) = (number(&without, "value"), number(&without, "std_error"));
    assert!(without["prior"].is_null());
    let with = alpha(
        "with.toml",
        &format!("\n[prior]\nalpha = [{}, {error}]\n", value + error),
    );
    // Two readings with the same error: their mean, and an error smaller by the root of two.
    assert!((number(&with, "value") - value - 0.5 * error).abs() < 0.1 * error);
    assert!((number(&with, "std_error") / error - 0.5_f64.sqrt()).abs() < 0.05);
    assert_eq!(number(&with["prior"], "std_error"), error);
    // A prior three times as accurate as the record, ten of the record's errors away: 10/sqrt(1 + 1/9) = 9.5 of both together.
    let far = format!(
        "\n[prior]\nalpha = [{}, {}]\n",
        value + 10.0 * error,
        error / 3.0
    );
    place.write("far.toml", model.clone() + &far);
    let text = place.succeeds("compare a.csv --model far.toml --report far.html");
    let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let (_, rest) = said
        .split_once("the records disagree with it by ")
        .unwrap_or_else(|| panic!("{text}"));
    let away: f64 = rest.split(' ').next().unwrap().parse().unwrap();
    assert!((away - 9.5).abs() < 1.0, "{away}");
    place.write("outside.toml", model + "\n[prior]\nalpha = [1e12, 1.0]\n");
    place.refuses(
        "compare a.csv --model outside.toml",
        &["[prior] alpha", "lies between"],
    );
    assert!(
        place
            .read("far.html")
            .contains("the records disagree with it by")
    );
}

/// An effect's prior waits while the effect is off, so that it can be taken out and put in.
#[test]
fn a_prior_of_an_effect_waits_for_it() {
    let place = Place::empty();
    place.write("a.csv", Tanks::single().csv());
    let prior = "\n[prior]\n\"overflow.rim\" = [20.0, 0.5]\n";
    place.write("m.toml", Tanks::single().model() + prior);
    let text = place.succeeds("compare a.csv --model m.toml");
    assert!(
        text.contains("[prior.overflow] has no effect until `ctid add"),
        "{text}"
    );
    place.succeeds("add overflow --model m.toml");
    place.succeeds("remove overflow --model m.toml");
    assert!(place.read("m.toml").ends_with(prior));
}
