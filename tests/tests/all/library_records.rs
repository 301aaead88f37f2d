//! Single records of the library study (`--example library_study`), by their names and seeds.

#![allow(clippy::unwrap_used)]

use ctid_examples::model_records::driven_models;
use ctid_tests::library::{Job, Outcome, outcome};
use effect_search::{Options, Verdict};

fn of_record(kind: &'static str, name: &str, seed: u64) -> Outcome {
    let models = driven_models().unwrap();
    let job = Job::of_name(kind, name, &models).unwrap();
    let found = outcome(&job, &models, seed, &Options::default(), false).unwrap();
    println!("{name}: {}", found.told);
    found
}

/// The spring is nonlinear: the noise that the controller feeds back is not wholly taken out of the loop's residual, and rings with the plant.
#[test]
fn noise_that_a_controller_feeds_back_is_no_effect() {
    for number in [870, 910] {
        let name = format!("mass-spring: nothing, 3x, white, closed, {number}");
        let found = of_record("clean", &name, 2026);
        assert_eq!(found.verdict, Verdict::Adequate, "{}", found.told);
    }
}

/// The test on the measured inputs leaves both effects of a loop in the answer.
#[test]
fn a_pair_in_a_loop_is_named() {
    let name = "mass-spring: step(d) and varies_with(k3,F), 3x, coloured, closed, 448";
    let found = of_record("pair", name, 31);
    assert!(found.in_group, "{}", found.told);
}

/// A step and a period together describe a load that switches at random, and leave correlated noise.
#[test]
fn a_load_that_switches_at_random_is_no_pair_of_functions_of_time() {
    let name = "dc-motor: random telegraph, 1x, white, closed, 1450";
    let found = of_record("outside", name, 909);
    assert!(found.right, "{}", found.told);
}
