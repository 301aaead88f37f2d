//! The experiment that `ctid design` proposes decides what the record left open.
#![allow(clippy::unwrap_used)]

use ctid_tests::design_cases::{ROWS, answered, proposed, rig, undecided};
use missing_effect::design::Prospect;

/// Rows and seeds of `cargo run --release -p ctid-tests --example design` for which the design predicts that the experiment decides: the static
/// curve, lags, in open loop and in a loop.
const CASES: [(usize, u64); 4] = [(0, 1), (4, 1), (5, 1), (17, 1)];

#[test]
fn the_proposed_experiment_decides_for_the_truth() {
    for (row, seed) in CASES {
        let row = &ROWS[row];
        let case = undecided(rig(row), seed).unwrap();
        let (other, plan) = proposed(&case).unwrap();
        let best = &plan.candidates[0];
        assert_eq!(plan.prospect, Prospect::Decides, "{row:?} {other}");
        assert!(best.refitted);
        // More of the same would not have done.
        let again = plan.again.as_ref().unwrap();
        assert!(again.power.decides < 0.5 && again.power.power < best.power.power);
        let (low, high) = (plan.limits.low, plan.limits.high);
        let within = |u: &f64| (low..=high).contains(u);
        assert!(plan.experiment.values.iter().all(within));
        let answer = answered(&case, &other, &plan, 1000 + seed).unwrap();
        assert!(answer.pair_decided, "{row:?} {other}: {:?}", answer.groups);
    }
}
