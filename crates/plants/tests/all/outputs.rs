//! Plants of which several levels are read.

use crate::support::{Case, DRIVES, base, effect, input, interior, mirrored};
use plants::{Command, Dual, Known, Placed, Plant, Scalar, Simulator, SimulatorNumber, Structure};

/// The plant with these levels read, in this order.
fn reading(plant: Plant, measured: &[usize]) -> Case {
    let mut case = base(plant);
    let known = Known {
        measured: measured.to_vec(),
        ..case.structure.known.clone()
    };
    let scales = case.structure.scales.clone();
    case.structure = Structure::new(plant, known, scales);
    case
}

/// The case with an effect, its parameters at values with influence, and a lag that has not settled.
fn with(case: &Case, id: &str, output: usize) -> Case {
    let placed = Placed {
        effect: effect(id),
        vessel: output,
    };
    let mut with = case.clone();
    with.structure = case.structure.with(placed).unwrap();
    for info in with.structure.effect_parameters(placed) {
        with.theta.push(interior(case, placed, &info));
    }
    let lags = with.structure.lags();
    with.levels.extend(lags.iter().map(|_| 1.3));
    with
}

/// Readings of all outputs and levels of all vessels at every sample.
fn run<T: SimulatorNumber>(
    case: &Case,
    variables: &[T],
    input: &[(Command, f64)],
) -> Vec<(Vec<T>, [T; 3])> {
    let (theta, levels) = variables.split_at(case.theta.len());
    let at_rest = [case.at_rest, mirrored(Command::held(case.at_rest)).from];
    let mut simulator = Simulator::with_inputs(&case.structure, theta, levels, at_rest).unwrap();
    input
        .iter()
        .map(|&(command, h)| {
            let outputs = 0..simulator.outputs();
            let readings = outputs.map(|output| simulator.read(output)).collect();
            let levels = simulator.levels();
            simulator.advance_both([command, mirrored(command)], h);
            (readings, levels)
        })
        .collect()
}

const CASES: [(Plant, &[usize]); 6] = [
    (Plant::CascadedTanks, &[0, 1]),
    (Plant::CascadedTanks, &[1, 0]),
    (Plant::CascadedTanksLinear, &[0, 1]),
    (Plant::ThreeTank, &[0, 1, 2]),
    (Plant::ThreeTank, &[2, 0, 1]),
    (Plant::ThreeTank, &[2, 0]),
];

#[test]
fn every_output_reads_the_level_of_its_vessel() {
    for (plant, measured) in CASES {
        let case = reading(plant, measured);
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            let input = input(drive, 150, case.h, 600 + seed as u64);
            let mut lowest = vec![f64::INFINITY; measured.len()];
            for (readings, levels) in run(&case, &case.variables(), &input) {
                let wanted: Vec<f64> = measured.iter().map(|&vessel| levels[vessel]).collect();
                assert_eq!(readings, wanted, "{} {measured:?}", plant.id());
                for (lowest, reading) in lowest.iter_mut().zip(readings) {
                    *lowest = lowest.min(reading);
                }
            }
            assert!(lowest.iter().all(|lowest| *lowest > 1.0), "{lowest:?}");
        }
    }
}

/// Largest difference between the derivatives of an output and central differences, as a share of the largest with respect to that
/// variable. Of two lengths of the difference the better one is used: one may cross a corner of the output.
fn disagreement(case: &Case, input: &[(Command, f64)], output: usize) -> f64 {
    let variables = case.variables();
    let duals: Vec<Dual<15>> = variables
        .iter()
        .enumerate()
        .map(|(lane, &value)| Dual::variable(value, lane))
        .collect();
    let of = |at: &[f64]| -> Vec<f64> {
        let run = run(case, at, input);
        run.iter().map(|(readings, _)| readings[output]).collect()
    };
    let exact: Vec<Dual<15>> = run(case, &duals, input)
        .iter()
        .map(|(readings, _)| readings[output])
        .collect();
    let plain = of(&variables);
    for (dual, plain) in exact.iter().zip(&plain) {
        assert_eq!(dual.re.to_bits(), plain.to_bits());
    }
    let reading = plain.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    let mut worst = 0.0_f64;
    for lane in 0..variables.len() {
        let scale = variables[lane].abs().max(0.1);
        let shares = [1e-4, 1e-5, 1e-6];
        let differences = shares.map(|share| {
            let moved = |by: f64| {
                let mut moved = variables.clone();
                moved[lane] += by;
                of(&moved)
            };
            let step = share * scale;
            let (up, down) = (moved(step), moved(-step));
            let pairs = up.iter().zip(&down);
            pairs
                .map(|(a, b)| (a - b) / (2.0 * step))
                .collect::<Vec<f64>>()
        });
        let least = 1e-6 * reading / scale;
        let largest = exact.iter().fold(least, |m, y| m.max(y.eps[lane].abs()));
        for (k, y) in exact.iter().enumerate() {
            let errors = differences.iter().map(|d| (d[k] - y.eps[lane]).abs());
            worst = worst.max(errors.fold(f64::INFINITY, f64::min) / largest);
        }
    }
    worst
}

