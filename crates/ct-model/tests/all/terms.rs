//! Names that a user gives to the smooth functions.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_model::effects::{
    Candidate, OwnCandidate, OwnParameter, Visited, apply, candidates, check_term_name,
    own_candidates, shapes_keeping,
};

const HEATED_BLOCK: &str = r#"model Block
  parameter Real C(unit="J/K", min=0) = 40;
  parameter Real k(unit="W/K", min=0) = 0.4;
  parameter Real Ta(unit="degC") = 20;
  input Real u(unit="W");
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20);
equation
  C*der(T) = u - k*(T - Ta);
end Block;
"#;

fn block() -> (ModelSpec, Vec<Candidate>) {
    let spec = ModelSpec::parse(HEATED_BLOCK).unwrap();
    let shapes = shapes_keeping(&spec, &Visited::nominal(&spec), &BTreeMap::new());
    (spec, shapes)
}

/// The model with a named function is the model with the function, but for the names.
#[test]
fn a_function_under_another_name_is_the_same_function() {
    let (spec, shapes) = block();
    assert!(shapes.len() > 10);
    for shape in &shapes {
        let named = shape.clone().named(&spec, "heat_loss");
        assert_eq!(named.id, "heat_loss");
        let own = apply(&spec, &[shape]).unwrap().to_string();
        let stem: String = shape.id.trim_end_matches(')').replace(['(', ','], "_");
        let text = apply(&spec, &[&named]).unwrap().to_string();
        assert_eq!(text, own.replace(&stem, "heat_loss"), "{}", shape.id);
        for (parameter, before) in named.parameters.iter().zip(&shape.parameters) {
            assert_eq!(parameter.name, format!("heat_loss_{}", before.short));
            assert!(text.contains(&parameter.name), "{text}");
        }
        assert_eq!(named.named(&spec, &stem).parameters, shape.parameters);
    }
}

#[test]
fn a_name_that_is_taken_is_refused_with_what_has_it() {
    let (spec, mut all) = block();
    all.extend(candidates(&spec, &Visited::nominal(&spec)));
    let q = OwnParameter {
        start: 1.0,
        ..OwnParameter::default()
    };
    let vent = OwnCandidate {
        parameters: BTreeMap::from([("q".to_string(), q)]),
        terms: BTreeMap::from([("T".to_string(), "-q*T".to_string())]),
        ..OwnCandidate::default()
    };
    let vent = BTreeMap::from([("vent".to_string(), vent)]);
    all.extend(own_candidates(&spec, &vent).unwrap());
    let shapes = shapes_keeping(&spec, &Visited::nominal(&spec), &BTreeMap::new());
    let shape = shapes.first().unwrap();
    let check = |all: &[Candidate], name| check_term_name(&spec, all, shape, name);
    for free in ["heat_loss", "Q1", "lag_of_heater"] {
        assert_eq!(check(&all, free), Ok(()));
    }
    for (taken, what) in [
        ("", "begins with a letter"),
        ("1st", "begins with a letter"),
        ("heat-loss", "begins with a letter"),
        ("der", "reserved"),
        ("time", "reserved"),
        ("k", "a variable of Block"),
        ("y", "a variable of Block"),
        ("lag", "an effect of the catalogue"),
        ("course", "an effect of the catalogue"),
        ("lag_u", "a variable of lag(u) is called `lag_u`"),
        ("lag_u_tau", "a variable of lag(u) is called `lag_u_tau`"),
        ("shape_T_u", "a variable of shape(T,u)"),
        ("vent_q", "a variable of vent"),
    ] {
        let refused = check(&all, taken).unwrap_err();
        assert!(refused.contains(what), "{taken}: {refused}");
    }
    // The parameters of one term are no name of another one.
    all.push(shape.clone().named(&spec, "a"));
    let refused = check(&all, "a_h1").unwrap_err();
    assert!(
        refused.contains("a variable of a is called `a_h1`"),
        "{refused}"
    );
    assert_eq!(check(&all, "b"), Ok(()));
}
