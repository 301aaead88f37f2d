//! Two tanks whose levels are both measured, each with noise of its own: the hidden effect is found with its place, and two
//! measured levels distinguish effects that one does not.
#![allow(clippy::unwrap_used)]

use ctid_tests::{Drive, Rig};
use missing_effect::{Diagnosis, Options, Problem, Verdict, compare, diagnose};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Two tanks with something hidden in them.
fn tanks(hidden: Vec<(&'static str, usize, Vec<f64>)>) -> Rig {
    Rig {
        hidden,
        measured: vec![0, 1],
        samples: 800,
        ..Rig::cascaded_tanks()
    }
}

fn problem(rig: &Rig, seed: u64) -> Problem {
    let mut problem = rig.problem(rig.run(&mut ChaCha8Rng::seed_from_u64(seed)));
    for (output, name) in problem.records[0].outputs.iter_mut().zip(["h1", "h2"]) {
        output.name = name.into();
    }
    problem
}

fn found(problem: &Problem) -> Diagnosis {
    diagnose(problem, &Options::default(), &|_| {}).unwrap()
}

fn place(found: &Diagnosis) -> Option<&str> {
    found.steps.last().unwrap().place.as_deref()
}

#[test]
fn what_is_hidden_is_named_in_its_tank_or_at_its_sensor() {
    for (seed, (effect, at, values, name)) in [
        ("valve_drift", 1, vec![-0.04], "lower"),
        ("leak_at_height", 0, vec![1.0, 8.0], "upper"),
        ("sensor_drift", 0, vec![0.4], "upper"),
        ("sensor_lag", 1, vec![12.0], "lower"),
    ]
    .into_iter()
    .enumerate()
    {
        let rig = tanks(vec![(effect, at, values)]);
        let found = found(&problem(&rig, seed as u64));
        println!(
            "{effect}: {:?} {:?} {:?}",
            found.verdict,
            found.groups,
            place(&found)
        );
        assert_eq!(found.groups, [[effect]]);
        assert_eq!(place(&found), Some(name));
        // The noise floor is met at either output, which the believed model does not do.
        let (first, last) = (&found.steps[0], found.steps.last().unwrap());
        assert!(first.weighted_rmse > 1.1 && (last.weighted_rmse - 1.0).abs() < 0.05);
        for (rmse, floor) in last.rmse_per_output.values().zip(&found.noise) {
            assert!((rmse / floor.level - 1.0).abs() < 0.1);
        }
    }
}

#[test]
fn a_second_level_splits_what_one_level_does_not() {
    // Where the lag is, in the transmitter or in the pump, the upper level tells.
    let rig = tanks(vec![("sensor_lag", 1, vec![15.0])]);
    let both = problem(&rig, 8);
    let mut lower = both.clone();
    lower.records[0].outputs.remove(0);
    lower.known.measured.clear();
    let (two, one) = (found(&both), found(&lower));
    println!(
        "both levels: {:?}, the lower one: {:?}",
        two.groups, one.groups
    );
    assert_eq!(two.groups, [["sensor_lag"]]);
    assert!(one.groups[0].len() > 1 && one.groups[0].iter().any(|named| named == "sensor_lag"));
}

#[test]
fn two_right_levels_are_adequate_and_the_outputs_that_fail_are_said() {
    let right = found(&problem(&tanks(Vec::new()), 5));
    assert_eq!(right.verdict, Verdict::Adequate);
    assert_eq!(right.outputs, ["h1", "h2"]);
    // An outlet of the lower tank changes nothing in the upper one.
    let rig = tanks(vec![("valve_drift", 1, vec![-0.1])]);
    let compared = compare(&problem(&rig, 6), &Options::default()).unwrap();
    assert_eq!(compared.verdict, Verdict::Unexplained);
    let fails = |output: usize| {
        let failures = &compared.steps[0].outputs[output].failures;
        failures.by_time.iter().any(|bin| bin.fails)
    };
    assert!(!fails(0) && fails(1));
    let left = compared.not_noise.as_ref().unwrap();
    assert_eq!(left.output(), "h2", "{left:?}");
}

#[test]
fn a_loop_on_the_lower_level_is_simulated_with_both() {
    let rig = Rig {
        drive: Drive::Closed,
        pi: (0.3, 200.0),
        colour: 0.8,
        ..tanks(vec![("pump_saturation", 0, vec![5.6])])
    };
    let problem = Problem {
        controller: Some(rig.controller()),
        ..problem(&rig, 7)
    };
    let found = found(&problem);
    println!("{:?} {:?}", found.groups, found.control_loop);
    assert!(found.control_loop.as_ref().unwrap().simulated);
    assert!(
        found.groups[0]
            .iter()
            .any(|named| named == "pump_saturation")
    );
}
