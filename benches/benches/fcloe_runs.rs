//! Closed-loop output error at work: the hundred runs of the paper's first table, and updates of the recursion.
//!
//! A run of the table is: simulate the loop with its noise, least squares, instruments, and the batch fit from there to
//! a tolerance of 1e-8. After criterion's figures come the shortest of some runs, in turns.
#![allow(missing_docs, clippy::expect_used)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group};
use ct_lti::Hold;
use ct_rls::RecursiveEstimator;
use ct_signals::excitation;
use fcloe::start::first_order::{self, Discretisation, Form};
use fcloe::{
    Controller, Filter, LoopRecord, LoopSample, Noise, Offsets, PlantModel, Problem,
    RecursiveFcloe, RecursiveSettings, Settings, continuous_loop, noise_at_snr,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;

const RUNS: u64 = 100;
const SAMPLES: usize = 10_000;

/// The loop of the first table: the reference, y without noise, and what made them.
struct FirstTable {
    plant: PlantModel,
    controller: Controller,
    r: Vec<f64>,
    clean: Vec<f64>,
}

impl FirstTable {
    fn new() -> Self {
        let plant = PlantModel::first_order(6.0, 110.0).expect("a plant");
        let controller = Controller::pi(0.2292, 0.0021).expect("a controller");
        let levels = [1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0].map(|sign| 0.82 * sign);
        let r = excitation::levels(2800, 400, &levels).expect("a reference");
        let clean = continuous_loop(&plant, &controller, 1.0, &r, Hold::Zero, Noise::None);
        let clean = clean.expect("a simulation").y;
        Self {
            plant,
            controller,
            r,
            clean,
        }
    }

    /// `[tau, K]` of one run.
    fn run(&self, seed: u64) -> [f64; 2] {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let w = noise_at_snr(&self.clean, 20.0, rng).expect("noise");
        let noise = Noise::InLoop(&w);
        let data = continuous_loop(
            &self.plant,
            &self.controller,
            1.0,
            &self.r,
            Hold::Zero,
            noise,
        )
        .expect("a simulation");
        let record = LoopRecord::closed_loop(
            1.0,
            self.r.clone(),
            Some(data.u),
            data.y,
            Offsets::Deviations,
        );
        let (lambda, rule) = (40.0 / 110.0, Discretisation::Euler);
        let start = first_order::least_squares(&record, lambda, rule).expect("estimates");
        let start = first_order::instruments(&record, lambda, rule, &start, Form::Standard)
            .expect("estimates");
        let problem = Problem::new(&[record], &self.controller, start.orders());
        let fit = problem
            .expect("a problem")
            .fit(&start, &Settings::default())
            .expect("a fit");
        assert!(fit.stop.was_successful());
        [fit.plant.theta()[0], fit.plant.theta()[1]]
    }

    /// Means over all runs.
    fn all(&self) -> [f64; 2] {
        let runs = (0..RUNS).into_par_iter().map(|seed| self.run(seed));
        let sum = runs.reduce(|| [0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        sum.map(|sum| sum / RUNS as f64)
    }
}

/// A recursion with its data.
struct Online {
    name: &'static str,
    start: RecursiveFcloe,
    samples: Vec<LoopSample>,
}

impl Online {
    fn new(
        name: &'static str,
        plant: &PlantModel,
        controller: &Controller,
        filter: Filter,
    ) -> Self {
        let r = excitation::prbs(SAMPLES, 20, -1.0, 1.0, 9).expect("a sequence");
        let simulate = |noise| {
            continuous_loop(plant, controller, 1.0, &r, Hold::Zero, noise).expect("a simulation")
        };
        let clean = simulate(Noise::None).y;
        let w = noise_at_snr(&clean, 20.0, &mut ChaCha8Rng::seed_from_u64(1)).expect("noise");
        let y = simulate(Noise::InLoop(&w)).y;
        let sample = |(&drive, &y): (&f64, &f64)| LoopSample { drive, y };
        let samples = r.iter().zip(&y).map(sample).collect();
        let settings = RecursiveSettings::new(1.0, 0.005, 1000.0, 0.02).with_filter(filter);
        let theta: Vec<f64> = plant.theta().iter().map(|t| 1.05 * t).collect();
        let start = PlantModel::from_theta(plant.orders(), &theta).expect("a start");
        let start = RecursiveFcloe::new(&start, controller, settings).expect("an estimator");
        Self {
            name,
            start,
            samples,
        }
    }

    fn run(&self) -> f64 {
        let mut estimator = self.start.clone();
        for sample in &self.samples {
            black_box(estimator.update(black_box(sample), 1.0));
        }
        estimator.theta()[0]
    }
}

fn online() -> Vec<Online> {
    let plant = |a: &[f64], b: &[f64]| PlantModel::new(a, b).expect("a plant");
    let first = plant(&[110.0], &[6.0]);
    let second = plant(&[210.0, 9000.0], &[5.0, 40.0]);
    let third = plant(&[230.0, 13_000.0, 180_000.0], &[5.0, 40.0]);
    let pi = Controller::pi(0.3, 0.004).expect("a controller");
    let pid = Controller::pid(0.3, 0.004, 4.0, 10.0).expect("a controller");
    let (adaptive, fixed) = (Filter::Adaptive, Filter::Fixed);
    vec![
        Online::new("n = 1, m = 0, PI", &first, &pi, adaptive),
        Online::new("n = 1, m = 0, PI, filter of the start", &first, &pi, fixed),
        Online::new(
            "n = 2, m = 1, open loop",
            &second,
            &Controller::none(),
            adaptive,
        ),
        Online::new("n = 2, m = 1, PI", &second, &pi, adaptive),
        Online::new("n = 2, m = 1, filtered PID", &second, &pid, adaptive),
        Online::new("n = 3, m = 1, PI", &third, &pi, adaptive),
    ]
}

fn runs(criterion: &mut Criterion) {
    let table = FirstTable::new();
    let mut group = criterion.benchmark_group("fcloe");
    group.sample_size(10);
    group.bench_function("100 runs of the first table", |b| b.iter(|| table.all()));
    group.throughput(Throughput::Elements(SAMPLES as u64));
    for online in online() {
        group.bench_function(format!("recursion, {}", online.name), |b| {
            b.iter(|| online.run())
        });
    }
    group.finish();
}

fn shortest(rounds: usize, mut run: impl FnMut()) -> Duration {
    let time = |_| {
        let start = Instant::now();
        run();
        start.elapsed()
    };
    (0..rounds).map(time).min().unwrap_or_default()
}

fn tables() {
    let table = FirstTable::new();
    println!("\n100 runs of the first table, shortest of 20:");
    println!("| threads | ms |");
    println!("|---|---|");
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("threads");
        let time = shortest(20, || {
            black_box(pool.install(|| table.all()));
        });
        println!("| {threads} | {:.1} |", 1e3 * time.as_secs_f64());
    }
    let [tau, gain] = table.all();
    println!("mean estimates: K {gain:.4}, tau {tau:.3}");
    println!("\nrecursion, shortest of 40 runs of {SAMPLES} updates:");
    println!("| | ns per update | updates/s |");
    println!("|---|---|---|");
    for online in online() {
        let time = shortest(40, || {
            black_box(online.run());
        });
        let each = time.as_secs_f64() / SAMPLES as f64;
        println!(
            "| {} | {:.0} | {:.1e} |",
            online.name,
            1e9 * each,
            1.0 / each
        );
    }
}

criterion_group!(benches, runs);

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    tables();
}
