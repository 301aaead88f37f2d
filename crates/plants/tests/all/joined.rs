//! Tanks that are joined by valves: what flows either way, and what happens where the levels are equal.

use crate::support::{Case, DRIVES, base, difference, effect, input, mirrored, reference};
use plants::{Command, Dual, Known, Placed, Plant, Scalar, Scales, Simulator, Structure};

/// The DTS200 according to its manual, levels in cm and flow coefficients pure numbers: areas of 154 cm^2, pipes of 0.5 cm^2.
fn rig(measured: usize, second: bool) -> Structure {
    let mut scales = Scales::from_ranges((0.0, 10.0), (5.0, 50.0), 1.0, 1000.0);
    scales.input_2 = second.then_some((0.0, 10.0));
    let known = Known {
        area: [Some(154.0); 3],
        measured: vec![measured],
        orifice: Some(0.5 * (2.0 * 981.0_f64).sqrt()),
        ..Known::default()
    };
    Structure::new(Plant::ThreeTank, known, scales)
}

/// Gains of both pumps, then az13, az32, az20.
const THETA: [f64; 5] = [9.0, 8.5, 0.46, 0.48, 0.6];

fn simulator(theta: &[f64], levels: [f64; 3], at_rest: [f64; 2]) -> Simulator<f64> {
    Simulator::with_inputs(&rig(1, true), theta, &levels, at_rest).unwrap()
}

fn held(u: [f64; 2]) -> [Command; 2] {
    u.map(Command::held)
}

/// Commands that push water one way and then the other, each for so many seconds.
fn back_and_forth(k: usize, every: usize) -> [f64; 2] {
    if (k / every).is_multiple_of(2) {
        [2.0, 0.5]
    } else {
        [0.0, 9.0]
    }
}

#[test]
fn a_flow_coefficient_of_a_known_orifice_is_at_most_two() {
    let structure = rig(1, true);
    let coefficients = |structure: &Structure| {
        let all = structure.plant.parameters(&structure.scales).into_iter();
        all.filter(|parameter| parameter.name.starts_with("az"))
            .map(|parameter| (parameter.lower, parameter.upper))
            .collect::<Vec<_>>()
    };
    for (lower, upper) in coefficients(&structure) {
        assert!(0.0 < lower && lower < upper && upper == 2.0);
    }
    // For an unknown orifice they have a unit.
    let mut scales = Scales::from_ranges((0.0, 10.0), (5.0, 50.0), 1.0, 1000.0);
    scales.input_2 = Some((0.0, 10.0));
    let known = Known {
        measured: vec![1],
        ..Known::default()
    };
    let unknown = Structure::new(Plant::ThreeTank, known, scales);
    assert!(coefficients(&unknown).iter().all(|(_, upper)| *upper > 2.0));
}

#[test]
fn water_is_neither_made_nor_lost() {
    let mut theta = THETA;
    // With a closed outlet, all pumped water stays.
    theta[4] = 0.0;
    for substeps in [1, 3] {
        for h in [0.2, 1.0, 5.0, 40.0] {
            let mut simulator = simulator(&theta, [12.0, 3.0, 7.0], [0.0; 2]);
            simulator.set_substeps(substeps);
            let mut content = 154.0 * 22.0;
            for k in 0..60 {
                let u = back_and_forth(k, 7);
                simulator.advance_both(held(u), h);
                content += h * (theta[0] * u[0] + theta[1] * u[1]);
                let levels: f64 = simulator.levels().iter().sum();
                let error = (154.0 * levels - content).abs() / content;
                assert!(error < 1e-12, "h {h}, sample {k}: {error:e}");
            }
        }
    }
}

#[test]
fn it_rests_where_the_equations_say() {
    let orifice = 0.5 * (2.0 * 981.0_f64).sqrt();
    // With the first pump off, T1 and T3 reach the same level, otherwise different ones.
    for u in [[3.0, 2.0], [4.0, 0.0], [0.0, 5.0]] {
        let mut simulator = simulator(&THETA, [20.0, 10.0, 12.0], u);
        for _ in 0..3000 {
            simulator.advance_both(held(u), 4.0);
        }
        let (q, all) = (THETA[0] * u[0], THETA[0] * u[0] + THETA[1] * u[1]);
        let head = |flow: f64, az: f64| (flow / (az * orifice)).powi(2);
        let h2 = head(all, THETA[4]);
        let h3 = h2 + head(q, THETA[3]);
        let rest = [h3 + head(q, THETA[2]), h3, h2];
        for (level, rest) in simulator.levels().iter().zip(rest) {
            assert!(
                (level - rest).abs() < 1e-7 * rest,
                "{u:?}: {level} instead of {rest}"
            );
        }
    }
}

