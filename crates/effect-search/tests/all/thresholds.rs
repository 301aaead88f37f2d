//! The thresholds of a search.

use effect_search::{Options, Thresholds, Verdict, diagnose};

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
