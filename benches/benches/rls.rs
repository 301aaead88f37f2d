//! Time per recursive least squares update at 2, 5 and 10 parameters: factored, next to nalgebra's operators and dsmc, in one run.
//!
//! After criterion's figures come ratios: the shortest of many short runs, taken in turns, so that a busy machine disturbs
//! both sides alike.
#![allow(missing_docs, clippy::expect_used)]

mod rls_cases;

use std::hint::black_box;
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
    println!(
        "| {P} | {ours:.1} | {dynamic:.1} | {operators:.1} | {dsmc:.1} | {:.2} (at most {target}) | {:.2} |",
        ours / operators,
        ours / dsmc
    );
}

criterion_group!(benches, all);

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    println!("ns per update, shortest run:");
    println!(
        "| p | ct-rls | run-time size | nalgebra operators | dsmc | ct-rls/operators | ct-rls/dsmc |"
    );
    println!("|---|---|---|---|---|---|---|");
    ratios::<2>(0.85);
    ratios::<5>(0.65);
    ratios::<10>(0.55);
}
