//! What is known of parameters beside the records, from the program's outside.

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
    // Two readings of the same error: their mean, and an error of one over the root of two.
    assert!((number(&with, "value") - value - 0.5 * error).abs() < 0.1 * error);
    assert!((number(&with, "std_error") / error - 0.5_f64.sqrt()).abs() < 0.05);
    assert_eq!(number(&with["prior"], "std_error"), error);
    let far = format!("\n[prior]\nalpha = [{}, {error}]\n", value + 40.0 * error);
    place.write("far.toml", model + &far);
    let text = place.succeeds("compare a.csv --model far.toml --report far.html");
    assert!(text.contains("the records disagree with it by"), "{text}");
    assert!(
        place
            .read("far.html")
            .contains("the records disagree with it by")
    );
}
