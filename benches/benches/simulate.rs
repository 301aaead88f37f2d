//! Time per sample of a simulation, next to an adaptive solver restarted at every sample in the same run.
//!
//! The plant: two tanks in series, a held input that changes every ten samples, `h/tau` of 0.03, as in `plants`' tests.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use ode_solvers::dopri5::Dopri5;
use ode_solvers::{OutputType, System, Vector2};
use plants::{
    Command, Dual, EffectInfo, Known, Placed, Plant, Scalar, Scales, Simulator, SimulatorNumber,
    Structure,
};

const SAMPLES: usize = 1000;
const H: f64 = 1.5;
const THETA: [f64; 3] = [3.3, 5.0, 4.6];
const LEVELS: [f64; 2] = [9.5, 12.0];
const AREA: [f64; 2] = [28.0, 32.0];

fn command(k: usize) -> f64 {
    3.5 + ((k / 10) * 7 % 11) as f64 * 0.3
}

fn structure(plant: Plant, effects: &[&str]) -> Structure {
    let known = Known {
        area: [Some(AREA[0]), Some(AREA[1]), None],
        ..Known::default()
    };
    let scales = Scales::from_ranges((3.5, 6.5), (6.0, 17.0), H, SAMPLES as f64 * H);
    effects
        .iter()
        .filter_map(|id| EffectInfo::find(id))
        .fold(Structure::new(plant, known, scales), |s, effect| {
            s.with(Placed { effect, vessel: 0 }).unwrap_or(s)
        })
}

/// One run over the record: the sum of the readings, so that the compiler removes nothing.
fn run<T: SimulatorNumber>(structure: &Structure, theta: &[T], levels: &[T]) -> Option<T> {
    let mut simulator = Simulator::new(structure, theta, levels, command(0)).ok()?;
    let mut sum = T::constant(0.0);
    for k in 0..SAMPLES {
        sum = sum + simulator.read(0);
        simulator.advance(Command::held(command(k)), H);
    }
    Some(sum)
}

fn duals<const N: usize>(values: &[f64]) -> Vec<Dual<N>> {
    let variable = |(lane, &value): (usize, &f64)| Dual::variable(value, lane);
    values.iter().enumerate().map(variable).collect()
}

/// The same tanks for the adaptive solver.
struct Tanks {
    u: f64,
}

impl System<f64, Vector2<f64>> for Tanks {
    fn system(&self, _t: f64, x: &Vector2<f64>, dx: &mut Vector2<f64>) {
        let out = THETA[1] * x[0].max(0.0).sqrt();
        dx[0] = (THETA[0] * self.u - out) / AREA[0];
        dx[1] = (out - THETA[2] * x[1].max(0.0).sqrt()) / AREA[1];
    }
}

fn peer(tolerance: f64) -> (Vec<f64>, usize) {
    let mut x = Vector2::new(LEVELS[0], LEVELS[1]);
    let mut readings = Vec::with_capacity(SAMPLES);
    let mut calls = 0;
    for k in 0..SAMPLES {
        readings.push(x[1]);
        let tanks = Tanks { u: command(k) };
        let mut solver = Dopri5::new(tanks, 0.0, H, H, x, tolerance, tolerance);
        // The dense output's last point is wrong.
        solver.set_output(OutputType::Sparse);
        if let Ok(stats) = solver.integrate() {
            calls += stats.num_eval as usize;
        }
        if let Some(last) = solver.y_out().last() {
            x = *last;
        }
    }
    (readings, calls)
}

fn error(readings: &[f64], reference: &[f64]) -> f64 {
    let differences = readings.iter().zip(reference).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max)
}

/// Accuracy of each simulator: the largest error in the reading, compared with the adaptive solver at 1e-12.
fn accuracy() {
    let tanks = structure(Plant::CascadedTanks, &[]);
    let (reference, _) = peer(1e-12);
    if let Ok(mut simulator) = Simulator::new(&tanks, &THETA, &LEVELS, command(0)) {
        let readings: Vec<f64> = (0..SAMPLES)
            .map(|k| {
                let y = simulator.read(0);
                simulator.advance(Command::held(command(k)), H);
                y
            })
            .collect();
        println!(
            "largest error of a reading (about 12): {:.1e} by one Runge-Kutta step a sample",
            error(&readings, &reference)
        );
    }
    for tolerance in [1e-3, 1e-6] {
        let (adaptive, calls) = peer(tolerance);
        println!(
            "largest error of a reading (about 12): {:.1e} by Dopri5 at {tolerance:.0e}, {:.1} evaluations a sample",
            error(&adaptive, &reference),
            calls as f64 / SAMPLES as f64
        );
    }
}

fn simulate(criterion: &mut Criterion) {
    accuracy();
    let mut group = criterion.benchmark_group("simulate");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    let tanks = structure(Plant::CascadedTanks, &[]);
    let known: Vec<f64> = THETA.iter().chain(&LEVELS).copied().collect();
    let (d8, d12) = (duals::<8>(&known), duals::<12>(&known));
    group.bench_function("two tanks, f64", |b| {
        b.iter(|| run(black_box(&tanks), &THETA, &LEVELS))
    });
    group.bench_function("two tanks, 8 derivatives", |b| {
        b.iter(|| run(black_box(&tanks), &d8[..3], &d8[3..]))
    });
    group.bench_function("two tanks, 12 derivatives", |b| {
        b.iter(|| run(black_box(&tanks), &d12[..3], &d12[3..]))
    });

    // An overflow that is met, a lag, a dead zone.
    let effects = structure(
        Plant::CascadedTanks,
        &["pump_deadzone", "pump_lag", "overflow"],
    );
    let theta = [THETA[0], THETA[1], THETA[2], 0.2, 2.0, 11.0, 0.4];
    let known: Vec<f64> = theta.iter().chain(&LEVELS).copied().collect();
    let d12 = duals::<12>(&known);
    group.bench_function("two tanks and three effects, f64", |b| {
        b.iter(|| run(black_box(&effects), &theta, &LEVELS))
    });
    group.bench_function("two tanks and three effects, 12 derivatives", |b| {
        b.iter(|| run(black_box(&effects), &d12[..7], &d12[7..]));
    });

    let linear = structure(Plant::CascadedTanksLinear, &[]);
    let theta = [2.0, 60.0, 90.0, 1.5];
    let known: Vec<f64> = theta.iter().chain(&LEVELS).copied().collect();
    let d8 = duals::<8>(&known);
    group.bench_function("two linear tanks, exact, f64", |b| {
        b.iter(|| run(black_box(&linear), &theta, &LEVELS))
    });
    group.bench_function("two linear tanks, exact, 8 derivatives", |b| {
        b.iter(|| run(black_box(&linear), &d8[..4], &d8[4..]));
    });

    for tolerance in [1e-3, 1e-6] {
        let name = format!("two tanks, Dopri5 restarted each sample at {tolerance:.0e}");
        group.bench_function(name, |b| b.iter(|| peer(black_box(tolerance))));
    }
    group.finish();

    let mut group = criterion.benchmark_group("begin");
    group.bench_function(
        "Simulator::new, two tanks and three effects, 12 derivatives",
        |b| {
            b.iter_batched(
                || (),
                |()| Simulator::new(black_box(&effects), &d12[..7], &d12[7..], 4.0).is_ok(),
                BatchSize::SmallInput,
            );
        },
    );
    group.finish();
}

criterion_group!(benches, simulate);
criterion_main!(benches);
