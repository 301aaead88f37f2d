//! Candidates of the user's own whose search begins far from absent.

use std::collections::BTreeMap;

use ct_model::effects::{OwnCandidate, OwnParameter};
use effect_search::Problem;

use crate::records::{PAIR, found, problem, record};

fn with_candidate(
    mut problem: Problem,
    name: &str,
    parameters: &[(&str, f64)],
    terms: &[(&str, &str)],
) -> Problem {
    let parameter = |start: f64| OwnParameter {
        start,
        ..OwnParameter::default()
    };
    let parameters = parameters.iter();
    let terms = terms.iter();
    let candidate = OwnCandidate {
        parameters: parameters
            .map(|(name, start)| ((*name).to_string(), parameter(*start)))
            .collect(),
        terms: terms
            .map(|(name, term)| ((*name).to_string(), (*term).to_string()))
            .collect(),
        states: BTreeMap::new(),
    };
    problem.candidates.insert(name.to_string(), candidate);
    problem
}

/// A flow that begins above a difference of either sign: where the difference is zero, the branches for either sign meet.
#[test]
fn a_band_without_flow_is_found() {
    let flow = |difference: &str| {
        PAIR.replace(
            "  final",
            "  parameter Real c(unit=\"W/K\", min=0) = 0.6;\n  final",
        )
        .replace("k1*(T1 - 20)", &format!("k1*(T1 - 20) - c*({difference})"))
        .replace("k2*(T2 - 20)", &format!("k2*(T2 - 20) + c*({difference})"))
    };
    let inside = "max(-9, min(9, T1 - T2))";
    let hidden = flow(&format!("T1 - T2 - {inside}"));
    let problem = with_candidate(
        problem(&flow("T1 - T2"), record(&hidden, 0.0, 0.1, 5)),
        "band",
        &[("gap", 3.0)],
        &[
            ("T1", "c*max(-gap, min(gap, T1 - T2))"),
            ("T2", "-c*max(-gap, min(gap, T1 - T2))"),
        ],
    );
    let diagnosis = found(&problem);
    assert_eq!(diagnosis.effects, ["band"], "{:?}", diagnosis.singles);
    let last = diagnosis.steps.last().unwrap();
    let gap = last.parameters.iter().find(|p| p.name == "band_gap");
    let gap = gap.unwrap();
    let error = gap.std_error.unwrap();
    assert!((gap.value - 9.0).abs() < 4.0 * error, "{gap:?}");
}
