//! A measured disturbance that flows into a vessel.

use crate::derivatives::disagreement;
use crate::support::{
    Case, DRIVES, base, begins_with_a_root, difference, disturbed, effect, fast, input, label,
    mirrored, placements, random_sets, reference,
};
use plants::{Command, Dual, Known, Outlet, Place, Placed, Plant, Simulator, Structure};

/// Every plant with a disturbance into each of its vessels, of either sign.
fn cases() -> Vec<(Case, String)> {
    let plants = Plant::ALL.into_iter().filter(|plant| !plant.joined());
    plants
        .flat_map(|plant| (0..plant.vessels()).map(move |vessel| (plant, vessel)))
        .flat_map(|(plant, vessel)| [1.0, -0.4].map(|sign| (plant, vessel, sign)))
        .map(|(plant, vessel, sign)| {
            let which = format!("{} vessel {vessel} sign {sign}", plant.id());
            (disturbed(plant, vessel, sign), which)
        })
        .collect()
}

/// The same course held if the first input is a ramp, and a ramp if it is held.
fn otherwise(command: Command) -> Command {
    let there = mirrored(command).from;
    match command.to {
        Some(_) => Command::held(there),
        None => Command::ramp(there, there + 0.7),
    }
}

fn placed(id: &str, vessel: usize) -> Placed {
    Placed {
        effect: effect(id),
        vessel,
    }
}

#[test]
fn it_agrees_with_the_equations_held_and_ramped() {
    for (mut case, which) in cases() {
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            for second in [mirrored as fn(Command) -> Command, otherwise] {
                case.second = second;
                let input = input(drive, 150, case.h, 60 + seed as u64);
                let reference = reference::run(&case, &input);
                for (substeps, most) in [(1, 1e-7), (3, 3e-9)] {
                    let error = difference(&case.run(&input, substeps), &reference);
                    println!("{error:8.1e} {which} {drive:?} {substeps}");
                    let most = match case.structure.plant.outlet() {
                        Outlet::Linear => 1e-11,
                        Outlet::Torricelli => most,
                    };
                    assert!(error < most, "{which} {drive:?} {substeps}: {error:e}");
                }
            }
        }
    }
}