#[test]
fn tanks_that_are_exchanged_exchange_their_levels() {
    // Without an outlet the rig is symmetric.
    let (one, other) = ([9.0, 8.5, 0.46, 0.48, 0.0], [8.5, 9.0, 0.48, 0.46, 0.0]);
    let mut a = simulator(&one, [14.0, 9.0, 4.0], [0.0; 2]);
    let mut b = simulator(&other, [4.0, 9.0, 14.0], [0.0; 2]);
    for k in 0..400 {
        let [u, v] = back_and_forth(k, 30);
        a.advance_both(held([u, v]), 1.0);
        b.advance_both(held([v, u]), 1.0);
        let (x, y) = (a.levels(), b.levels());
        for i in 0..3 {
            assert!((x[i] - y[2 - i]).abs() < 1e-9 * x[i], "{x:?} {y:?}");
        }
    }
}

/// Classical Runge-Kutta method with so short steps that the corners of roots do not matter, on the manual's equations without
/// regularisation.
fn sharp(levels: [f64; 3], samples: usize, every: usize, h: f64, parts: usize) -> Vec<[f64; 3]> {
    let orifice = 0.5 * (2.0 * 981.0_f64).sqrt();
    let root = |d: f64| d.signum() * d.abs().sqrt();
    let rates = |x: [f64; 3], u: [f64; 2]| {
        let q13 = THETA[2] * orifice * root(x[0] - x[1]);
        let q32 = THETA[3] * orifice * root(x[1] - x[2]);
        let q20 = THETA[4] * orifice * x[2].max(0.0).sqrt();
        [
            (THETA[0] * u[0] - q13) / 154.0,
            (q13 - q32) / 154.0,
            (THETA[1] * u[1] + q32 - q20) / 154.0,
        ]
    };
    let mut x = levels;
    let step = h / parts as f64;
    (0..samples)
        .map(|k| {
            let before = x;
            let u = back_and_forth(k, every);
            for _ in 0..parts {
                let add = |k: [f64; 3], h: f64| std::array::from_fn(|i| x[i] + h * k[i]);
                let k1 = rates(x, u);
                let k2 = rates(add(k1, 0.5 * step), u);
                let k3 = rates(add(k2, 0.5 * step), u);
                let k4 = rates(add(k3, step), u);
                x = std::array::from_fn(|i| {
                    x[i] + step / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
                });
            }
            before
        })
        .collect()
}

#[test]
fn levels_that_cross_follow_the_equations() {
    // The levels cross one another with every change of the pumps, and T1 and T3 stay together for long.
    let (levels, samples, every) = ([12.0, 9.0, 14.0], 700, 110);
    let reference = sharp(levels, samples, every, 1.0, 1000);
    let crossings = reference
        .windows(2)
        .filter(|pair| (pair[0][0] - pair[0][1]) * (pair[1][0] - pair[1][1]) < 0.0)
        .count();
    assert!(crossings >= 4, "{crossings} crossings of T1 and T3");
    // The second bound is that of the regularised valve: finer steps do not help beyond it.
    for (substeps, most) in [(1, 2e-5), (4, 2e-5)] {
        let mut simulator = simulator(&THETA, levels, [0.0; 2]);
        simulator.set_substeps(substeps);
        let mut worst = 0.0_f64;
        for (k, expected) in reference.iter().enumerate() {
            for (level, expected) in simulator.levels().iter().zip(expected) {
                worst = worst.max((level - expected).abs());
            }
            simulator.advance_both(held(back_and_forth(k, every)), 1.0);
        }
        println!("{crossings} crossings, {substeps} steps a sample: {worst:.1e} cm");
        assert!(worst < most, "{worst}");
    }
}

#[test]
fn derivatives_are_finite_and_right_where_levels_cross_and_rest() {
    let structure = rig(1, true);
    let start = [9.0, 9.0, 14.0];
    let variables: Vec<f64> = THETA.iter().chain(&start).copied().collect();
    let run = |x: &[f64]| -> Vec<f64> {
        let mut simulator = Simulator::with_inputs(&structure, &x[..5], &x[5..], [0.0; 2]).unwrap();
        (0..600)
            .map(|k| {
                simulator.advance_both(held(back_and_forth(k, 90)), 1.0);
                simulator.read(0)
            })
            .collect()
    };
    let duals: Vec<Dual<15>> = variables
        .iter()
        .enumerate()
        .map(|(lane, &value)| Dual::variable(value, lane))
        .collect();
    let mut simulator =
        Simulator::with_inputs(&structure, &duals[..5], &duals[5..], [0.0; 2]).unwrap();
    let exact: Vec<Dual<15>> = (0..600)
        .map(|k| {
            simulator.advance_both(held(back_and_forth(k, 90)), 1.0);
            simulator.read(0)
        })
        .collect();
    let plain = run(&variables);
    for (dual, plain) in exact.iter().zip(&plain) {
        assert_eq!(dual.re.to_bits(), plain.to_bits());
    }
    for lane in 0..8 {
        let largest = exact.iter().fold(0.0_f64, |m, y| m.max(y.eps[lane].abs()));
        assert!(largest.is_finite() && largest > 0.0);
        let step = 1e-5 * variables[lane];
        let moved = |by: f64| {
            let mut x = variables.clone();
            x[lane] += by;
            run(&x)
        };
        let (up, down) = (moved(step), moved(-step));
        let worst = exact
            .iter()
            .zip(up.iter().zip(&down))
            .map(|(y, (a, b))| ((a - b) / (2.0 * step) - y.eps[lane]).abs())
            .fold(0.0, f64::max);
        println!(
            "variable {lane}: {:.1e} of the largest derivative",
            worst / largest
        );
        assert!(
            worst < 1e-4 * largest,
            "variable {lane}: {worst} of {largest}"
        );
    }
}

