//! What a diagnosis costs: seconds of wall and of processor time on two threads, for records of 4000 samples from a closed
//! loop with one hidden effect or two, singles and sets; and what it found, so that a change of the search shows.
//!
//! `RAYON_NUM_THREADS=2 cargo run --release -p ctid-tests --example diagnose_times`; an argument chooses the cells whose name
//! holds it, a second one the largest number of effects (1, then 6).

use ctid_tests::{Drive, Rig};
use missing_effect::{Options, diagnose};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Seconds of processor time of this process so far; not a number where the system does not tell.
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
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

fn main() -> Result<(), missing_effect::Error> {
    let wanted = std::env::args().nth(1).unwrap_or_default();
    let most: Vec<usize> = match std::env::args().nth(2).and_then(|n| n.parse().ok()) {
        Some(most) => vec![most],
        None => vec![1, 6],
    };
    let rigs = [
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
    println!(
        "{:<46} {:>4} {:>7} {:>7}  found",
        "cell", "most", "wall", "cpu"
    );
    for (rig, hidden) in rigs {
        let names: Vec<&str> = hidden.iter().map(|(effect, ..)| *effect).collect();
        for colour in [0.0, 0.9] {
            let cell = format!("{} {} {colour}", rig.plant.id(), names.join("+"));
            if !cell.contains(&wanted) {
                continue;
            }
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
            for &max_effects in &most {
                let options = Options {
                    max_effects,
                    ..Options::default()
                };
                let before = processor();
                let found = diagnose(&problem, &options, &|_| {})?;
                println!(
                    "{cell:<46} {max_effects:>4} {:>7.2} {:>7.2}  {:?} {:?} {:?}",
                    found.seconds,
                    processor() - before,
                    found.verdict,
                    found.groups,
                    found.steps.iter().map(|step| step.rmse).collect::<Vec<_>>(),
                );
            }
        }
    }
    Ok(())
}