#[test]
fn effects_beside_it_agree_with_their_equations() {
    let mut failures = Vec::new();
    for (i, (mut case, which)) in cases().into_iter().enumerate() {
        let plant = case.structure.plant;
        let singles = placements(plant).into_iter().map(|placed| vec![placed]);
        let sets = random_sets(plant, 3, 8, 20 + i as u64);
        for (k, set) in singles.chain(sets).enumerate() {
            // A level that leaves its rim and returns within a step is not detected; a disturbance that falls at every sample and rises in
            // between would cause this all the time.
            let rim = set.iter().any(|placed| placed.effect.id == "overflow");
            case.second = [mirrored, otherwise][usize::from(!rim && (k + i / 4) % 2 == 1)];
            let with = case.with_interior(&set);
            let input = input(DRIVES[(i + k) % 4], 150, case.h, 300 + k as u64);
            let error = difference(&with.run(&input, 1), &reference::run(&with, &input));
            println!("{error:8.1e} {which} {}", label(&set, plant));
            let most = if begins_with_a_root(&set) { 2e-4 } else { 5e-7 };
            if error.is_nan() || error > most {
                failures.push(format!("{error:e} {which} {}", label(&set, plant)));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn fast_vessels_follow_it() {
    for plant in [
        Plant::SingleTank,
        Plant::CascadedTanks,
        Plant::SingleTankLinear,
        Plant::CascadedTanksLinear,
    ] {
        for vessel in 0..plant.vessels() {
            for (k, quick) in (0..plant.vessels()).enumerate() {
                for ratio in [1.6, 11.0, 45.0] {
                    let mut case = disturbed(plant, vessel, 1.0);
                    let other = fast(plant, quick, ratio);
                    case.structure.scales.area = other.structure.scales.area;
                    case.theta[..other.theta.len()].copy_from_slice(&other.theta);
                    for (seed, drive) in DRIVES.into_iter().enumerate() {
                        case.second = [mirrored, otherwise][(k + seed) % 2];
                        let input = input(drive, 60, case.h, 900 + seed as u64);
                        let error =
                            difference(&case.run(&input, 1), &reference::run(&case, &input));
                        println!(
                            "{error:8.1e} {} into {vessel}, {quick} fast by {ratio}",
                            plant.id()
                        );
                        let most = match plant.outlet() {
                            Outlet::Linear => 1e-10,
                            Outlet::Torricelli => 3e-3,
                        };
                        assert!(
                            error < most,
                            "{} into {vessel}, {quick} fast by {ratio} {drive:?}: {error:e}",
                            plant.id()
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn it_has_the_derivatives_of_its_output() {
    let mut failures = Vec::new();
    for (i, (mut case, which)) in cases().into_iter().enumerate() {
        let plant = case.structure.plant;
        let sets = std::iter::once(Vec::new())
            .chain(placements(plant).into_iter().map(|placed| vec![placed]))
            .chain(random_sets(plant, 2, 6, 30 + i as u64));
        for (k, set) in sets.enumerate() {
            case.second = [mirrored, otherwise][(k + i / 4) % 2];
            let with = case.with_interior(&set);
            let input = input(DRIVES[(i + k) % 4], 120, case.h, 200 + k as u64);
            let (error, lane) = disagreement(&with, &input, 1, 0.0);
            println!("{error:8.1e} {which} {}", label(&set, plant));
            let most = if begins_with_a_root(&set) { 1e-5 } else { 1e-6 };
            if error > most {
                failures.push(format!(
                    "{error:e} by {lane} {which} {}",
                    label(&set, plant)
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Readings under inputs of which nothing is left at rest.
fn response(case: &Case, input: &[[Command; 2]]) -> Vec<f64> {
    let n = case.structure.plant.vessels();
    let offset = case
        .structure
        .parameter_names()
        .iter()
        .position(|name| name == "offset")
        .map_or(0.0, |at| case.theta[at]);
    let mut levels = vec![0.0; n];
    levels[n - 1] = offset;
    let mut simulator = Simulator::new(&case.structure, &case.theta, &levels, 0.0).unwrap();
    let read = |commands: &[Command; 2]| {
        let y = simulator.read(0) - offset;
        simulator.advance_both(*commands, case.h);
        y
    };
    input.iter().map(read).collect()
}

#[test]
fn of_a_linear_plant_it_adds_to_the_response() {
    for (case, which) in cases() {
        if case.structure.plant.outlet() != Outlet::Linear {
            continue;
        }
        for drive in [DRIVES[0], DRIVES[2]] {
            let none = Command::held(0.0);
            let input = input(drive, 120, case.h, 17);
            let run = |of: fn(Command) -> [Command; 2]| {
                let input: Vec<_> = input.iter().map(|&(command, _)| of(command)).collect();
                response(&case, &input)
            };
            let both = run(|command| [command, mirrored(command)]);
            let pump = run(|command| [command, Command::held(0.0)]);
            let alone = run(|command| [Command::held(0.0), mirrored(command)]);
            let sum: Vec<f64> = pump.iter().zip(&alone).map(|(a, b)| a + b).collect();
            let error = difference(&both, &sum);
            println!("{error:8.1e} {which} {drive:?}");
            assert!(error < 1e-13, "{which} {drive:?}: {error:e}");
            // At rest the level is at its gain.
            let long = response(&case, &vec![[none, Command::held(2.0)]; 3000]);
            let gain = case.theta.last().unwrap();
            assert!((long[2999] - 2.0 * gain).abs() < 1e-9 * gain.abs());
        }
    }
}

#[test]
fn none_leaves_the_output_as_it_is() {
    for (case, which) in cases() {
        let plant = case.structure.plant;
        for (k, drive) in DRIVES.into_iter().enumerate() {
            let set = random_sets(plant, 2, 4, k as u64).swap_remove(k);
            for set in [Vec::new(), set] {
                let input = input(drive, 150, case.h, 80 + k as u64);
                let mut with = case.with_interior(&set);
                let without = base(plant).with_interior(&set);
                let at = without
                    .structure
                    .plant
                    .parameters(&without.structure.scales);
                with.theta[at.len()] = 0.0;
                let error = difference(&with.run(&input, 1), &without.run(&input, 1));
                assert!(error < 1e-13, "{which} {}: {error:e}", label(&set, plant));
                // A record whose second input is unknown to the model is simulated without it.
                let mut other = without.clone();
                other.second = otherwise;
                assert_eq!(other.run(&input, 1), without.run(&input, 1));
            }
        }
    }
}

#[test]
fn effects_that_are_absent_leave_it_bit_for_bit() {
    for (case, which) in cases() {
        let plant = case.structure.plant;
        let input = input(DRIVES[0], 120, case.h, 90);
        let without = case.run(&input, 1);
        for placed in placements(plant) {
            let with = case.with_absent(&[placed]);
            // Lags and dead times cut a step or follow the level, and a hole's height is a parameter even if the hole is closed.
            let smooth = placed.effect.place == Place::Vessel && placed.effect.id != "coupled_tank";
            let error = difference(&with.run(&input, 1), &without);
            if smooth {
                assert_eq!(error, 0.0, "{which} {}", label(&[placed], plant));
            }
        }
    }
}

#[test]
fn the_command_alone_is_late() {
    // A dead time and a lag of the pump do not change the disturbance: for a constant command they have no effect.
    for (case, which) in cases() {
        let plant = case.structure.plant;
        for id in ["transport_delay", "pump_lag"] {
            let with = case.with_interior(&[placed(id, 0)]);
            let run = |case: &Case| {
                let levels = &case.levels[..plant.vessels()];
                let mut simulator =
                    Simulator::new(&case.structure, &case.theta, levels, case.at_rest).unwrap();
                (0..100)
                    .map(|k| {
                        let d = Command::ramp(f64::from(k % 7), f64::from((k + 1) % 7));
                        simulator.advance_both([Command::held(case.at_rest), d], case.h);
                        simulator.read(0)
                    })
                    .collect::<Vec<f64>>()
            };
            let error = difference(&run(&with), &run(&case));
            println!("{error:8.1e} {which} {id}");
            // A dead time cuts the steps.
            let most = match plant.outlet() {
                Outlet::Linear => 1e-13,
                Outlet::Torricelli => 1e-6,
            };
            assert!(error < most, "{which} {id}: {error:e}");
        }
    }
}

#[test]
fn it_has_one_parameter_more_and_no_places_for_effects() {
    for (case, which) in cases() {
        let plant = case.structure.plant;
        let without = base(plant).structure;
        let names = case.structure.parameter_names();
        assert_eq!(
            names[..names.len() - 1],
            without.parameter_names(),
            "{which}"
        );
        assert_eq!(names.last().unwrap(), "disturbance_gain");
        let info = case.structure.parameters().pop().unwrap();
        assert!(info.lower < 0.0 && info.upper > 0.0 && info.starts == [0.0]);
        let flow = plant.outlet() == Outlet::Torricelli;
        let first = &without.parameters()[0];
        assert_eq!((first.name == "pump_gain", first.unit), (flow, info.unit));
        assert_eq!(case.structure.candidates(), without.candidates());
        assert!(case.structure.with(placed("pump_lag", 1)).is_err());
        // A record without a second input has none, whatever is known.
        let mut scales = case.structure.scales.clone();
        scales.input_2 = None;
        let known = case.structure.known.clone();
        let none = Structure::new(plant, known, scales);
        assert_eq!(none.parameter_names(), without.parameter_names());
    }
    // The second input of joined tanks is a pump's.
    let joined = base(Plant::ThreeTank).structure;
    let known = Known {
        disturbance: Some(0),
        ..joined.known.clone()
    };
    let other = Structure::new(Plant::ThreeTank, known, joined.scales.clone());
    assert_eq!(other.parameter_names(), joined.parameter_names());
}

#[test]
fn what_it_takes_from_a_tank_leaves_it_empty() {
    // The disturbance takes more than the pump supplies: the level ends at zero and has finite derivatives.
    for plant in [Plant::SingleTank, Plant::CascadedTanks] {
        for vessel in 0..plant.vessels() {
            let mut case = disturbed(plant, vessel, 1.0);
            let last = case.theta.len() - 1;
            case.theta[last] = -3.0 * case.theta[0];
            for drive in DRIVES {
                for y in case.run_dual(&input(drive, 150, case.h, 70), 1) {
                    let Dual { re, eps } = y;
                    assert!(re >= 0.0 && re.is_finite() && eps.iter().all(|e| e.is_finite()));
                }
                assert!(*case.run(&input(drive, 150, case.h, 70), 1).last().unwrap() < 1.0);
            }
        }
    }
}
