//! Records from a closed loop: simulated where the controller is known, warned of where it is not.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use ct_signals::Channel;
use ctid::input::Files;
use ctid_tests::{Drive, Rig};
use missing_effect::{
    ControlLoop, Diagnosis, NotSimulated, Options, Problem, Remark, Verdict, compare, diagnose,
};
use plants::controller::Controller;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn problem(rig: &Rig, seed: u64) -> Problem {
    rig.problem(rig.run(&mut ChaCha8Rng::seed_from_u64(seed)))
}

fn closed(colour: f64) -> Rig {
    Rig {
        drive: Drive::Closed,
        colour,
        noise: 0.1,
        ..Rig::single_tank()
    }
}

fn compared(problem: &Problem) -> Diagnosis {
    compare(problem, &Options::default()).unwrap()
}

fn known(found: &Diagnosis) -> &ControlLoop {
    found.control_loop.as_ref().unwrap()
}

/// Without feedback no loop is reported, for any noise; with feedback it is reported.
#[test]
fn feedback_is_found_where_it_is_and_only_there() {
    for seed in 0..24 {
        for rig in [
            Rig::single_tank(),
            Rig::cascaded_tanks(),
            Rig::linear_tank(),
        ] {
            let colour = [0.0, 0.9][seed as usize % 2];
            let rig = Rig {
                colour,
                noise: 0.1,
                ..rig
            };
            if seed < 8 {
                let open = compared(&problem(&rig, seed));
                assert!(open.control_loop.is_none(), "{:?}", open.control_loop);
            }
            if seed < 4 {
                let rig = Rig {
                    drive: Drive::Closed,
                    ..rig
                };
                let found = compared(&problem(&rig, seed));
                let feedback = known(&found);
                assert!(!feedback.simulated && feedback.feedback_p.unwrap() < 1e-4);
                let why = feedback.not_simulated.as_ref();
                assert!(matches!(why, Some(NotSimulated::UnknownController { .. })));
            }
        }
    }
}

/// With the controller the loop is simulated; on the measured command a fit by simulation error, as for an incomplete model, has wider
/// standard errors.
#[test]
fn a_known_controller_is_simulated_and_an_unknown_one_widens_the_intervals() {
    let (mut wider, mut count) = (0.0, 0.0);
    for seed in 0..3 {
        for hidden in [vec![], vec![("sensor_lag", 0, vec![15.0])]] {
            let adequate = hidden.is_empty();
            let rig = Rig {
                hidden,
                ..closed(0.9)
            };
            let mut problem = problem(&rig, seed);
            problem.controller = Some(rig.controller());
            let simulated = compared(&problem);
            assert!(known(&simulated).simulated);
            assert!(known(&simulated).mismatch.unwrap() < 1e-9);
            assert_eq!(simulated.verdict == Verdict::Adequate, adequate);
            assert_eq!(known(&simulated).not_simulated, None);
            let on_request = Options {
                simulate_loop: false,
                ..Options::default()
            };
            let measured = compare(&problem, &on_request).unwrap();
            assert!(!known(&measured).simulated);
            let why = known(&measured).not_simulated.as_ref();
            assert_eq!(why, Some(&NotSimulated::AsRequested));
            let error = |found: &Diagnosis| found.steps[0].parameters[0].std_error.unwrap();
            if !adequate {
                wider += error(&measured) / error(&simulated);
                count += 1.0;
            }
        }
    }
    println!(
        "standard errors on the measured command: {:.2} times those of the loop",
        wider / count
    );
    assert!(wider / count > 1.1);
}

