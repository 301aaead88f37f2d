//! Parameters of the believed model at a bound, and parameters that the model file fixes.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_model::effects::{OwnCandidate, OwnParameter};
use effect_search::{Options, Problem, Thresholds, diagnose};

use crate::records::{BLOCK, record};

/// The loss is smaller than the least one that the model allows. Beyond its bound the parameter would explain all of the error, whatever
/// candidate is added: the scores of the candidates are those of steps within the bounds.
#[test]
fn a_parameter_at_its_bound_hides_no_effect() {
    let believed = BLOCK.replace("min=0) = 0.8", "min=1.5) = 2");
    assert_ne!(believed, BLOCK);
    let gain = OwnParameter {
        start: 0.1,
        min: Some(0.0),
        ..OwnParameter::default()
    };
    let less_loss = OwnCandidate {
        parameters: BTreeMap::from([("e".to_string(), gain)]),
        terms: BTreeMap::from([("T".to_string(), "e*(T - Ta)".to_string())]),
        ..OwnCandidate::default()
    };
    let spec = ModelSpec::parse(&believed).unwrap();
    let problem = Problem::builder(spec, [record(BLOCK, 0.0, 0.2, 8)])
        .candidate("less_loss", less_loss)
        .build()
        .unwrap();
    let options = Options {
        thresholds: Thresholds {
            first_refits: 3,
            pair_refits: 3,
            ..Thresholds::DEFAULT
        },
        ..Options::default()
    };
    let found = diagnose(&problem, &options, &|_| {}).unwrap();
    assert_eq!(found.effects, ["less_loss"], "{:?}", found.groups);
}

/// A parameter of a listed effect that the model file fixes keeps its value, although another one fits better.
#[test]
fn a_fixed_parameter_of_an_effect_keeps_its_value() {
    for (effect, parameter, value) in [
        ("nonlinearity(u)", "nonlinearity_u_bend", 0.21),
        ("dead_zone(u)", "dead_zone_u_threshold", 4.3),
    ] {
        let spec = ModelSpec::parse(BLOCK).unwrap();
        let problem = Problem::builder(spec, [record(BLOCK, 0.0, 0.2, 8)])
            .effects([effect])
            .known(parameter, value)
            .build()
            .unwrap();
        let options = Options {
            max_effects: 1,
            ..Options::default()
        };
        let found = diagnose(&problem, &options, &|_| {}).unwrap();
        for step in &found.steps {
            let mut parameters = step.parameters.iter();
            let fixed = parameters.find(|p| p.name == parameter).unwrap();
            assert!(fixed.known, "{effect}");
            assert_eq!(fixed.value, value, "{effect}");
        }
    }
}
