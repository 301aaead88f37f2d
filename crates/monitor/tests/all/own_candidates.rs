//! Candidates of the user's own in the isolation: a vent that opens above a temperature, and a second store with a state of its own.

use std::collections::BTreeMap;

use ct_model::Model;
use ct_model::effects::{OwnCandidate, OwnParameter, OwnState, apply, own_candidate};
use monitor::{Alarm, CandidateModel, Monitor, OwnModel, Settings, Units, Verdict};

use crate::own::{BLOCK, Plant, alarms, all, model, own};

const ONSET: usize = 2500;

fn parameter(unit: &str, start: f64) -> OwnParameter {
    OwnParameter {
        unit: unit.to_string(),
        min: Some(0.0),
        max: None,
        start,
    }
}

fn term(text: &str) -> BTreeMap<String, String> {
    BTreeMap::from([("T".to_string(), text.to_string())])
}

fn vent() -> OwnCandidate {
    OwnCandidate {
        parameters: BTreeMap::from([("q".to_string(), parameter("W/K", 0.1))]),
        terms: term("-q*max(T - 50, 0)"),
        ..OwnCandidate::default()
    }
}

fn second_store() -> OwnCandidate {
    let state = OwnState {
        unit: "degC".to_string(),
        start: 130.0,
        fixed: false,
        equation: "c2*der(Tw) = h*(T - Tw)".to_string(),
    };
    OwnCandidate {
        parameters: BTreeMap::from([
            ("c2".to_string(), parameter("J/K", 20.0)),
            ("h".to_string(), parameter("W/K", 0.1)),
        ]),
        states: BTreeMap::from([("Tw".to_string(), state)]),
        terms: term("-h*(T - Tw)"),
    }
}

/// The watched model with each candidate.
fn declared(watched: &Model) -> Vec<CandidateModel> {
    let all = [("second_store", second_store()), ("vent", vent())];
    let with = |(name, own): &(&str, OwnCandidate)| {
        let candidate = own_candidate(watched.spec(), name, own).unwrap();
        let model = Model::new(apply(watched.spec(), &[&candidate]).unwrap());
        CandidateModel { candidate, model }
    };
    all.iter().map(with).collect()
}

/// The last alarm on a block that is as the model says until this candidate begins.
fn last_alarm(begins: &str, sizes: &[f64], candidates: &[CandidateModel]) -> Alarm {
    let watched = model(BLOCK);
    let mut plant = Plant::block(3500, 23);
    let declared = declared(&watched);
    let begun = declared.iter().find(|own| own.candidate.id == begins);
    plant.model = begun.unwrap().model.clone();
    let before = plant.parameters[0].1.clone();
    let with = |sizes: &[f64]| [&before, sizes].concat();
    let without: Vec<f64> = match sizes {
        [capacity, _] => vec![*capacity, 0.0],
        _ => vec![0.0],
    };
    plant.parameters = vec![(0, with(&without)), (ONSET, with(sizes))];
    let own = OwnModel {
        candidates: candidates.into(),
        ..own(&watched)
    };
    let mut monitor = Monitor::new(own, Settings::default(), Units::default()).unwrap();
    let steps = all(&mut monitor, &plant.run());
    alarms(&steps).last().copied().cloned().unwrap()
}

#[test]
fn a_candidate_that_begins_is_named_with_its_size() {
    let declared = declared(&model(BLOCK));
    let alarm = last_alarm("vent", &[0.4], &declared);
    assert_eq!(alarm.effects, ["vent"], "{alarm:?}");
    assert_eq!(alarm.verdict, Verdict::Effect);
    let size = alarm.size.as_ref().unwrap();
    assert_eq!((size.name.as_str(), size.unit.as_str()), ("q", "W/K"));
    assert!((size.value / 0.4 - 1.0).abs() < 0.2, "{size:?}");
    let since = alarm.since.unwrap();
    assert!(
        (since - 5.0 * ONSET as f64).abs() < 200.0,
        "{since}: {alarm:?}"
    );
    // No effect of the catalogue has this form.
    let without = last_alarm("vent", &[0.4], &[]);
    assert!(!without.effects.contains(&"vent".to_string()));
    assert!(without.evidence.unwrap_or(0.0) < alarm.evidence.unwrap());
}

/// States of a candidate begin at their fitted values, whatever the states of the model are.
#[test]
fn a_candidate_may_bring_a_state() {
    let declared = declared(&model(BLOCK));
    let alarm = last_alarm("second_store", &[60.0, 0.8], &declared);
    assert_eq!(alarm.effects[0], "second_store", "{alarm:?}");
    let size = alarm.size.as_ref().unwrap();
    assert_eq!(size.name, "h");
    // Its size is correlated with the capacity and with the onset, which is accurate to a few rows.
    assert!((size.value / 0.8 - 1.0).abs() < 0.5, "{size:?}");
}
