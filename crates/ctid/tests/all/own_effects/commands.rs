//! Effects of a user's own model in the report, in `effects` and in `identify`.

use serde_json::Value;

use super::{MODEL, last, parameter, place, record};

#[test]
fn the_report_shows_the_ports_the_sizes_and_every_output_in_its_unit() {
    let place = place();
    place.write("b.csv", record(200, 24.0, 0.1));
    place.succeeds(
        "diagnose a.csv --test b.csv --model m.toml --report found.html --json found.json",
    );
    let page = place.read("found.html");
    let (_, after) = page.split_once("id=\"data\">").unwrap();
    let data: Value = serde_json::from_str(after.split_once("</script>").unwrap().0).unwrap();
    let found = place.json("found.json");
    assert_eq!(data["outputs"][0]["name"], "y");
    assert_eq!(data["outputs"][0]["unit"], "degC");
    let inputs = data["records"][0]["inputs"].as_array().unwrap();
    let units: Vec<&str> = inputs
        .iter()
        .map(|one| one["unit"].as_str().unwrap())
        .collect();
    assert_eq!(units, ["%", "degC"]);
    let steps = data["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 2);
    for (step, of) in steps.iter().zip(found["steps"].as_array().unwrap()) {
        assert_eq!(step["outputs"][0]["rmse"], of["rmse_per_output"]["y"]);
        assert_eq!(
            step["outputs"][0]["rmse_test"],
            of["rmse_test_per_output"]["y"]
        );
        // Curves and residuals over both records.
        let runs = step["outputs"][0]["runs"].as_array().unwrap();
        let lengths: Vec<usize> = runs
            .iter()
            .map(|run| run["residual"]["y"].as_array().unwrap().len())
            .collect();
        assert_eq!(lengths, [400, 200]);
    }
    assert_eq!(data["scores"][0]["effect"], found["ranked"][0]);
    let text = page.split_once("<main>").unwrap().0;
    assert!(
        text.contains("lag(y) at the output y, which reads T (block)"),
        "{text}"
    );
    let (tau, _) = parameter(last(&found), "lag_y_tau");
    assert!(text.contains(&format!("lag_y_tau = {tau:.2}")), "{text}");
    // A comparison has a page too.
    place.succeeds("compare a.csv --model m.toml --report fit.html");
    assert!(place.read("fit.html").contains("Model against measurement"));
}

#[test]
fn effects_are_found_by_what_is_seen() {
    let place = place();
    let first = |words: &str| {
        let said = place.succeeds(words);
        said.split([',', ' ', '\n'])
            .find(|word| !word.is_empty())
            .unwrap()
            .to_string()
    };
    for (word, effect) in [
        ("late", "delay(u)"),
        ("drift", "gain_drift(u)"),
        ("clog", "drift(k)"),
        ("leak", "constant(T)"),
        ("noisy", "quantisation(y)"),
    ] {
        assert_eq!(
            first(&format!("effects --like {word} --model m.toml")),
            effect,
            "{word}"
        );
    }
    assert_eq!(first("effects --like clog"), "valve_drift");
    place.refuses(
        "effects --like xyzzy",
        &["no effect is described by \"xyzzy\": try one of clog, drift, leak, stick, late, noisy"],
    );
}

#[test]
fn an_effect_is_described_at_its_port_in_the_model() {
    let place = place();
    let of = |words: &str| {
        let said = place.succeeds(words);
        said.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let said = of("effects radiation(T,Ta) --model m.toml");
    for part in [
        "where in the equation of T (block), with Ta (room)",
        "radiation_T_Ta_exchange J/(s.K) 0 exchange per unit of difference",
        "confused with natural_convection(T,Ta), varies_with(p,x), loss(x)",
        "confirm Cover the surface with foil and repeat a hot run.",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // A name without a port: every port where it acts.
    let said = of("effects lag --model m.toml");
    assert!(
        said.contains("lag(u), lag(Ta) ") && said.contains("lag(y) "),
        "{said}"
    );
    // A limit in the words of a temperature.
    let said = of("effects limit(T) --model m.toml");
    assert!(
        said.contains("a thermostat") && !said.contains("a rim"),
        "{said}"
    );
    place.refuses(
        "effects radiaton --model m.toml",
        &["did you mean radiation"],
    );
    assert!(of("effects radiation").contains("confirm Cover the surface with foil"));
    assert!(of("effects --like radiation").starts_with("radiation(T,Ta)"));
}

#[test]
fn identify_takes_a_model_with_effects_where_it_is_linear() {
    let place = place();
    place.write(
        "m.toml",
        format!("{}\n[effect.\"lag(y)\"]\ntau = 25.0\nrecord = {{ duration = 1995.0, interval = 5.0 }}\n", MODEL.replace("effects = []", "effects = [\"lag(y)\"]")),
    );
    place.succeeds(
        "identify a.csv --model m.toml --method srivc --order 2,0 --input u --json i.json",
    );
    let own = &place.json("i.json")["own_model"];
    let number = |value: &Value| value.as_f64().unwrap();
    // (50/0.8 s + 1)(25 s + 1) of the text and the table, and 1.6/0.8.
    for (k, a) in [1.0, 87.5, 1562.5].into_iter().enumerate() {
        assert!((number(&own["a"][k]) / a - 1.0).abs() < 1e-9, "{own}");
    }
    assert!(
        own["b"].as_array().unwrap().len() == 1 && (number(&own["b"][0]) - 2.0).abs() < 1e-9,
        "{own}"
    );
    let said = place.succeeds("check m.toml");
    assert!(said.contains("lag_y_tau"), "{said}");
    // A curved effect makes the model nonlinear.
    let bent = place
        .read("m.toml")
        .replace("lag(y)", "nonlinearity(u)")
        .replace("tau = 25.0", "bend = 0.1");
    place.write(
        "bent.toml",
        bent.replace(
            "{ duration = 1995.0, interval = 5.0 }",
            "{ high = 36.0, low = 0.0, width = 36.0 }",
        ),
    );
    place.refuses(
        "identify a.csv --model bent.toml --method srivc --input u",
        &["is not linear in the equation of"],
    );
}
