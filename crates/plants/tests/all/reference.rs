//! The simulator compared with an independent integration of the equations, and with analytic solutions.

use crate::support::{
    Case, DRIVES, Drive, base, begins_with_a_root, difference, effect, input, label, placements,
    random_sets, reference,
};
use plants::{Command, Known, Placed, Plant};

/// Compares one structure with one step a sample and with three, by which an error of order four falls 81 times.
fn compare(case: &Case, drive: Drive, seed: u64, most: f64) -> Vec<String> {
    let input = input(drive, 150, case.h, seed);
    let reference = reference::run(case, &input);
    let effects = case.structure.effects();
    // If an outflow begins within a step, the order of the error falls to one and a half (a factor of five for three parts), and the error
    // is about a tenth of the flow through the hole in that time.
    let (most, falls) = if begins_with_a_root(effects) {
        (2e-4, 0.25)
    } else {
        (most, 0.03)
    };
    let mut failures = Vec::new();
    for (substeps, most) in [(1, most), (3, falls * most)] {
        let error = difference(&case.run(&input, substeps), &reference);
        let line = format!(
            "{error:8.1e} {} {drive:?} {substeps}",
            label(effects, case.structure.plant)
        );
        println!("{line}");
        if error.is_nan() || error > most {
            failures.push(line);
        }
    }
    failures
}

