//! Output for partial explanations, several outputs, and unknown values.

use super::*;
use crate::report::sample;

#[test]
fn a_partial_answer_is_told_with_all_that_belongs_to_it() {
    let told = diagnosis(&sample::partial(), Look::plain());
    let flat = told.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "Mostly overflow: 85 % of the squared error above the noise floor (86 % on held-out data); what remains: 0.26 V rms",
        "cascaded-tanks + sqrt_outflow, held-out error 0.55 V: offset 0.33, gain 0.26, shape 0.35 V",
        "+ overflow (upper), held-out error 0.22 V: offset 0.13, gain 0.10, shape 0.14 V",
        "Where + overflow (upper) fails",
        "- overflow: upper tank 1.00, lower tank 0.31: not determined",
        "1 overflow sensor_saturation 2 sensor_saturation overflow",
        "Left out by the time limit of 40 s: swap steps between pairs of effects.",
        "`--effort thorough`",
    ] {
        assert!(flat.contains(part), "{part}: {told}");
    }
}

#[test]
fn each_output_is_told_by_its_name() {
    let found = sample::partial_of(sample::two_outputs());
    let told = diagnosis(&found, Look::plain());
    for part in [
        "Simulation error of lower, root mean square",
        "Simulation error of upper, root mean square",
        "Simulation error of all outputs, in multiples of their noise",
        "Where cascaded-tanks + sqrt_outflow fails: lower",
        "Where cascaded-tanks + sqrt_outflow fails: upper",
        "Measured minus model, lower [V]:",
        "Measured minus model, upper [V]:",
        "held-out error of lower ",
        "held-out error of upper ",
        "error/noise",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
    let compared = comparison(&sample::comparison_of(found), Look::plain());
    assert!(
        compared.contains("tanks-estimation.csv, upper:"),
        "{compared}"
    );
    // The noise is not known before a search.
    assert!(!compared.contains("multiples of their noise"), "{compared}");
}

#[test]
fn what_is_not_known_is_not_told() {
    for told in [
        diagnosis(&sample::two_tanks(), Look::plain()),
        comparison(&sample::comparison(), Look::plain()),
    ] {
        for part in ["held-out error", "Two rankings", "likelihood", "Left out"] {
            assert!(!told.contains(part), "{part}: {told}");
        }
    }
}
