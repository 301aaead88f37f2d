//! Diagnoses in closed loop, on the measured command and in the simulated loop: effects, groups, false claims, seconds.
//!
//! `cargo run --release -p ctid-tests --example diagnose_in_loop -- 12`; the records of a cell, then the correlation of the
//! coloured noise (0.9) and only cells whose plant, effect and correlation contain this, as `single-tank/overflow/` (all).

use ctid_tests::{Drive, Rig};
use missing_effect::{Diagnosis, Options, Verdict, diagnose};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

type Hidden = Option<(&'static str, f64)>;

/// Result of one record.
struct Answer {
    claimed: bool,
    truth_in_group: bool,
    size: usize,
    decided: bool,
    seconds: f64,
}

fn answer(found: &Diagnosis, hidden: Hidden) -> Answer {
    let group = hidden.and_then(|(effect, _)| {
        found
            .groups
            .iter()
            .find(|group| group.iter().any(|named| named == effect))
    });
    Answer {
        claimed: !found.effects.is_empty(),
        truth_in_group: group.is_some(),
        size: group.map_or(0, Vec::len),
        decided: found.verdict == Verdict::Effect && found.effects.len() == 1,
        seconds: found.seconds,
    }
}

fn main() {
    let runs: u64 = std::env::args()
        .nth(1)
        .and_then(|n| n.parse().ok())
        .unwrap_or(10);
    let rigs: [(Rig, &[Hidden]); 3] = [
        (
            Rig::single_tank(),
            &[
                None,
                Some(("pump_deadzone", 0.3)),
                Some(("pump_lag", 6.0)),
                Some(("overflow", 19.3)),
            ],
        ),
        (Rig::cascaded_tanks(), &[None, Some(("sensor_lag", 10.0))]),
        (Rig::linear_tank(), &[None, Some(("transport_delay", 6.0))]),
    ];
    let slow: f64 = std::env::args()
        .nth(2)
        .and_then(|colour| colour.parse().ok())
        .unwrap_or(0.9);
    let only = std::env::args().nth(3);
    println!(
        "{:<20} {:<16} {:<7} {:<9} named  truth in group  alone  size  seconds",
        "plant", "hidden", "colour", "way"
    );
    for (rig, effects) in &rigs {
        for hidden in effects.iter() {
            for colour in [0.0, slow, 0.98] {
                // The slowest noise is the trap for false claims.
                if hidden.is_some() && colour > 0.95 {
                    continue;
                }
                let effect = hidden.map_or("nothing".to_string(), |(effect, size)| {
                    format!("{effect} {size}")
                });
                let name = hidden.map_or("nothing", |(effect, _)| effect);
                let cell = format!("{}/{name}/{colour}/", rig.plant.id());
                if only.as_ref().is_some_and(|only| !cell.contains(only)) {
                    continue;
                }
                for simulate_loop in [false, true] {
                    let rig = Rig {
                        drive: Drive::Closed,
                        colour,
                        noise: 0.1,
                        hidden: hidden
                            .map(|(effect, size)| (effect, 0, vec![size]))
                            .into_iter()
                            .collect(),
                        ..rig.clone()
                    };
                    let answers: Vec<Answer> = (0..runs)
                        .into_par_iter()
                        .filter_map(|seed| {
                            let record = rig.run(&mut ChaCha8Rng::seed_from_u64(7000 + seed));
                            let mut problem = rig.problem(record);
                            problem.controller = Some(rig.controller());
                            let options = Options {
                                simulate_loop,
                                ..Options::default()
                            };
                            let found = diagnose(&problem, &options, &|_| {}).ok()?;
                            Some(answer(&found, *hidden))
                        })
                        .collect();
                    let count =
                        |what: fn(&Answer) -> bool| answers.iter().filter(|a| what(a)).count();
                    let sizes: usize = answers.iter().map(|a| a.size).sum();
                    println!(
                        "{:<20} {:<16} {:<7} {:<9} {:>2}/{:<2}  {:>14}  {:>5}  {:>4.1}  {:>7.2}",
                        rig.plant.id(),
                        effect,
                        colour,
                        if simulate_loop { "loop" } else { "measured" },
                        count(|a| a.claimed),
                        answers.len(),
                        count(|a| a.truth_in_group),
                        count(|a| a.truth_in_group && a.decided),
                        sizes as f64 / count(|a| a.truth_in_group).max(1) as f64,
                        answers.iter().map(|a| a.seconds).sum::<f64>()
                            / answers.len().max(1) as f64
                    );
                }
            }
        }
    }
}
