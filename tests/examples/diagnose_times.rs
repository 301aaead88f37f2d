//! Computing time of a comparison and a diagnosis: wall time and processor time in seconds on two threads; and the result of the diagnosis,
//! so that changes of the search are visible.
//!
//! Records of 4000 samples from a closed loop with one hidden effect or two; and records that take long: three tanks, two tanks in
//! open loop with an effect whose threshold lies near the operating level, stamps that jitter.
//!
//! `RAYON_NUM_THREADS=2 cargo run --release -p ctid-tests --example diagnose_times`; an argument chooses the cells whose name
//! holds it, a second one the largest number of effects (1, then 6).

use std::{error::Error, fs, path::PathBuf};

use clap::Parser;
use ctid_tests::{Drive, Rig, three_tanks};
use missing_effect::{Options, Problem, TIME_LIMIT, compare, diagnose};
use plants::Plant;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Measures what a diagnosis costs.
#[derive(Debug, Parser)]
struct Arguments {
    /// Only cells whose name contains this, as `three-tank`, `open` or `jitter`.
    #[arg(default_value = "")]
    filter: String,
    /// Largest number of effects; 1, then 6, where it is not given.
    most: Option<usize>,
    /// Writes every cell.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// The hidden effect, its vessel, its parameters.
type Hidden = Vec<(&'static str, usize, Vec<f64>)>;

/// A problem and its name.
struct Cell {
    name: String,
    problem: Problem,
}

/// Seconds of processor time of this process so far; not a number where the system does not tell.
fn processor() -> f64 {
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat
        .rsplit(')')
        .next()
        .unwrap_or("")
        .split_whitespace()
        .collect();
    let ticks = |at: usize| fields.get(at).and_then(|field| field.parse::<f64>().ok());
    ticks(11)
        .zip(ticks(12))
        .map_or(f64::NAN, |(user, system)| (user + system) / 100.0)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let most = arguments.most.map_or(vec![1, 6], |most| vec![most]);
    let mut cells = in_loop();
    cells.extend(slow());
    cells.retain(|cell| cell.name.contains(&arguments.filter));
    let limited = Options {
        time_limit: Some(TIME_LIMIT),
        ..Options::default()
    };
    println!(
        "{:<56} {:>7} {:>7} {:>4} {:>7} {:>7}  found",
        "cell", "compare", "cpu", "most", "wall", "cpu"
    );
    let mut all: Vec<Value> = Vec::new();
    for Cell { name, problem } in cells {
        let before = processor();
        let compared = compare(&problem, &limited)?;
        let compare_cpu = processor() - before;
        for &max_effects in &most {
            let options = Options {
                max_effects,
                ..limited
            };
            let before = processor();
            let found = diagnose(&problem, &options, &|_| {})?;
            let cpu = processor() - before;
            println!(
                "{name:<56} {:>7.2} {compare_cpu:>7.2} {max_effects:>4} {:>7.2} {cpu:>7.2}  {:?} {:?} {:?}",
                compared.seconds,
                found.seconds,
                found.verdict,
                found.groups,
                found.steps.iter().map(|step| step.rmse).collect::<Vec<_>>(),
            );
            all.push(json!({
                "cell": name,
                "compare_seconds": compared.seconds,
                "compare_cpu": compare_cpu,
                "max_effects": max_effects,
                "seconds": found.seconds,
                "cpu": cpu,
                "verdict": found.verdict,
                "groups": found.groups,
                "left_out": found.effort.left_out,
            }));
        }
    }
    if let Some(path) = &arguments.json {
        fs::write(path, serde_json::to_string_pretty(&all)? + "\n")?;
        println!("wrote {}", path.display());
    }
    Ok(())
}

fn names(hidden: &Hidden) -> String {
    let names: Vec<&str> = hidden.iter().map(|(effect, ..)| *effect).collect();
    names.join("+")
}

/// Records of 4000 samples from a known loop.
fn in_loop() -> Vec<Cell> {
    let rigs: [(Rig, Hidden); 5] = [
        (Rig::single_tank(), vec![("pump_deadzone", 0, vec![0.5])]),
        (Rig::single_tank(), vec![("pump_lag", 0, vec![8.0])]),
        (Rig::cascaded_tanks(), vec![("sensor_lag", 0, vec![10.0])]),
        (Rig::cascaded_tanks(), vec![("const_leak", 0, vec![3.0])]),
        (
            Rig::cascaded_tanks(),
            vec![
                ("sensor_lag", 0, vec![10.0]),
                ("pump_deadzone", 0, vec![0.5]),
            ],
        ),
    ];
    let mut cells = Vec::new();
    for (rig, hidden) in rigs {
        for colour in [0.0, 0.9] {
            let rig = Rig {
                drive: Drive::Closed,
                colour,
                noise: 0.1,
                samples: 4000,
                hidden: hidden.clone(),
                ..rig.clone()
            };
            let record = rig.run(&mut ChaCha8Rng::seed_from_u64(7));
            let mut problem = rig.problem(record);
            problem.controller = Some(rig.controller());
            cells.push(Cell {
                name: format!("{} {} {colour}", rig.plant.id(), names(&hidden)),
                problem,
            });
        }
    }
    cells
}

/// Open-loop records with a long computing time.
fn slow() -> Vec<Cell> {
    let mut cells = Vec::new();
    let leak: (&str, usize, &[f64]) = ("const_leak", 1, &[3.0]);
    for hidden in [None, Some(leak)] {
        let record = three_tanks::record(hidden, 800, 7);
        let effect = hidden.map_or("nothing", |(effect, ..)| effect);
        cells.push(Cell {
            name: format!("three-tank {effect} open 800"),
            problem: Problem {
                plant: Plant::ThreeTank,
                known: three_tanks::known(),
                ..Rig::single_tank().problem(record)
            },
        });
    }
    // The lower tank works near 16 cm.
    let thresholds: [Hidden; 2] = [
        vec![("overflow", 1, vec![17.0])],
        vec![("leak_at_height", 1, vec![4.0, 15.0])],
    ];
    for hidden in thresholds {
        for samples in [2500, 4000] {
            let rig = Rig {
                samples,
                hidden: hidden.clone(),
                ..Rig::cascaded_tanks()
            };
            cells.push(open(&rig));
        }
    }
    let linear = Rig::linear_tank();
    let two = Rig {
        plant: Plant::CascadedTanksLinear,
        theta: vec![6.4, 60.0, 100.0, -16.0],
        levels: vec![32.0, 16.0],
        ..Rig::cascaded_tanks()
    };
    let jittered: [(Rig, Hidden); 4] = [
        (linear.clone(), vec![]),
        (
            // Together with a dead zone, a larger offset gives the same level.
            Rig {
                theta: vec![6.4, 100.0, 6.0],
                ..linear
            },
            vec![("pump_deadzone", 0, vec![4.0])],
        ),
        (two.clone(), vec![]),
        (two, vec![("sensor_lag", 0, vec![10.0])]),
    ];
    for (rig, hidden) in jittered {
        cells.push(open(&Rig {
            samples: 4000,
            jitter: 0.03,
            hidden,
            ..rig
        }));
    }
    cells
}

fn open(rig: &Rig) -> Cell {
    let hidden = if rig.hidden.is_empty() {
        "nothing".to_string()
    } else {
        names(&rig.hidden)
    };
    let jitter = if rig.jitter > 0.0 { " jitter" } else { "" };
    let record = rig.run(&mut ChaCha8Rng::seed_from_u64(7));
    Cell {
        name: format!("{} {hidden} open {}{jitter}", rig.plant.id(), rig.samples),
        problem: rig.problem(record),
    }
}
