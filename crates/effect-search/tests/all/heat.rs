//! A heated block that radiates, and one whose heater cuts out.

use std::collections::BTreeMap;

use ct_model::effects::{OwnCandidate, OwnParameter};

use crate::records::{BLOCK, found, names, problem, record};

/// The block with another balance than the user believes.
fn block(balance: &str) -> String {
    let text = BLOCK
        .replace("= 0.8;", "= 0.4;")
        .replace("= 1.6;", "= 2.0;");
    text.replace(
        "C*der(T) = g*u - k*(T - Ta)",
        &format!("C*der(T) = {balance}"),
    )
}

#[test]
fn radiation_is_named_declared_or_not() {
    let hidden = block("g*u - k*(T - Ta) - 3e-9*((T + 273.15)^4 - (Ta + 273.15)^4)");
    let mut problem = problem(BLOCK, record(&hidden, 0.0, 0.2, 3));
    let found_alone = found(&problem);
    assert_eq!(found_alone.effects, ["radiation(T,Ta)"]);
    let exchange = OwnParameter {
        start: 1.0,
        min: Some(0.0),
        ..OwnParameter::default()
    };
    let declared = OwnCandidate {
        parameters: BTreeMap::from([("e".to_string(), exchange)]),
        terms: BTreeMap::from([(
            "T".to_string(),
            "-e*1e-9*((T + 273.15)^4 - (Ta + 273.15)^4)".to_string(),
        )]),
        ..OwnCandidate::default()
    };
    problem.candidates.insert("radiation".to_string(), declared);
    let found = found(&problem);
    assert_eq!(found.effects, ["radiation"]);
    assert!(names(&found, "radiation(T,Ta)"), "{:?}", found.groups);
}

#[test]
fn a_cut_out_is_a_limit_of_the_temperature() {
    let balance = "if T >= 75 and g*u > k*(T - Ta) then 0 else g*u - k*(T - Ta)";
    let found = found(&problem(BLOCK, record(&block(balance), 0.0, 0.2, 3)));
    assert_eq!(found.effects, ["limit(T)"]);
    let all = found.groups.iter().flatten().chain(&found.ranked);
    assert!(all.clone().all(|id| !id.starts_with("overflow")));
    let last = found.steps.last().unwrap();
    let bound = last.parameters.iter().find(|p| p.name == "limit_T_bound");
    assert!((bound.unwrap().value - 75.0).abs() < 0.1);
}

/// By the Magnus form of the vapour pressure, into air of a relative humidity that the user does not know.
#[test]
fn evaporation_into_humid_air_is_named() {
    let pressure = |t: &str| format!("exp(17.27*{t}/({t} + 237.3))");
    for (humidity, seed) in [(0.4, 3), (0.8, 4)] {
        let hidden = block(&format!(
            "g*u - k*(T - Ta) - 0.4*({} - {humidity}*{})",
            pressure("T"),
            pressure("Ta")
        ));
        let found = found(&problem(BLOCK, record(&hidden, 0.0, 0.1, seed)));
        assert_eq!(found.effects.len(), 1, "{humidity}: {:?}", found.groups);
        assert!(names(&found, "evaporation(T,Ta)"), "{:?}", found.groups);
    }
}
