//! Closed-loop output error: time per sample of the loop with its whole Jacobian, and a whole fit, and SRIVC and RIVC, beside dsmc's SRIVC.
//!
//! After criterion's figures come tables: the shortest of many short runs, in turns, so that a busy machine disturbs both
//! sides alike; and the estimates of both over 100 noise realisations.
#![allow(missing_docs, clippy::expect_used)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group};
use ct_lti::{Hold, Polynomial};
use ct_signals::excitation;
use dsmc::TransferFunction;
use dsmc::system_identification::iv::srivc::{Initialization, SrivcOptions, identify};
use fcloe::{
    BLOCK, Controller, LoopRecord, LoopSimulator, Noise, Offsets, Orders, PlantModel, Problem,
    Settings, continuous_loop, noise_at_snr,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const SAMPLES: usize = 10_000;
const STEP: f64 = 0.05;

/// `n` lags side by side in time constants, `m = n - 1`: 2n parameters.
fn plant(n: usize) -> PlantModel {
    let product = |range: std::ops::Range<usize>, spread: f64| {
        range.fold(Polynomial::one(), |product, i| {
            let lag = 1.0 + spread * i as f64;
            &product * &Polynomial::new([1.0, lag]).expect("finite")
        })
    };
    let a = product(0..n, 0.4);
    let b = &product(0..n - 1, 0.25) * 2.0;
    PlantModel::new(&a.coefficients()[1..], b.coefficients()).expect("a plant")
}

fn simulator(n: usize, controller: &Controller) -> LoopSimulator {
    LoopSimulator::new(&plant(n), controller, Hold::Zero, STEP).expect("a loop")
}

fn jacobian(simulator: &mut LoopSimulator, drive: &[f64]) -> f64 {
    simulator.reset();
    let mut last = 0.0;
    for drive in drive.chunks(BLOCK) {
        let block = black_box(simulator.sensitivities(black_box(drive)));
        last = block.y()[0];
    }
    last
}

fn drive() -> Vec<f64> {
    excitation::prbs(SAMPLES, 20, -1.0, 1.0, 9).expect("a sequence")
}

fn pi() -> Controller {
    Controller::pi(0.3, 0.2).expect("a controller")
}

fn simulations(criterion: &mut Criterion) {
    let drive = drive();
    let mut group = criterion.benchmark_group("fcloe/simulation and Jacobian");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    for n in 2..=6 {
        for (name, controller) in [("open loop", Controller::none()), ("PI", pi())] {
            let mut simulator = simulator(n, &controller);
            group.bench_function(format!("n={n}, {} parameters, {name}", 2 * n), |b| {
                b.iter(|| jacobian(&mut simulator, &drive));
            });
        }
    }
    group.finish();
}

/// A second-order system in open loop with two parameters in B, and white noise at 20 dB.
struct Case {
    plant: PlantModel,
    u: Vec<f64>,
    y: Vec<f64>,
}

/// Both estimators get this bandwidth, roughly that of the plant.
const BANDWIDTH: f64 = 1.0;

impl Case {
    fn new(seed: u64) -> Self {
        let plant = PlantModel::new(&[1.2, 1.5], &[2.0, 0.6]).expect("a plant");
        let u = drive();
        let none = Controller::none();
        let data = |noise| {
            continuous_loop(&plant, &none, STEP, &u, Hold::Zero, noise).expect("a simulation")
        };
        let clean = data(Noise::None).y;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let w = noise_at_snr(&clean, 20.0, &mut rng).expect("noise");
        let y = data(Noise::OnRecord(&w)).y;
        Self { plant, u, y }
    }

    /// Start from lags of the given bandwidth and the ratio of the standard deviations of y and u.
    fn ours(&self) -> Vec<f64> {
        let orders = Orders { n: 2, m: 1 };
        let record =
            LoopRecord::open_loop(STEP, self.u.clone(), self.y.clone(), Offsets::Deviations);
        let problem = Problem::new(&[record], &Controller::none(), orders).expect("a problem");
        let power = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        let gain = (power(&self.y) / power(&self.u)).sqrt();
        let lag = 1.0 / BANDWIDTH;
        let start = PlantModel::new(&[2.0 * lag, lag * lag], &[gain, 0.0]).expect("a start");
        let fit = problem.fit(&start, &Settings::default()).expect("a fit");
        assert!(fit.stop.was_successful());
        fit.plant.theta().to_vec()
    }

    /// In the same form as ours, `a0 = 1`.
    fn srivc(&self) -> Vec<f64> {
        let start = Initialization::StateVariableFilter(BANDWIDTH);
        let options = SrivcOptions::default();
        let found = identify(&self.u, &self.y, STEP, 2, 1, &start, &options).expect("estimates");
        assert!(found.converged);
        let p = &found.parameter;
        vec![p[0] / p[1], 1.0 / p[1], p[3] / p[1], p[2] / p[1]]
    }

    /// SRIVC or RIVC from filters of the bandwidth, of a record that begins at rest.
    fn instruments(&self, noise: rivc::Noise) -> Vec<f64> {
        let record = rivc::Data::even(STEP, self.u.clone(), self.y.clone());
        let settings = rivc::Settings {
            bandwidths: vec![BANDWIDTH],
            ..rivc::Settings::new(noise)
        };
        let structure = rivc::Structure::new(2, [1]).from_rest();
        let found = rivc::estimate(&[record], &structure, &settings).expect("estimates");
        assert!(found.converged);
        let (a, b) = (&found.plant.a, &found.plant.b[0]);
        vec![a[1], a[2], b[0], b[1]]
    }

    fn our_srivc(&self) -> Vec<f64> {
        self.instruments(rivc::Noise::White)
    }

    fn our_rivc(&self) -> Vec<f64> {
        self.instruments(rivc::Noise::Autoregressive)
    }

    /// A start for both programs: the true plant with parameters off by a quarter.
    fn near(&self) -> Vec<f64> {
        let factors = [1.25, 0.75, 1.25, 0.75];
        let theta = self.plant.theta().iter().zip(factors);
        theta.map(|(t, f)| t * f).collect()
    }

    fn ours_from_near(&self) -> Vec<f64> {
        let orders = Orders { n: 2, m: 1 };
        let record =
            LoopRecord::open_loop(STEP, self.u.clone(), self.y.clone(), Offsets::Deviations);
        let problem = Problem::new(&[record], &Controller::none(), orders).expect("a problem");
        let start = PlantModel::from_theta(orders, &self.near()).expect("a start");
        let fit = problem.fit(&start, &Settings::default()).expect("a fit");
        fit.plant.theta().to_vec()
    }

    fn srivc_from_near(&self) -> Vec<f64> {
        let start = self.near();
        let model = TransferFunction::continuous(&[start[3], start[2]], &[start[1], start[0], 1.0]);
        let start = Initialization::Model(model);
        let options = SrivcOptions::default();
        let found = identify(&self.u, &self.y, STEP, 2, 1, &start, &options).expect("estimates");
        found.parameter.as_slice().to_vec()
    }
}

fn fits(criterion: &mut Criterion) {
    let case = Case::new(1);
    let mut group = criterion.benchmark_group("fcloe/fit, n=2, m=1, 10 000 samples");
    group.bench_function("output error", |b| b.iter(|| case.ours()));
    group.bench_function("SRIVC", |b| b.iter(|| case.our_srivc()));
    group.bench_function("RIVC", |b| b.iter(|| case.our_rivc()));
    group.bench_function("dsmc SRIVC", |b| b.iter(|| case.srivc()));
    group.finish();
}

fn shortest<const N: usize>(mut runs: [&mut dyn FnMut() -> f64; N], rounds: usize) -> [f64; N] {
    let mut best = [Duration::MAX; N];
    for _ in 0..rounds {
        for (best, run) in best.iter_mut().zip(&mut runs) {
            let start = Instant::now();
            black_box(run());
            *best = start.elapsed().min(*best);
        }
    }
    best.map(|best| best.as_nanos() as f64)
}

fn tables() {
    let drive = drive();
    println!("\nns per sample, simulation and whole Jacobian, shortest run; 2n parameters:");
    println!("| n | open loop | with a PI |");
    println!("|---|---|---|");
    for n in 2..=6 {
        let (mut open, mut closed) = (simulator(n, &Controller::none()), simulator(n, &pi()));
        let runs = shortest(
            [&mut || jacobian(&mut open, &drive), &mut || {
                jacobian(&mut closed, &drive)
            }],
            300,
        );
        let [open, closed] = runs.map(|ns| ns / SAMPLES as f64);
        println!("| {n} | {open:.1} | {closed:.1} |");
    }

    let case = Case::new(1);
    let [ours, our_srivc, our_rivc, srivc, ours_near, srivc_near] = shortest(
        [
            &mut || case.ours()[0],
            &mut || case.our_srivc()[0],
            &mut || case.our_rivc()[0],
            &mut || case.srivc()[0],
            &mut || case.ours_from_near()[0],
            &mut || case.srivc_from_near()[0],
        ],
        60,
    );
    println!("\nms per fit, second order in open loop, 10 000 samples, shortest run:");
    println!("| method | start | ours | dsmc SRIVC | ratio (at most 0.5) |");
    println!("|---|---|---|---|---|");
    let row = |name, ours: f64, srivc: f64| {
        let (ours_ms, srivc_ms) = (1e-6 * ours, 1e-6 * srivc);
        println!(
            "| {name} | {ours_ms:.2} | {srivc_ms:.2} | {:.2} |",
            ours / srivc
        );
    };
    row("output error | the bandwidth", ours, srivc);
    row(
        "output error | a model off by a quarter",
        ours_near,
        srivc_near,
    );
    row("SRIVC | the bandwidth", our_srivc, srivc);
    row("RIVC | the bandwidth", our_rivc, srivc);

    println!(
        "\nerror in percent of the truth, 100 noise realisations at 20 dB: mean (root mean square)"
    );
    println!("| | a1 | a2 | b0 | b1 |");
    println!("|---|---|---|---|---|");
    let cases: Vec<Case> = (100..200).map(Case::new).collect();
    let errors = |name: &str, fit: &dyn Fn(&Case) -> Vec<f64>| {
        let all: Vec<Vec<f64>> = cases
            .iter()
            .map(|case| {
                let pairs = fit(case).into_iter().zip(case.plant.theta().to_vec());
                pairs
                    .map(|(found, truth)| 100.0 * (found / truth - 1.0))
                    .collect()
            })
            .collect();
        let n = all.len() as f64;
        let cells = (0..4).map(|j| {
            let mean = all.iter().map(|e| e[j]).sum::<f64>() / n;
            let rms = (all.iter().map(|e| e[j] * e[j]).sum::<f64>() / n).sqrt();
            format!("{mean:.3} ({rms:.3})")
        });
        println!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "));
    };
    errors("output error", &Case::ours);
    errors("SRIVC", &Case::our_srivc);
    errors("RIVC", &Case::our_rivc);
    errors("dsmc SRIVC", &Case::srivc);
}

criterion_group!(benches, simulations, fits);

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    tables();
}
