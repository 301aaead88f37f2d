//! Candidates of the model file.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_model::effects::{
    OwnCandidate, OwnParameter, OwnState, Role, Visited, apply, candidates, own_candidate,
    own_candidates,
};

fn block() -> ModelSpec {
    let text = "model Block
  parameter Real C(unit=\"J/K\", min=0) = 50;
  parameter Real k(unit=\"W/K\", min=0) = 0.5;
  input Real u(unit=\"W\");
  input Real Ta(unit=\"degC\");
  output Real y(unit=\"degC\") = T;
  Real T(unit=\"degC\", start=31);
  Real loss(unit=\"W\") = k*(T - Ta);
equation
  C*der(T) = u - loss;
end Block;
";
    ModelSpec::parse(text).unwrap()
}

fn parameter(start: f64) -> OwnParameter {
    OwnParameter {
        min: Some(0.0),
        start,
        ..OwnParameter::default()
    }
}

fn own(parameters: &[(&str, f64)], terms: &[(&str, &str)]) -> OwnCandidate {
    let parameters = parameters.iter();
    OwnCandidate {
        parameters: parameters
            .map(|(name, start)| ((*name).to_string(), parameter(*start)))
            .collect(),
        states: BTreeMap::new(),
        terms: terms
            .iter()
            .map(|(name, term)| ((*name).to_string(), (*term).to_string()))
            .collect(),
    }
}

#[test]
fn a_term_is_added_to_a_state_a_flow_or_a_reading() {
    let block = block();
    for (target, line) in [
        (
            "T",
            "C*der(T) = u - loss - radiation_e*((T + 273.15)^4 - (Ta + 273.15)^4);",
        ),
        (
            "loss",
            "loss = k*(T - Ta) - radiation_e*((T + 273.15)^4 - (Ta + 273.15)^4);",
        ),
        (
            "y",
            "y = y_true - radiation_e*((T + 273.15)^4 - (Ta + 273.15)^4);",
        ),
    ] {
        let term = "-e*((T + 273.15)^4 - (Ta + 273.15)^4)";
        let radiation = own(&[("e", 1e-9)], &[(target, term)]);
        let candidate = own_candidate(&block, "radiation", &radiation).unwrap();
        assert_eq!(candidate.id, "radiation");
        assert_eq!(candidate.parameters[0].name, "radiation_e");
        assert_eq!(candidate.parameters[0].role, Role::Size);
        assert_eq!(candidate.parameters[0].starts, [1e-9]);
        let text = apply(&block, &[&candidate]).unwrap().to_string();
        assert!(text.contains(line), "{text}");
    }
}

#[test]
fn a_candidate_may_bring_a_state() {
    let block = block();
    let mut store = own(&[("h", 0.1), ("c2", 20.0)], &[("T", "-h*(T - Tw)")]);
    let state = OwnState {
        unit: "degC".to_string(),
        start: 20.0,
        fixed: false,
        equation: "c2*der(Tw) = h*(T - Tw)".to_string(),
    };
    store.states.insert("Tw".to_string(), state);
    let candidate = own_candidate(&block, "second_store", &store).unwrap();
    let roles: Vec<(&str, Role)> = candidate
        .parameters
        .iter()
        .map(|p| (p.short.as_str(), p.role))
        .collect();
    assert_eq!(roles, [("c2", Role::Shape), ("h", Role::Size)]);
    let mended = apply(&block, &[&candidate]).unwrap();
    assert_eq!(mended.states[1].about.name, "second_store_Tw");
    // Together with an effect of the catalogue, whose variables come first.
    let all = candidates(&block, &Visited::nominal(&block));
    let lag = all.iter().find(|c| c.id == "lag(u)").unwrap();
    let both = apply(&block, &[&candidate, lag]).unwrap();
    assert_eq!(both, apply(&block, &[lag, &candidate]).unwrap());
    let text = both.to_string();
    assert!(
        text.contains(
            "second_store_c2*der(second_store_Tw) = second_store_h*(T - second_store_Tw);"
        ),
        "{text}"
    );
    assert!(
        text.contains("C*der(T) = lag_u - loss - second_store_h*(T - second_store_Tw);"),
        "{text}"
    );
}

/// At zero two branches meet, and the derivative there is that of one of them.
#[test]
fn a_size_that_decides_between_branches_is_a_threshold_with_starts() {
    let block = block();
    let role = |candidate: OwnCandidate| {
        let candidate = own_candidate(&block, "own", &candidate).unwrap();
        let all = candidate.parameters.into_iter();
        all.map(|p| (p.role, p.starts)).collect::<Vec<_>>()
    };
    let clamped = |term: &str| role(own(&[("gap", 8.0)], &[("loss", term)]));
    for term in [
        "-k*max(-gap, min(gap, T - Ta))",
        "if T - Ta > gap then -k*gap else 0",
    ] {
        assert_eq!(clamped(term), [(Role::Threshold, vec![8.0, 2.0, 32.0])]);
    }
    assert_eq!(clamped("gap*max(T - Ta, 0)"), [(Role::Size, vec![8.0])]);
}

#[test]
fn the_size_is_found_where_it_is_hidden() {
    let block = block();
    let sizes = |candidate: &OwnCandidate| -> Vec<String> {
        let candidate = own_candidate(&block, "own", candidate).unwrap();
        let sizes = candidate
            .parameters
            .into_iter()
            .filter(|p| p.role == Role::Size);
        sizes.map(|p| p.short).collect()
    };
    // Within a fraction, ...
    let inhibited = own(
        &[("ki", 0.1)],
        &[("loss", "u*T/(2 + T + ki*T^2) - u*T/(2 + T)")],
    );
    assert_eq!(sizes(&inhibited), ["ki"]);
    // ... several terms with one size each, ...
    let two = own(
        &[("a", 1.0), ("b", 2.0), ("p", 3.0)],
        &[("T", "a*u*p + b*(T - Ta)")],
    );
    let found = sizes(&two);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found.contains(&"b".to_string()));
    // ... and in the equation of a state that starts at zero.
    let mut voltage = own(&[("R", 0.1), ("tau", 30.0)], &[("y", "-w")]);
    let state = OwnState {
        start: 0.0,
        fixed: true,
        equation: "der(w) = (R*u - w)/tau".to_string(),
        ..OwnState::default()
    };
    voltage.states.insert("w".to_string(), state);
    assert_eq!(sizes(&voltage), ["R"]);
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let refused = |candidate: &OwnCandidate, wanted: &str| {
        let said = own_candidate(&block(), "radiation", candidate)
            .unwrap_err()
            .to_string();
        assert!(said.contains(wanted), "{said}\ninstead of\n{wanted}");
        assert_eq!(said.lines().count(), 1);
    };
    let e = [("e", 1.0)];
    refused(
        &own(&e, &[("T", "-e*(Tt - Ta)")]),
        "radiation.terms.T: 1:5: `Tt` is not declared: declare it, or did you mean `Ta`?",
    );
    refused(
        &own(&e, &[("T", "-e*(T - Ta")]),
        "radiation.terms.T: 1:11: the end of the text where",
    );
    refused(
        &own(&e, &[("T", "-e*T = 3")]),
        "the end of the expression has to stand",
    );
    refused(
        &own(&e, &[("k", "-e*T")]),
        "radiation.terms.k: `k` is not a state, named flow or output of Block: a term is added to one of T, y, loss",
    );
    refused(
        &own(&e, &[("T", "-2*T")]),
        "radiation.parameters.e: it is used nowhere",
    );
    refused(
        &own(&[("k", 1.0)], &[("T", "-k*T")]),
        "radiation.parameters.k: `k` is a variable of Block",
    );
    refused(&own(&[("max", 1.0)], &[("T", "-T")]), "is a reserved word");
    refused(&own(&e, &[]), "it has no terms");
    refused(&own(&[], &[("T", "-T")]), "it has no parameter");
    refused(
        &own(&[("e", -1.0)], &[("T", "-e*T")]),
        "start = -1 is outside min = 0",
    );
    refused(
        &own(&[("e", f64::NAN)], &[("T", "-e*T")]),
        "start, min and max are numbers",
    );
    let mut store = own(&e, &[("T", "e*Tw")]);
    let state = OwnState {
        equation: "der(T) = -Tw".to_string(),
        ..OwnState::default()
    };
    store.states.insert("Tw".to_string(), state);
    refused(
        &store,
        "radiation.states.Tw.equation: 1:1: the left side of this equation must be `der(Tw)`",
    );
    let error = own_candidate(&block(), "lag(u)", &own(&e, &[("T", "-e*T")])).unwrap_err();
    assert!(error.to_string().contains("letters, digits"), "{error}");
}

#[test]
fn two_candidates_that_are_the_same_are_refused() {
    let one = own(&[("e", 1.0)], &[("T", "-e*(T - Ta)")]);
    let other = own(&[("h", 2.0)], &[("T", "-h*(T - Ta)")]);
    let all = BTreeMap::from([
        ("one".to_string(), one.clone()),
        ("other".to_string(), other),
    ]);
    let error = own_candidates(&block(), &all).unwrap_err().to_string();
    assert_eq!(error, "other: it is the same as one: keep one of them");
    let all = BTreeMap::from([("one".to_string(), one)]);
    assert_eq!(own_candidates(&block(), &all).unwrap().len(), 1);
}

/// A store whose exchange with the block has no absent value: its resistance is a divisor.
fn pair() -> OwnCandidate {
    let mut pair = own(&[("C1", 100.0), ("R1", 2.0)], &[("y", "-v1")]);
    let state = OwnState {
        equation: "C1*der(v1) = u - v1/R1".to_string(),
        ..OwnState::default()
    };
    pair.states.insert("v1".to_string(), state);
    pair
}

#[test]
fn a_candidate_whose_absence_is_a_limit_is_scored_with_a_factor() {
    let block = block();
    let candidate = own_candidate(&block, "pair", &pair()).unwrap();
    assert!(candidate.parameters.iter().all(|p| p.role == Role::Shape));
    assert_eq!(candidate.parameters[1].starts, [2.0, 0.2, 20.0]);
    let scored = candidate.with_factor(&block).unwrap();
    assert_eq!(scored.parameters.len(), 3);
    let factor = &scored.parameters[2];
    assert_eq!((factor.role, factor.absent), (Role::Size, 0.0));
    assert_eq!(factor.bounds, (0.0, f64::INFINITY));
    // The factor is only in the model for the score.
    let text = apply(&block, &[&scored]).unwrap().to_string();
    assert!(
        text.contains("y = y_true + pair_factor*(-pair_v1);"),
        "{text}"
    );
    let text = apply(&block, &[&candidate]).unwrap().to_string();
    assert!(text.contains("y = y_true - pair_v1;"), "{text}");
    assert!(!text.contains("factor"), "{text}");
    // A parameter that removes a part of the model needs no size.
    let size = own(&[("e", 1.0)], &[("T", "-e*T")]);
    let size = own_candidate(&block, "radiation", &size).unwrap();
    assert_eq!(size.with_factor(&block), None);
    let term = own(&[("e", 1.0)], &[("T", "-(1 + e)*T")]);
    let term = own_candidate(&block, "term", &term).unwrap();
    assert!(term.with_factor(&block).is_some());
}

#[test]
fn a_candidate_with_a_state_may_be_repeated() {
    let names = ["one", "two", "three"].map(|name| (name.to_string(), pair()));
    let all = own_candidates(&block(), &BTreeMap::from(names)).unwrap();
    let repeats: Vec<Option<&str>> = all.iter().map(|c| c.repeats.as_deref()).collect();
    // In the order of their names.
    assert_eq!(repeats, [None, Some("one"), Some("three")]);
}
