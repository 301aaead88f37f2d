//! Fits in closed loop, on the measured command and in the simulated loop: bias, spread and coverage.
//!
//! `cargo run --release -p greybox --example closed_loop -- 200`

use std::collections::BTreeMap;

use ct_signals::{Channel, Record, excitation, noise};
use greybox::{FitOptions, Noise, Setup, coloured, fit_from, robust};
use plants::controller::Controller;
use plants::{Command, Plant, Scales, Simulator, Structure};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use support::Rig;

#[path = "../tests/all/support/mod.rs"]
mod support;

const SAMPLES: usize = 800;
const INTERVAL: f64 = 2.0;

/// Noise model: `v = a v + e + c e_before`.
#[derive(Clone, Copy)]
struct Colour {
    name: &'static str,
    a: f64,
    c: f64,
}

/// A record of the rig in the loop.
fn in_loop(
    rig: &Rig,
    controller: &Controller,
    colour: Colour,
    sigma: f64,
    seed: u64,
) -> Option<Record> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let scales = Scales::from_ranges(
        (0.0, 10.0),
        (5.0, 25.0),
        INTERVAL,
        INTERVAL * SAMPLES as f64,
    );
    let structure = Structure::new(rig.plant, rig.known(), scales);
    let mut simulator = Simulator::new(&structure, &rig.theta, &rig.levels, 5.0).ok()?;
    let mut regulator = controller.start(&[5.0]);
    let level = *rig.levels.last()?;
    let r = excitation::steps(SAMPLES, 40..=120, 0.9 * level, 1.1 * level, &mut rng).ok()?;
    let e = noise::white(SAMPLES + 200, 1.0, &mut rng);
    let mut v = Vec::with_capacity(SAMPLES + 200);
    for k in 0..e.len() {
        let before = if k > 0 {
            (v[k - 1], e[k - 1])
        } else {
            (0.0, 0.0)
        };
        v.push(colour.a * before.0 + e[k] + colour.c * before.1);
    }
    let v = &v[200..];
    let rms = (v.iter().map(|v| v * v).sum::<f64>() / SAMPLES as f64).sqrt();
    let (mut u, mut y) = (Vec::new(), Vec::new());
    for k in 0..SAMPLES {
        let reading = simulator.read(0) + sigma * v[k] / rms;
        let command = regulator.command(r[k], reading, INTERVAL);
        simulator.advance(Command::held(command), INTERVAL);
        y.push(reading);
        u.push(command);
    }
    Some(Record {
        name: "rig".into(),
        time: (0..SAMPLES).map(|k| k as f64 * INTERVAL).collect(),
        inputs: vec![Channel::new("u", "V", u)],
        outputs: vec![Channel::new("y", "cm", y)],
        references: vec![Channel::new("r", "cm", r)],
        ..Record::default()
    })
}

type Estimate = (Vec<f64>, Vec<Option<f64>>);

fn ways(rig: &Rig, controller: &Controller, record: Record) -> Option<Vec<Estimate>> {
    let records = [record];
    let stopping = FitOptions::default().stopping;
    let white = Noise::white(1);
    let count = rig.theta.len();
    let setup = Setup::from_records(rig.plant, rig.known(), &[], &records, BTreeMap::new()).ok()?;
    let mut truth = rig.theta.clone();
    truth.extend(&rig.levels);
    let mut estimates = Vec::new();
    let own = |setup: &Setup, x: &[f64]| -> Option<(Vec<f64>, [Estimate; 2])> {
        let fit = fit_from(setup, &[x.to_vec()], &white, stopping).ok()?;
        let robust = robust(setup, &fit, 6).ok()?;
        let col = coloured(setup, fit.clone(), 6, stopping).ok()?;
        let half = col.half_widths(0.95);
        Some((
            col.x.clone(),
            [
                (
                    fit.x[..count].to_vec(),
                    robust.half_widths(0.95)[..count].to_vec(),
                ),
                (col.x[..count].to_vec(), half[..count].to_vec()),
            ],
        ))
    };
    let (x, measured) = own(&setup, &truth)?;
    estimates.extend(measured);
    let mut setup = setup;
    setup.structure.scales = setup.scales_at(&x).ok()?;
    let setup = setup.with_structure(setup.structure.clone()).ok()?;
    let (looped, x) = setup.in_loop(controller, &x).ok()?;
    estimates.extend(own(&looped, &x)?.1);
    Some(estimates)
}

fn main() {
    let runs: u64 = std::env::args()
        .nth(1)
        .and_then(|n| n.parse().ok())
        .unwrap_or(200);
    let rigs = [
        Rig {
            plant: Plant::SingleTankLinear,
            theta: vec![6.4, 100.0, -16.0],
            levels: vec![16.0],
            ..Rig::single_tank()
        },
        Rig {
            plant: Plant::SingleTank,
            theta: vec![10.0, 12.5],
            levels: vec![16.0],
            ..Rig::single_tank()
        },
        Rig {
            plant: Plant::CascadedTanks,
            theta: vec![10.0, 18.0, 12.5],
            levels: vec![7.7, 16.0],
            ..Rig::single_tank()
        },
    ];
    let colours = [
        Colour {
            name: "white",
            a: 0.0,
            c: 0.0,
        },
        Colour {
            name: "AR 0.9",
            a: 0.9,
            c: 0.0,
        },
        Colour {
            name: "AR 0.98",
            a: 0.98,
            c: 0.0,
        },
        Colour {
            name: "MA 0.95",
            a: 0.0,
            c: 0.95,
        },
        Colour {
            name: "ARMA .95 -.7",
            a: 0.95,
            c: -0.7,
        },
    ];
    println!(
        "{:<20} {:<13} {:<18} bias/spread, spread/value, coverage of each parameter",
        "plant", "noise", "way"
    );
    for rig in &rigs {
        for colour in colours {
            let limits = (0.0, 10.0);
            let Ok(controller) = Controller::pi(0.6, 60.0, limits) else {
                return;
            };
            let all: Vec<Vec<Estimate>> = (0..runs)
                .into_par_iter()
                .filter_map(|seed| {
                    ways(
                        rig,
                        &controller,
                        in_loop(rig, &controller, colour, 0.3, seed)?,
                    )
                })
                .collect();
            for (way, name) in [
                "measured, white",
                "measured, colour",
                "loop, white",
                "loop, colour",
            ]
            .into_iter()
            .enumerate()
            {
                print!("{:<20} {:<13} {:<18}", rig.plant.id(), colour.name, name);
                for (i, truth) in rig.theta.iter().enumerate() {
                    let n = all.len() as f64;
                    let mean = all.iter().map(|e| e[way].0[i]).sum::<f64>() / n;
                    let spread = (all
                        .iter()
                        .map(|e| (e[way].0[i] - mean).powi(2))
                        .sum::<f64>()
                        / n)
                        .sqrt();
                    let hits = all
                        .iter()
                        .filter(|e| {
                            e[way].1[i].is_some_and(|half| (e[way].0[i] - truth).abs() <= half)
                        })
                        .count();
                    print!(
                        "  {:>6.2} {:>8.5} {:>5.1}",
                        (mean - truth) / spread,
                        spread / truth.abs(),
                        100.0 * hits as f64 / n
                    );
                }
                println!("  n {}", all.len());
            }
        }
    }
}