/// A lag in a loop with coloured noise is found in the simulated loop, with its size.
#[test]
fn an_effect_is_found_in_the_simulated_loop() {
    let rig = Rig {
        hidden: vec![("pump_lag", 0, vec![12.0])],
        ..closed(0.8)
    };
    for seed in 1..=4 {
        let mut problem = problem(&rig, seed);
        problem.controller = Some(rig.controller());
        let found = diagnose(&problem, &Options::default(), &|_| {}).unwrap();
        assert!(known(&found).simulated);
        assert_eq!(found.groups.len(), 1, "{seed}: {:?}", found.groups);
        assert!(
            found.groups[0].iter().any(|named| named == "pump_lag"),
            "{seed}: {:?}",
            found.groups
        );
        let last = found.steps.last().unwrap();
        let size = last
            .parameters
            .iter()
            .find(|p| p.name.contains("_lag.time") || p.name.contains("delay."))
            .unwrap();
        assert!(
            (size.value - 12.0).abs() < 4.0 * size.std_error.unwrap(),
            "{seed}: {size:?}"
        );
    }
}

/// Reasons that prevent the simulation of a loop are reported with the correction, and the measured command is used.
#[test]
fn a_loop_that_cannot_be_simulated_is_not() {
    let good = {
        let mut problem = problem(&closed(0.0), 1);
        problem.controller = Some(closed(0.0).controller());
        problem
    };
    let refused = |problem: &Problem| {
        let found = compared(problem);
        assert!(!known(&found).simulated);
        known(&found).clone()
    };
    let mut without = good.clone();
    without.records[0].references.clear();
    let record = || "rig".to_string();
    let why = refused(&without).not_simulated;
    assert_eq!(why, Some(NotSimulated::NoReference { record: record() }));
    let mut constant = good.clone();
    constant.records[0].references = vec![Channel::new("r", "cm", vec![16.0; 1000])];
    let why = refused(&constant).not_simulated;
    let expected = NotSimulated::ConstantReference {
        record: record(),
        value: 16.0,
    };
    assert_eq!(why, Some(expected));
    let mut other = good.clone();
    other.controller = Some(Controller::pi(0.6, 200.0, (0.0, 10.0)).unwrap());
    let other = refused(&other);
    let share = match other.not_simulated {
        Some(NotSimulated::OtherController { share }) => share,
        why => panic!("{why:?}"),
    };
    assert!(share > 0.05 && other.mismatch.unwrap() > 0.0);
}

/// The loss of detectability in coloured noise is reported, and not for white noise.
#[test]
fn the_loss_of_power_in_coloured_noise_is_said() {
    for (colour, price) in [(0.0, false), (0.95, true)] {
        let rig = Rig {
            colour,
            noise: 0.2,
            ..Rig::single_tank()
        };
        let found = diagnose(&problem(&rig, 3), &Options::default(), &|_| {}).unwrap();
        assert_eq!(found.verdict, Verdict::Adequate);
        let coloured = |remark: &Remark| matches!(remark, Remark::ColouredNoise { .. });
        let reported = found.remarks.iter().any(coloured);
        assert_eq!(reported, price, "{:?}", found.remarks);
        let sizes = found.scores.iter().filter_map(|s| s.smallest_visible);
        assert!(sizes.count() > 0);
    }
}

/// The independent records in closed loop: the controller of the model file on the measured reading gives the measured
/// command, and the loop is simulated.
#[test]
#[cfg_attr(not(blind_records), ignore = "no blind records beside the checkout")]
fn controllers_of_independent_records_give_the_measured_commands() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/blind/public");
    let entries = std::fs::read_dir(&folder).unwrap();
    let mut loops = 0;
    for path in entries.map(|entry| entry.unwrap().path()) {
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let files = Files {
            data: vec![path.with_extension("csv")],
            test: Vec::new(),
            model: path.clone(),
            options: ct_signals::ReadOptions::default(),
        };
        let problem = files.read().unwrap().problem;
        let Some(controller) = &problem.controller else {
            continue;
        };
        loops += 1;
        let replayed = greybox::replay(controller, &problem.records[0]).unwrap();
        println!(
            "{}: the measured command differs by {:.5} V rms from the controller's and moves over {:.2} V",
            path.display(),
            replayed.rms,
            replayed.moves
        );
        // Converters of 12 bits over 10 V: 0.0007 V rms for each rounding.
        assert!(replayed.rms < 2e-3);
    }
    assert!(loops > 0);
}
