//! Report of a model with an unexplained error.

#![allow(clippy::unwrap_used)]

use effect_search::PortScore;

use super::*;

fn unknown(effect: &str, variable: [&str; 2], unit: &str) -> Unknown {
    let place = |effect: &str, share_left_out| PortScore {
        effect: effect.to_string(),
        bic_gain: 812.345,
        share_left_out,
    };
    Unknown {
        effect: effect.to_string(),
        variable: variable[0].to_string(),
        variable_unit: variable[1].to_string(),
        unit: unit.to_string(),
        share: 0.9,
        share_left_out: Some(0.8),
        rmse_per_output: BTreeMap::new(),
        at: vec![0.0, 50.0, 100.0],
        value: vec![0.0, -2.0, 1.0],
        std_error: vec![None, Some(0.1), Some(0.2)],
        is_centred: false,
        parameters: Vec::new(),
        places: vec![place(effect, Some(0.8)), place("course(T)", None)],
    }
}

/// The report contains the place of the term, its variable, its units and the command, and its values agree with its figure.
#[test]
fn what_nothing_explains_is_shown_with_its_port_and_units() {
    let text = include_str!("../../../models/heated-block.mo");
    let spec = ct_model::ModelSpec::parse(text).unwrap();
    let words = EffectWords::among(&spec, &BTreeMap::new(), &BTreeMap::new());
    let term = missing_term(&words, &unknown("shape(T,u)", ["u", "%"], "W"));
    assert_eq!(term.shown_term, "added to the equation of T");
    assert_eq!(
        term.placed,
        "shape(T,u) in the equation of T (block), with u (power of the heater)"
    );
    assert_eq!(term.places[0].left_out, "80 %");
    assert_eq!(term.places[1].left_out, "");
    let of_parameter = missing_term(&words, &unknown("shape(k,T)", ["T", "degC"], "1"));
    assert_eq!(of_parameter.shown_term, "the relative change of k");
    assert_eq!(of_parameter.unit, "");
    let document = Document {
        diagnosis: crate::report::sample::two_tanks(),
        sentences: Vec::new(),
        verdict: "Mostly: lag(y)".to_string(),
        term: Some(term),
    };
    let html = document.html();
    for part in [
        "<h1>Mostly: lag(y)</h1>",
        "The unexplained error",
        "id=\"plot-unknown-shape\"",
        "added to the equation of T, in W",
        "<code>ctid add NAME --model M.toml --from RESULT.json</code>",
        "Ports and variables that were compared",
        "\"variable_unit\":\"%\"",
        "\"ordinate_errors\":[null,0.1,0.2]",
    ] {
        assert!(html.contains(part), "{part}");
    }
}
