//! Derivatives that duals carry against central differences of the output, at values where every effect shows.

use crate::support::{
    Case, DRIVES, Drive, STEPPED, base, begins_with_a_root, effect, fast, input, label, placements,
    random_sets,
};
use plants::{Placed, Plant};

/// The largest difference, as a share of the largest derivative with respect to that variable, over samples and variables.
///
/// The output has corners (the hysteresis turns, the reading saturates between two samples), and a difference across a
/// corner is no derivative: of two step lengths the better counts at each sample, and both are short. Where neither will do, a
/// third between them is tried: the longer one may err by its length and the shorter one by rounding.
///
/// `floor` is the smallest change of the output, as a share of the largest reading, that a variable's whole size is taken to
/// bring: the derivative by what is forgotten at once is zero, and rounding has no share of that.
pub fn disagreement(
    case: &Case,
    input: &[(plants::Command, f64)],
    substeps: usize,
    floor: f64,
) -> (f64, usize) {
    let exact = case.run_dual(input, substeps);
    let plain = case.run(input, substeps);
    for (dual, plain) in exact.iter().zip(&plain) {
        assert_eq!(
            dual.re.to_bits(),
            plain.to_bits(),
            "the value follows one path with and without derivatives"
        );
    }
    let variables = case.variables();
    let names = case.structure.parameter_names();
    let reading = plain.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    let mut worst = (0.0, 0);
    for lane in 0..variables.len() {
        let chord = |name: &String| STEPPED.iter().any(|id| name.starts_with(id));
        if names.get(lane).is_some_and(chord) {
            continue;
        }
        let scale = variables[lane].abs().max(0.1);
        let difference = |share: f64| {
            let moved = |sign: f64| {
                let mut moved = variables.clone();
                moved[lane] += sign * share * scale;
                case.run_at(&moved, input, substeps)
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            let rate = |(a, b): (&f64, &f64)| (a - b) / (2.0 * share * scale);
            up.iter().zip(&down).map(rate).collect::<Vec<f64>>()
        };
        let mut tried = vec![difference(1e-5), difference(1e-6)];
        if case.structure.plant.joined() {
            // The cut of a step depends on the heads, and the output changes by about 1e-11 with it: a short difference amplifies this, and
            // a long one is better where there is no corner.
            tried.push(difference(1e-4));
        }
        let least = (floor * reading / scale).max(1e-12);
        let largest = exact.iter().fold(least, |m, y| m.max(y.eps[lane].abs()));
        let disagree = |tried: &[Vec<f64>]| {
            exact.iter().enumerate().fold(0.0_f64, |most, (k, y)| {
                let best = tried
                    .iter()
                    .map(|difference| (difference[k] - y.eps[lane]).abs())
                    .fold(f64::INFINITY, f64::min);
                assert!(best.is_finite());
                most.max(best / largest)
            })
        };
        let mut error = disagree(&tried);
        if error > 1e-6 {
            tried.push(difference(3e-6));
            error = disagree(&tried);
        }
        if error > worst.0 {
            worst = (error, lane);
        }
    }
    worst
}

fn check(
    case: &Case,
    effects: &[plants::Placed],
    drive: Drive,
    seed: u64,
    most: f64,
    floor: f64,
) -> Option<String> {
    let plant = case.structure.plant;
    let most = if begins_with_a_root(effects) {
        1e-5
    } else if plant.joined() {
        // The influence of the cut on a difference, up to 2.7e-7.
        f64::max(most, 5e-7)
    } else {
        most
    };
    let case = case.with_interior(effects);
    let input = input(drive, 120, case.h, seed);
    let mut failures = String::new();
    for substeps in [1, 3] {
        let (error, lane) = disagreement(&case, &input, substeps, floor);
        println!(
            "{error:8.1e} {} {drive:?} {substeps}",
            label(effects, plant)
        );
        if error > most {
            let names = case.structure.parameter_names();
            let name = names
                .get(lane)
                .cloned()
                .unwrap_or(format!("level {}", lane - names.len().min(lane)));
            failures += &format!(
                "{error:e} by {name}: {} {drive:?} {substeps} seed {seed}\n",
                label(effects, plant)
            );
        }
    }
    (!failures.is_empty()).then_some(failures)
}

#[test]
fn every_effect_has_the_derivatives_of_its_output() {
    let mut failures = Vec::new();
    for plant in Plant::ALL {
        let base = base(plant);
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            failures.extend(check(&base, &[], drive, 100 + seed as u64, 1e-7, 0.0));
            for placed in placements(plant) {
                failures.extend(check(&base, &[placed], drive, 100 + seed as u64, 2e-7, 0.0));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.concat());
}

#[test]
fn pairs_and_triples_have_the_derivatives_of_their_output() {
    let mut failures = Vec::new();
    for plant in Plant::ALL {
        let base = base(plant);
        for size in [2, 3] {
            for (i, set) in random_sets(plant, size, 16, 7 * size as u64)
                .iter()
                .enumerate()
            {
                failures.extend(check(&base, set, DRIVES[i % 4], 200 + i as u64, 1e-6, 0.0));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.concat());
}

#[test]
fn vessels_that_are_over_within_a_step_have_the_derivatives_of_their_output() {
    let mut failures = Vec::new();
    // The fast vessels of joined tanks are in joined.rs.
    for plant in Plant::ALL.into_iter().filter(|plant| !plant.joined()) {
        for vessel in 0..plant.vessels() {
            for ratio in [1.6, 4.5, 11.0, 45.0] {
                let case = fast(plant, vessel, ratio);
                println!("vessel {vessel}, h/tau {ratio}");
                failures.extend(check(&case, &[], DRIVES[0], 400, 1e-6, 1e-3));
                for (i, placed) in placements(plant).into_iter().enumerate() {
                    if begins_with_a_root(&[placed]) {
                        // Such a fast level settles near the corner of the root, and no difference is short enough.
                        continue;
                    }
                    let seed = 400 + i as u64;
                    failures.extend(check(&case, &[placed], DRIVES[i % 4], seed, 1e-5, 1e-3));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.concat());
}

#[test]
fn what_sticks_has_the_slope_of_a_chord_of_a_twentieth() {
    for plant in [
        Plant::FirstOrder,
        Plant::SingleTankLinear,
        Plant::CascadedTanksLinear,
    ] {
        let base = base(plant);
        let own = base.theta.len();
        let placed = Placed {
            effect: effect("stiction_backlash"),
            vessel: 0,
        };
        let mut largest = [0.0_f64; 2];
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            let input = input(drive, 200, base.h, 300 + seed as u64);
            for (width, jump, begin) in [
                (0.61, 0.43, -0.57),
                (0.3, 0.9, 0.98),
                (0.3, 1.0, 0.0),
                (0.8, 0.0, -1.0),
                // A constant input.
                (9.0, 1.0, 0.3),
            ] {
                let mut case = base.with_interior(&[placed]);
                case.theta[own..own + 3].copy_from_slice(&[width, jump, begin]);
                let exact = case.run_dual(&input, 1);
                let at = |parameter: usize, value: f64| {
                    let mut moved = case.clone();
                    moved.theta[own + parameter] = value;
                    moved.run(&input, 1)
                };
                // A linear plant passes the chord of the position on as it is; what jumps is a choice and has no slope.
                let (lower, upper) = ((begin - 0.05_f64).max(-1.0), (begin + 0.05_f64).min(1.0));
                let chords = [(0, 0.95 * width, 1.05 * width), (2, lower, upper)];
                for (parameter, below, above) in chords {
                    let (from, to) = (at(parameter, below), at(parameter, above));
                    for (k, y) in exact.iter().enumerate() {
                        let chord = (to[k] - from[k]) / (above - below);
                        let largest = &mut largest[parameter / 2];
                        *largest = largest.max(chord.abs());
                        let error = (chord - y.eps[own + parameter]).abs();
                        assert!(error < 1e-9, "{drive:?} {parameter} {k}: {error}");
                        assert_eq!(y.eps[own + 1], 0.0);
                    }
                }
            }
        }
        assert!(largest.iter().all(|chord| *chord > 0.1), "it shows");
    }
}

#[test]
fn a_reading_in_steps_has_the_slope_of_a_whole_step() {
    for plant in Plant::ALL {
        let base = base(plant);
        let own = base.theta.len();
        let placed = Placed {
            effect: effect("coarse_quantisation"),
            vessel: 0,
        };
        let input = input(DRIVES[1], 150, base.h, 400);
        let mut case = base.with_interior(&[placed]);
        let step = case.theta[own];
        case.theta[own + 1] = 0.0;
        let without = base.run_dual(&input, 1);
        for (y, smooth) in case.run_dual(&input, 1).iter().zip(&without) {
            let count = (smooth.re / step).round();
            assert!((y.re - step * count).abs() < 1e-12);
            // The derivative with respect to the step is the number of steps; other derivatives are those without quantisation.
            assert!((y.eps[own] - count).abs() < 1e-12);
            assert_eq!(y.eps[..own], smooth.eps[..own]);
            assert_eq!(y.eps[own + 1], 0.0);
            let levels = base.levels.len();
            assert_eq!(
                y.eps[own + 2..own + 2 + levels],
                smooth.eps[own..own + levels]
            );
        }
    }
}

#[test]
fn an_instant_on_a_sample_has_the_derivative_of_its_neighbours() {
    for plant in Plant::ALL {
        let base = base(plant);
        let own = base.theta.len();
        for vessel in 0..plant.vessels() {
            let placed = Placed {
                effect: effect("valve_step"),
                vessel,
            };
            for drive in [DRIVES[0], DRIVES[2]] {
                let input = input(drive, 120, base.h, 500);
                let mut case = base.with_interior(&[placed]);
                let instant = 40.0 * base.h;
                case.theta[own + 1] = instant;
                let exact = case.run_dual(&input, 1);
                let at = |instant: f64| {
                    let mut moved = case.clone();
                    moved.theta[own + 1] = instant;
                    moved.run(&input, 1)
                };
                let step = 1e-4 * base.h;
                let (up, down) = (at(instant + step), at(instant - step));
                let largest = exact
                    .iter()
                    .fold(0.0_f64, |m, y| m.max(y.eps[own + 1].abs()));
                assert!(largest > 1e-3, "it shows");
                // The reading at the instant itself has a corner there.
                for (k, y) in exact.iter().enumerate().filter(|(k, _)| *k != 40) {
                    let difference = (up[k] - down[k]) / (2.0 * step);
                    let error = (difference - y.eps[own + 1]).abs();
                    assert!(error < 1e-5 * largest, "{} {drive:?} {k}", plant.id());
                }
            }
        }
    }
}

#[test]
fn little_noise_before_the_rounding_leaves_no_trace_between_thresholds() {
    let base = base(Plant::SingleTank);
    let own = base.theta.len();
    let placed = Placed {
        effect: effect("coarse_quantisation"),
        vessel: 0,
    };
    let mut case = base.with_interior(&[placed]);
    let step = case.theta[own];
    case.theta[own + 1] = 1e-3 * step;
    let input = input(DRIVES[1], 150, base.h, 400);
    let levels = base.run_dual(&input, 1);
    let far = |level: f64| ((level / step - 0.5).round() - (level / step - 0.5)).abs() > 0.01;
    let between: Vec<usize> = (0..150).filter(|&k| far(levels[k].re)).collect();
    assert!(between.len() > 100);
    for (k, y) in case.run_dual(&input, 1).iter().enumerate() {
        if between.contains(&k) {
            let count = (levels[k].re / step).round();
            assert_eq!(y.re, step * count);
            // Numbers whose squares underflow would stop every fit.
            assert!(
                y.eps
                    .iter()
                    .enumerate()
                    .all(|(i, slope)| *slope == 0.0 || i == own)
            );
        }
    }
}
