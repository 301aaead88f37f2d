//! Sentences and numbers of a diagnosis.

use missing_effect::{Effort, Rankings};

use super::*;
use crate::report::sample;

#[test]
fn a_partial_answer_says_how_much_it_explains_and_what_remains() {
    let mut diagnosis = sample::partial();
    assert_eq!(
        partial_headline(&diagnosis),
        "Mostly overflow: 85 % of the squared error above the noise floor (86 % on held-out data); what remains: \
             0.26 V rms (noise floor 0.080 V)"
    );
    diagnosis.acceptance = None;
    diagnosis.noise[0].level = f64::NAN;
    assert_eq!(
        partial_headline(&diagnosis),
        "Mostly overflow: the larger part of the squared error; what remains: 0.26 V rms"
    );
}

#[test]
fn percents_are_whole_and_have_no_negative_zero() {
    assert_eq!(percent(0.617), "62 %");
    assert_eq!(percent(-0.001), "0 %");
    assert_eq!(percent(-0.2), "-20 %");
    assert_eq!(percent(-1e9), "-999 %");
    assert_eq!(percent(f64::NAN), "-");
}

#[test]
fn places_that_are_as_likely_are_not_told_apart() {
    let scores = |likelihoods: &[(&str, f64)]| {
        let scores: Vec<PlaceScore> = likelihoods
            .iter()
            .map(|&(place, relative_likelihood)| PlaceScore {
                place: place.to_string(),
                relative_likelihood,
            })
            .collect();
        place_scores(Domain::Hydraulic, &scores)
    };
    assert_eq!(
        scores(&[("upper", 1.0), ("lower", 0.31)]),
        "upper tank 1.00, lower tank 0.31: not determined"
    );
    assert_eq!(
        scores(&[("T3", 1.0), ("T1", 0.04), ("T2", 1e-9)]),
        "tank T3 1.00, tank T1 0.04, tank T2 below 0.01: it is the tank T3"
    );
    assert_eq!(
        scores(&[("pump_1", 1.0), ("pump_2", 0.05)]),
        "pump 1 1.00, pump 2 0.05: not determined"
    );
}

#[test]
fn the_held_out_error_is_said_to_the_digits_of_the_whole() {
    let error = HeldOutError {
        offset: 1.9,
        gain: 0.1,
        shape: 0.3,
    };
    assert_eq!(
        held_out_error(&error, "degC"),
        "1.9 degC: offset 1.9, gain 0.1, shape 0.3 degC"
    );
    let small = HeldOutError {
        offset: 0.0,
        gain: 0.003,
        shape: 0.004,
    };
    assert_eq!(
        held_out_error(&small, ""),
        "0.0050: offset 0.0000, gain 0.0030, shape 0.0040"
    );
}

#[test]
fn rankings_stand_side_by_side_only_where_they_disagree() {
    let mut diagnosis = sample::partial();
    assert_eq!(rankings(&diagnosis).len(), 3);
    diagnosis.rankings.disagree = false;
    assert!(rankings(&diagnosis).is_empty());
    diagnosis.rankings = Rankings::default();
    assert!(rankings(&diagnosis).is_empty());
}

#[test]
fn what_was_left_out_is_said_with_how_to_get_more() {
    let mut diagnosis = sample::two_tanks();
    assert!(effort(&diagnosis.effort, Reader::Commands).is_empty());
    diagnosis.effort = Effort {
        limit: Some(40.0),
        left_out: vec![
            "pairs of effects".into(),
            "refits from random starts".into(),
        ],
        interrupted: false,
    };
    assert_eq!(
        effort(&diagnosis.effort, Reader::Commands),
        [
            "Left out by the time limit of 40 s: pairs of effects; refits from random starts.",
            "For a longer search: `--effort thorough` (limit 10 min)."
        ]
    );
    diagnosis.effort.limit = Some(600.0);
    let said = effort(&diagnosis.effort, Reader::Page);
    assert!(said[1].contains("fewer rows"), "{said:?}");
    diagnosis.effort.interrupted = true;
    assert_eq!(
        effort(&diagnosis.effort, Reader::Page),
        [
            "The search was interrupted: this is the best result that was found until then.",
            "Left out: pairs of effects; refits from random starts."
        ]
    );
}
