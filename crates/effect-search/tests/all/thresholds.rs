//! The thresholds of a search.

use effect_search::{ControlLoop, NotSimulated, Options, Thresholds, Verdict, diagnose};
use greybox::Replay;

use crate::records::{BLOCK, problem, record};

/// A margin or a probability that no fall passes leaves a hidden effect unnamed.
#[test]
fn the_thresholds_of_the_options_decide() {
    let text = BLOCK.replace("g*u", "g*min(u, 27)");
    let problem = problem(BLOCK, record(&text, 0.0, 0.2, 3));
    let found = |thresholds| {
        let options = Options {
            max_effects: 1,
            thresholds,
            ..Options::default()
        };
        diagnose(&problem, &options, &|_| {}).unwrap()
    };
    let usual = found(Thresholds::default());
    assert!(matches!(
        usual.verdict,
        Verdict::Effect | Verdict::Undecided
    ));
    assert!(usual.groups[0].iter().any(|id| id == "saturation(u)"));
    // A part of the answer is not claimed either.
    let of_margin = found(Thresholds {
        bic_margin: 1e9,
        partial_share: 2.0,
        partial_share_of_time: 2.0,
        ..Thresholds::DEFAULT
    });
    let of_chance = found(Thresholds {
        false_claim: 0.0,
        partial_share: 2.0,
        partial_share_of_time: 2.0,
        ..Thresholds::DEFAULT
    });
    for strict in [of_margin, of_chance] {
        assert!(strict.effects.is_empty(), "{:?}", strict.effects);
        assert!(matches!(
            strict.verdict,
            Verdict::Adequate | Verdict::Unexplained
        ));
    }
}

#[test]
fn the_thresholds_of_a_loop_decide() {
    let wide = Thresholds {
        feedback: 0.01,
        other_controller: 0.2,
        ..Thresholds::DEFAULT
    };
    let detected = |thresholds| ControlLoop::detected(1e-3, None, thresholds);
    assert_eq!(detected(&Thresholds::DEFAULT), None);
    assert_eq!(detected(&wide).unwrap().feedback_p, Some(1e-3));
    let replay = Replay {
        states: Vec::new(),
        beside: Vec::new(),
        rms: 0.3,
        usual: 0.2,
        moves: 2.0,
    };
    let other = ControlLoop::mismatch_of([&replay], &Thresholds::DEFAULT).unwrap_err();
    let share = NotSimulated::OtherController { share: 0.1 };
    assert_eq!(other.not_simulated, Some(share));
    assert_eq!(ControlLoop::mismatch_of([&replay], &wide), Ok(0.3));
}

#[test]
fn thresholds_are_read_back_as_they_were_written() {
    let changed = Thresholds {
        bic_margin: 7.5,
        beam: 5,
        ..Thresholds::DEFAULT
    };
    for thresholds in [Thresholds::default(), changed] {
        let text = serde_json::to_string(&thresholds).unwrap();
        let back: Thresholds = serde_json::from_str(&text).unwrap();
        assert_eq!(back, thresholds);
    }
    let value = serde_json::to_value(Thresholds::DEFAULT).unwrap();
    let numbers = value.as_object().unwrap().values();
    // One number per field, and none is zero: each can be halved and doubled.
    assert!(numbers.clone().all(|number| number.as_f64() > Some(0.0)));
}
