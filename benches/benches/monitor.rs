//! Time per row of the monitor, next to the simulation of the same plant with the same derivatives in the same run.
//!
//! The plant is a single tank with white noise; the monitor has learned and watches. What it adds to the simulation is the whitening, the
//! tracker, the scores, the ring of rows, and a checkpoint every 2048 rows.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use ct_signals::{excitation, noise};
use monitor::{Model, Monitor, Row, Settings, Units};
use plants::{Command, Dual, Known, Plant, Scalar, Scales, Simulator, Structure};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

const LEARNED: usize = 1000;
const ROWS: usize = 4096;
const THETA: [f64; 2] = [10.0, 12.5];

fn known() -> Known {
    Known {
        area: [Some(154.0), None, None],
        ..Known::default()
    }
}

fn structure() -> Structure {
    let scales = Scales::from_ranges((4.0, 6.0), (10.0, 23.0), 2.0, 2.0 * LEARNED as f64);
    Structure::new(Plant::SingleTank, known(), scales)
}

fn rows() -> Vec<Row> {
    let rng = &mut ChaCha8Rng::seed_from_u64(1);
    let count = LEARNED + ROWS;
    let command = excitation::steps(count, 20..=90, 4.0, 6.0, rng).unwrap();
    let noise = noise::white(count, 0.05, rng);
    let mut tank = Simulator::<f64>::new(&structure(), &THETA, &[16.0], 5.0).unwrap();
    (0..count)
        .map(|k| {
            let output = tank.read(0) + noise[k];
            tank.advance(Command::held(command[k]), 2.0);
            Row::new(2.0 * k as f64, command[k], &[output])
        })
        .collect()
}

fn learned(rows: &[Row]) -> Monitor {
    let model = Model::new(Plant::SingleTank, known());
    let mut monitor = Monitor::new(model, Settings::default(), Units::default()).unwrap();
    for row in &rows[..LEARNED] {
        monitor.update(row).unwrap();
    }
    assert!(monitor.time_constant().is_some());
    monitor
}

fn benchmark(criterion: &mut Criterion) {
    let rows = rows();
    let mut group = criterion.benchmark_group("monitor");
    group.throughput(Throughput::Elements(ROWS as u64));
    group.bench_function("simulation with 4 derivatives", |bencher| {
        let theta = [
            Dual::<4>::variable(THETA[0], 0),
            Dual::variable(THETA[1], 1),
        ];
        let structure = structure();
        bencher.iter(|| {
            let level = [Dual::constant(16.0)];
            let mut tank = Simulator::new(&structure, &theta, &level, 5.0).unwrap();
            let mut sum = 0.0;
            for row in &rows[LEARNED..] {
                sum += tank.read(0).re;
                tank.advance(Command::held(row.inputs[0]), 2.0);
            }
            black_box(sum)
        });
    });
    group.bench_function("monitor", |bencher| {
        bencher.iter_batched(
            || learned(&rows),
            |mut monitor| {
                for row in &rows[LEARNED..] {
                    black_box(monitor.update(row).unwrap());
                }
            },
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
