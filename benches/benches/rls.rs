//! Time per recursive least squares update at 2, 5 and 10 parameters: factored, next to nalgebra's operators and dsmc, and
//! padasip where `python3` has it (or the program that the variable PYTHON names), in one run.
//!
//! After criterion's figures come ratios: the shortest of many short runs, taken in turns, so that a busy machine disturbs
//! both sides alike.
#![allow(missing_docs, clippy::expect_used)]

mod rls_cases;

use std::hint::black_box;
use std::process::Command;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group};
use rls_cases::{Dsmc, Dynamic, Factored, Operators, SAMPLES, samples};

fn updates<const P: usize>(criterion: &mut Criterion) {
    let samples = samples::<P>();
    let mut group = criterion.benchmark_group(format!("rls/p={P}"));
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.bench_function("ct-rls", |b| b.iter(|| Factored::<P>::new().run(&samples)));
    group.bench_function("ct-rls, run-time size", |b| {
        b.iter(|| Dynamic::new(P).run(&samples))
    });
    group.bench_function("directional", |b| {
        b.iter(|| Factored::directional().run(&samples))
    });
    group.bench_function("random walk of all", |b| {
        b.iter(|| Factored::walk(P).run(&samples))
    });
    group.bench_function("nalgebra operators", |b| {
        b.iter(|| Operators::<P>::new().run(&samples))
    });
    group.bench_function("dsmc", |b| b.iter(|| Dsmc::new(P).run(&samples)));
    group.finish();
}

fn all(criterion: &mut Criterion) {
    updates::<2>(criterion);
    updates::<5>(criterion);
    updates::<10>(criterion);
}

fn shortest(runs: &mut [(Duration, &mut dyn FnMut() -> f64)], rounds: usize) {
    for _ in 0..rounds {
        for (best, run) in runs.iter_mut() {
            let start = Instant::now();
            black_box(run());
            *best = start.elapsed().min(*best);
        }
    }
}

/// Nanoseconds per update of padasip, or why there is no figure.
fn padasip(p: usize) -> Result<f64, String> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let output = Command::new(&python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/padasip_rls.py"))
        .arg(p.to_string())
        .output()
        .map_err(|e| format!("{python} does not start: {e}"))?;
    let said = String::from_utf8_lossy(&output.stdout);
    said.trim().parse().map_err(|_| {
        let errors = String::from_utf8_lossy(&output.stderr);
        let last = errors.lines().last().unwrap_or("it says nothing");
        format!("{last} (`pip install padasip` in the environment of {python})")
    })
}

fn ratios<const P: usize>(target: f64) {
    let samples = samples::<P>();
    let mut factored = || Factored::<P>::new().run(&samples);
    let mut dynamic = || Dynamic::new(P).run(&samples);
    let mut operators = || Operators::<P>::new().run(&samples);
    let mut dsmc = || Dsmc::new(P).run(&samples);
    let mut runs: [(Duration, &mut dyn FnMut() -> f64); 4] = [
        (Duration::MAX, &mut factored),
        (Duration::MAX, &mut dynamic),
        (Duration::MAX, &mut operators),
        (Duration::MAX, &mut dsmc),
    ];
    shortest(&mut runs, 2000);
    let [ours, dynamic, operators, dsmc] =
        runs.map(|(best, _)| best.as_nanos() as f64 / SAMPLES as f64);
    let padasip = padasip(P);
    let python = padasip
        .as_ref()
        .map_or("- | -".into(), |ns| format!("{ns:.0} | {:.4}", ours / ns));
    println!(
        "| {P} | {ours:.1} | {dynamic:.1} | {operators:.1} | {dsmc:.1} | {:.2} (at most {target}) | {:.2} | {python} |",
        ours / operators,
        ours / dsmc
    );
    if let Err(reason) = padasip {
        println!("padasip skipped: {reason}");
    }
}

/// Ways to forget, against exponential forgetting by the exact step.
fn forgetting<const P: usize>() {
    let samples = samples::<P>();
    let mut exponential = || Factored::<P>::new().run(&samples);
    let mut directional = || Factored::<P, _>::directional().run(&samples);
    let mut walk_of_one = || Factored::<P, _>::walk(1).run(&samples);
    let mut walk_of_two = || Factored::<P, _>::walk(2).run(&samples);
    let mut walk_of_all = || Factored::<P, _>::walk(P).run(&samples);
    let mut runs: [(Duration, &mut dyn FnMut() -> f64); 5] = [
        (Duration::MAX, &mut exponential),
        (Duration::MAX, &mut directional),
        (Duration::MAX, &mut walk_of_one),
        (Duration::MAX, &mut walk_of_two),
        (Duration::MAX, &mut walk_of_all),
    ];
    shortest(&mut runs, 2000);
    let ns = runs.map(|(best, _)| best.as_nanos() as f64 / SAMPLES as f64);
    let [exponential, others @ ..] = ns;
    let others = others
        .map(|other| format!("{other:.1} ({:.2})", other / exponential))
        .join(" | ");
    println!("| {P} | {exponential:.1} | {others} |");
}

criterion_group!(benches, all);

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    println!("ns per update, shortest run:");
    println!(
        "| p | ct-rls | run-time size | nalgebra operators | dsmc | ct-rls/operators | ct-rls/dsmc | padasip | ct-rls/padasip |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    ratios::<2>(0.85);
    ratios::<5>(0.65);
    ratios::<10>(0.55);
    println!("ns per update by what is forgotten, and the ratio to exponential forgetting:");
    println!(
        "| p | exponential | directional | random walk of 1 | random walk of 2 | random walk of all |"
    );
    println!("|---|---|---|---|---|---|");
    forgetting::<2>();
    forgetting::<5>();
    forgetting::<10>();
}