const AT_SENSORS: [&str; 6] = [
    "sensor_lag",
    "sensor_nonlinearity",
    "sensor_offset",
    "sensor_drift",
    "sensor_hysteresis",
    "sensor_saturation",
];

#[test]
fn an_effect_at_a_sensor_changes_its_output_alone() {
    for (plant, measured) in CASES {
        let base = reading(plant, measured);
        let input = input(DRIVES[1], 120, base.h, 640);
        let without = run(&base, &base.variables(), &input);
        for id in AT_SENSORS {
            for output in 0..measured.len() {
                let mut case = with(&base, id, output);
                let own = base.theta.len();
                // Middle of the range of the readings.
                let readings = without.iter().map(|(readings, _)| readings[output]);
                let middle = readings.sum::<f64>() / without.len() as f64;
                match id {
                    "sensor_saturation" => case.theta[own] = middle,
                    "sensor_hysteresis" => case.theta[own + 1] = middle - 1.0,
                    _ => {}
                }
                let read = run(&case, &case.variables(), &input);
                let mut moved = vec![0.0_f64; measured.len()];
                for ((with, levels), (readings, same)) in read.iter().zip(&without) {
                    assert_eq!(levels, same);
                    for (moved, (a, b)) in moved.iter_mut().zip(with.iter().zip(readings)) {
                        *moved = moved.max((a - b).abs());
                    }
                }
                for (o, moved) in moved.iter().enumerate() {
                    let as_wanted = if o == output {
                        *moved > 0.01
                    } else {
                        *moved == 0.0
                    };
                    let which = format!("{} {measured:?} {id}@{output}", plant.id());
                    assert!(as_wanted, "{which}: output {o} moves by {moved}");
                }
            }
        }
    }
}

#[test]
fn each_output_has_the_derivatives_of_its_readings() {
    for (plant, measured) in CASES {
        let base = reading(plant, measured);
        for (i, id) in AT_SENSORS.into_iter().enumerate() {
            for at in 0..measured.len() {
                let case = with(&base, id, at);
                let input = input(DRIVES[i % 4], 100, base.h, 660 + i as u64);
                for output in 0..measured.len() {
                    let error = disagreement(&case, &input, output);
                    let which = format!("{} {measured:?} {id}@{at}, output {output}", plant.id());
                    println!("{error:8.1e} {which}");
                    assert!(error < 1e-6, "{which}: {error:e}");
                }
            }
        }
    }
}

#[test]
fn a_lag_follows_the_level_that_its_sensor_reads() {
    // Against the lag's own equation between the readings of the level, in short steps.
    for plant in [
        Plant::CascadedTanks,
        Plant::CascadedTanksLinear,
        Plant::ThreeTank,
    ] {
        let case = with(&reading(plant, &[0, 1]), "sensor_lag", 0);
        let input = input(DRIVES[2], 150, case.h, 680);
        let parts = 40;
        let fine: Vec<(Command, f64)> = input
            .iter()
            .flat_map(|&(command, h)| {
                let to = command.to.unwrap();
                let at =
                    move |k: usize| command.from + (to - command.from) * k as f64 / parts as f64;
                (0..parts).map(move |k| (Command::ramp(at(k), at(k + 1)), h / parts as f64))
            })
            .collect();
        let levels: Vec<f64> = run(&case, &case.variables(), &fine)
            .iter()
            .map(|(_, levels)| levels[0])
            .collect();
        let lag = case.theta.last().unwrap();
        let step = case.h / parts as f64;
        let before = case.levels.last().unwrap();
        let mut behind = levels[0] + before * (-case.h / lag).exp();
        let mut worst = 0.0_f64;
        let read = run(&case, &case.variables(), &input);
        for (k, (readings, _)) in read.iter().enumerate() {
            worst = worst.max((readings[0] - behind).abs());
            for i in k * parts..((k + 1) * parts).min(levels.len() - 1) {
                // The level is nearly linear over such a short step.
                let slope = (levels[i + 1] - levels[i]) / step;
                let settled = |level: f64| level - slope * lag;
                let left = (behind - settled(levels[i])) * (-step / lag).exp();
                behind = settled(levels[i + 1]) + left;
            }
        }
        println!("{worst:8.1e} {}", plant.id());
        assert!(worst < 1e-4, "{}: {worst:e}", plant.id());
    }
}
