//! Candidates of the model file that the model's own parameters absorb.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_model::effects::{OwnCandidate, OwnParameter};
use effect_search::{Absorbed, Problem};

use crate::records::{BLOCK, found, record};

fn with_term(term: &str) -> OwnCandidate {
    let parameter = OwnParameter {
        start: 0.1,
        ..OwnParameter::default()
    };
    OwnCandidate {
        parameters: BTreeMap::from([("q".to_string(), parameter)]),
        terms: BTreeMap::from([("T".to_string(), term.to_string())]),
        ..OwnCandidate::default()
    }
}

#[test]
fn a_term_that_the_model_has_already_is_named_with_its_parameter() {
    let spec = ModelSpec::parse(BLOCK).unwrap();
    let problem = Problem::builder(spec, [record(BLOCK, 0.0, 0.1, 3)])
        .candidate("again", with_term("-q*(T - Ta)"))
        .candidate("both", with_term("q*(u - (T - Ta))"))
        .candidate("new", with_term("-q*max(T - 40, 0)"))
        .build()
        .unwrap();
    let of = |effect: &str, parameter: Option<&str>| Absorbed {
        effect: effect.to_string(),
        parameter: parameter.map(str::to_string),
    };
    assert_eq!(
        found(&problem).absorbed,
        [of("again", Some("k")), of("both", None)]
    );
    // A parameter that is known comes before the one that absorbs the term.
    let spec = ModelSpec::parse(BLOCK).unwrap();
    let problem = Problem::builder(spec, [record(BLOCK, 0.0, 0.1, 3)])
        .candidate("again", with_term("q*u"))
        .known("k", 0.8)
        .build()
        .unwrap();
    assert_eq!(found(&problem).absorbed, [of("again", Some("g"))]);
}