/// Valves and an outlet with time constants far below a sample: the levels still follow, and the balance of mass holds.
#[test]
fn valves_that_are_over_within_a_step_settle() {
    for ratio in [3.0, 30.0, 300.0, 3e4] {
        let theta = [9.0, 8.5, 0.46 * ratio, 0.48 * ratio, 0.6];
        let duals: Vec<Dual<8>> = theta
            .iter()
            .enumerate()
            .map(|(lane, &value)| Dual::variable(value, lane))
            .collect();
        let levels = [14.0, 9.0, 4.0].map(Dual::constant);
        let mut simulator =
            Simulator::with_inputs(&rig(1, true), &duals, &levels, [0.0; 2]).unwrap();
        let mut content = 27.0;
        // Equivalent to one tank of three times the area, up to the heads that the flow needs.
        for k in 0..300 {
            let u = back_and_forth(k, 60);
            simulator.advance_both(held(u), 1.0);
            let steps = 200;
            for _ in 0..steps {
                let level = (content / 3.0_f64).max(0.0);
                let out = 0.6 * 0.5 * (2.0 * 981.0 * level).sqrt();
                content += (9.0 * u[0] + 8.5 * u[1] - out) / 154.0 / f64::from(steps);
            }
            let read = simulator.read(0);
            assert!(read.re.is_finite() && read.eps.iter().all(|e| e.is_finite()));
            if k > 5 {
                let head = 3.0 * (80.0 / (11.0 * ratio)).powi(2) + 0.02;
                assert!(
                    (read.re - content / 3.0).abs() < head,
                    "{ratio}, sample {k}: {} instead of {}",
                    read.re,
                    content / 3.0
                );
            }
        }
    }
}

#[test]
fn either_pump_may_have_what_a_pump_can_have() {
    // Pump 1 has a dead time and pump 2 is interrupted: their intervals end at different instants of a sample.
    let base = base(Plant::ThreeTank);
    let sets = [
        [("transport_delay", 0), ("pump_saturation", 1)],
        [("transport_delay", 1), ("pump_deadzone", 0)],
        [("pump_lag", 1), ("transport_delay", 0)],
        [("pump_gain_drift", 1), ("pump_saturation", 0)],
    ];
    for set in sets {
        let placed = set.map(|(id, vessel)| Placed {
            effect: effect(id),
            vessel,
        });
        let case = base.with_interior(&placed);
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            let input = input(drive, 200, case.h, 900 + seed as u64);
            let error = difference(&case.run(&input, 2), &reference::run(&case, &input));
            println!("{error:.1e} {set:?} {drive:?}");
            assert!(error < 3e-7, "{set:?} {drive:?}: {error:e}");
        }
    }
}

#[test]
fn any_tank_may_be_measured() {
    let input = input(DRIVES[0], 100, 1.0, 5);
    let base = base(Plant::ThreeTank);
    let at = |measured: usize| -> Vec<f64> {
        let mut case: Case = base.clone();
        case.structure.scales.outputs[0].vessel = measured;
        // The width of a valve's laminar part goes with the measured level.
        case.structure.scales.level = base.structure.scales.level;
        case.run(&input, 1)
    };
    let mut simulator = Simulator::with_inputs(
        &base.structure,
        &base.theta,
        &base.levels,
        [base.at_rest, mirrored(Command::held(base.at_rest)).from],
    )
    .unwrap();
    let read: Vec<[f64; 3]> = input
        .iter()
        .map(|&(command, h)| {
            let levels = simulator.levels();
            simulator.advance_both([command, mirrored(command)], h);
            levels
        })
        .collect();
    for measured in 0..3 {
        let levels: Vec<f64> = read.iter().map(|levels| levels[measured]).collect();
        assert_eq!(at(measured), levels);
    }
}

#[test]
fn a_second_pump_that_is_off_has_no_parameters_and_no_effects() {
    let (with, without) = (rig(2, true), rig(2, false));
    assert_eq!(
        with.parameter_names(),
        ["pump_gain_1", "pump_gain_2", "az13", "az32", "az20"]
    );
    assert_eq!(
        without.parameter_names(),
        ["pump_gain_1", "az13", "az32", "az20"]
    );
    let lag = |vessel| Placed {
        effect: effect("pump_lag"),
        vessel,
    };
    assert!(with.with(lag(1)).is_ok() && without.with(lag(0)).is_ok());
    let error = without.with(lag(1)).unwrap_err().to_string();
    assert!(error.contains("input_2"), "{error}");
    assert!(without.candidates().len() < with.candidates().len());
    let joined = Placed {
        effect: effect("coupled_tank"),
        vessel: 0,
    };
    let error = with.with(joined).unwrap_err().to_string();
    assert!(error.contains("joined as they are"), "{error}");
}