#[test]
fn every_effect_agrees_with_its_equation() {
    let mut failures = Vec::new();
    for plant in Plant::ALL {
        let base = base(plant);
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            for placed in placements(plant) {
                failures.extend(compare(
                    &base.with_interior(&[placed]),
                    drive,
                    40 + seed as u64,
                    1e-7,
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

// Five times the bound of a single effect: effects together give a shorter time constant (0.06 h, and a vessel that narrows to half its
// surface shortens it again), and the hysteresis multiplies the level's error by its slope, five.
#[test]
fn pairs_and_triples_agree_with_their_equations() {
    let mut failures = Vec::new();
    for plant in Plant::ALL {
        let base = base(plant);
        for size in [2, 3] {
            for (i, set) in random_sets(plant, size, 24, 70 + size as u64)
                .iter()
                .enumerate()
            {
                failures.extend(compare(
                    &base.with_interior(set),
                    DRIVES[i % 4],
                    300 + i as u64,
                    5e-7,
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Two lags in series after `K u`, `u` from `u0` with a slope, after a time `t`.
fn two_lags(x: [f64; 2], [t1, t2]: [f64; 2], q0: f64, slope: f64, t: f64) -> [f64; 2] {
    let c1 = x[0] - q0 + slope * t1;
    let q = q0 + slope * t;
    let first = q - slope * t1 + c1 * (-t / t1).exp();
    let settled = |t: f64| q0 + slope * t - slope * (t1 + t2);
    let felt = |t: f64| {
        if t1 == t2 {
            c1 * t / t1 * (-t / t1).exp()
        } else {
            c1 * t1 / (t1 - t2) * (-t / t1).exp()
        }
    };
    let c2 = x[1] - settled(0.0) - felt(0.0);
    [first, settled(t) + felt(t) + c2 * (-t / t2).exp()]
}

#[test]
fn linear_plants_are_exact_whatever_the_sampling() {
    for plant in [
        Plant::SingleTankLinear,
        Plant::CascadedTanksLinear,
        Plant::FirstOrder,
    ] {
        for ratio in [0.01, 0.05, 0.3, 1.0, 1.7, 3.0, 10.0] {
            for second in [0.4, 1.0, 2.5] {
                for (seed, drive) in DRIVES.into_iter().enumerate() {
                    let tau = 80.0;
                    let (h, taus) = (ratio * tau, [tau, tau * second]);
                    let mut case = base(plant);
                    let offset = match plant {
                        Plant::FirstOrder => 0.0,
                        _ => 1.5,
                    };
                    case.theta = match plant {
                        Plant::SingleTankLinear => vec![2.0, taus[0], offset],
                        Plant::CascadedTanksLinear => vec![2.0, taus[0], taus[1], offset],
                        _ => vec![2.0, taus[0]],
                    };
                    let input = input(drive, 100, h, 500 + seed as u64);
                    let two = plant == Plant::CascadedTanksLinear;
                    let mut x = if two {
                        [case.levels[0], case.levels[1] - offset]
                    } else {
                        [case.levels[0] - offset, 0.0]
                    };
                    let mut exact = Vec::new();
                    for &(command, h) in &input {
                        exact.push(if two { x[1] } else { x[0] } + offset);
                        let slope = command.to.map_or(0.0, |to| (to - command.from) / h);
                        x = two_lags(x, taus, 2.0 * command.from, 2.0 * slope, h);
                    }
                    for substeps in [1, 3] {
                        let error = difference(&case.run(&input, substeps), &exact);
                        assert!(
                            error < 1e-12,
                            "{} h/tau {ratio} second {second} {drive:?}: {error:e}",
                            plant.id()
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn two_lags_in_series_may_be_exchanged() {
    for plant in Plant::ALL {
        let Some(pair) = plant.interchangeable(&Known::default()) else {
            assert_ne!(plant, Plant::CascadedTanksLinear);
            continue;
        };
        let case = base(plant);
        let names: Vec<_> = plant.parameters(&case.structure.scales);
        let at = pair.map(|name| names.iter().position(|info| info.name == name).unwrap());
        let offset = case.theta[names.iter().position(|info| info.name == "offset").unwrap()];
        let mut other = base(plant);
        other.theta.swap(at[0], at[1]);
        // The same reading and the same slope at the beginning.
        let low = case.levels[1] - offset;
        other.levels[0] = low + (case.levels[0] - low) * case.theta[at[0]] / case.theta[at[1]];
        for drive in DRIVES {
            let input = input(drive, 100, case.h, 7);
            let (y, exchanged) = (case.run(&input, 1), other.run(&input, 1));
            assert!(difference(&y, &exchanged) < 1e-11);
        }
    }
}

#[test]
fn a_second_sensor_or_a_disturbance_of_the_lower_lag_tells_two_lags_apart() {
    let plant = Plant::CascadedTanksLinear;
    let with = |measured: &[usize], disturbance| {
        plant.interchangeable(&Known {
            measured: measured.to_vec(),
            disturbance,
            ..Known::default()
        })
    };
    assert_eq!(with(&[1], None), Some(["tau1", "tau2"]));
    assert_eq!(with(&[1], Some(0)), Some(["tau1", "tau2"]));
    assert_eq!(with(&[1], Some(1)), None);
    assert_eq!(with(&[0, 1], None), None);
    assert_eq!(with(&[1, 0], None), None);
}

#[test]
fn the_order_is_four_with_contacts_at_a_rim_inside_the_steps() {
    for plant in [Plant::SingleTank, Plant::CascadedTanks] {
        let mut sets: Vec<Vec<Placed>> = vec![vec![]];
        sets.extend((0..plant.vessels()).map(|vessel| {
            vec![Placed {
                effect: effect("overflow"),
                vessel,
            }]
        }));
        for set in sets {
            for drive in DRIVES {
                let mut base = base(plant);
                base.h *= 4.0;
                let case = base.with_interior(&set);
                let input = input(drive, 60, case.h, 11);
                let reference = reference::run(&case, &input);
                if !set.is_empty() {
                    // The rim must be reached, and left between samples.
                    let without = base.run(&input, 1);
                    assert!(difference(&case.run(&input, 1), &without) > 0.01);
                }
                let errors: Vec<f64> = [1, 2, 4, 8]
                    .iter()
                    .map(|&n| difference(&case.run(&input, n), &reference))
                    .collect();
                println!("{} {drive:?}: {errors:?}", label(&set, plant));
                // Over three halvings; a single one may lie on either side, as the contacts move within the steps.
                let order = (errors[0] / errors[3]).log2() / 3.0;
                assert!(
                    order > 3.6,
                    "{} {drive:?}: order {order} of {errors:?}",
                    label(&set, plant)
                );
            }
        }
    }
}

#[test]
fn a_ramp_is_cut_where_the_pump_has_corners() {
    let mut case = base(Plant::FirstOrder);
    case.at_rest = 3.0;
    case.levels = vec![4.0];
    let value = |_: &Case, placed: Placed, _: &plants::ParameterInfo| match placed.effect.id {
        "pump_deadzone" => 0.6,
        "pump_saturation" => 1.7,
        "pump_nonlinearity" => 0.4,
        "transport_delay" => 4.4,
        _ => 7.0,
    };
    // Through both corners of the dead zone, and the limit, within one interval.
    let points = [
        3.0, -2.0, 2.5, 2.4, 0.3, -0.7, -0.5, 0.9, 3.0, 0.0, 0.0, 0.6, 2.3, 1.9, -4.0,
    ];
    let input: Vec<(Command, f64)> = (0..120)
        .map(|k| (Command::ramp(points[k % 15], points[(k + 1) % 15]), 3.0))
        .collect();
    let sets: [&[&str]; 7] = [
        &["pump_deadzone"],
        &["pump_saturation"],
        &["pump_deadzone", "pump_saturation"],
        &["pump_deadzone", "pump_saturation", "pump_nonlinearity"],
        &[
            "pump_deadzone",
            "pump_saturation",
            "pump_nonlinearity",
            "transport_delay",
        ],
        &[
            "pump_deadzone",
            "pump_saturation",
            "pump_nonlinearity",
            "transport_delay",
            "pump_lag",
        ],
        &["pump_deadzone", "pump_lag"],
    ];
    for set in sets {
        let placed: Vec<Placed> = set
            .iter()
            .map(|id| Placed {
                effect: effect(id),
                vessel: 0,
            })
            .collect();
        let case = case.with(&placed, value);
        let error = difference(&case.run(&input, 1), &reference::run(&case, &input));
        println!("{error:.1e} {set:?}");
        // The pump's lag reaches the vessel as a parabola of the right moments, the rest is exact.
        let most = if set.contains(&"pump_lag") {
            1e-7
        } else {
            1e-10
        };
        assert!(error < most, "{set:?}: {error:e}");
    }
}
