//! Time per update of the stabilized output error at order 1, 2 and 4: Euler's rule and the exact step, block-diagonal and full gain.
//!
//! After criterion's figures come ratios: the shortest of many short runs, taken in turns, so that a busy machine disturbs
//! both sides alike.
#![allow(missing_docs, clippy::expect_used)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group};
use ct_rls::{ContinuousRls, Euler, ExactHold, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use stabilized_oe::{
    BlockDiagonal, Derivatives, Full, Gain, Integrator, IoSample, Known, KnownSample,
    LateDifference, StabilizedOe, StateVariableFilters,
};

const SAMPLES: usize = 1000;
const DT: f64 = 0.05;

/// Coefficients of `(1 + s)^n` without the leading 1.
fn binomials<const N: usize>() -> [f64; N] {
    let mut binomial = 1.0;
    core::array::from_fn(|i| {
        binomial *= (N - i) as f64 / (i + 1) as f64;
        binomial
    })
}

fn start<const N: usize, const T: usize>() -> SVector<f64, T> {
    let a = binomials::<N>();
    // theta = (a, b_0), then c where there is room
    SVector::from_fn(|i, _| match i {
        i if i < N => 1.2 * a[i],
        i if i == N => 0.8,
        i => a[i - N - 1],
    })
}

fn block<const T: usize, I: Integrator>(start: SVector<f64, T>) -> ContinuousRls<T, I> {
    let weights = Weights::least_squares(0.01).expect("a rate above 0");
    // small enough for Euler's rule
    let p = SMatrix::identity() * 0.1;
    ContinuousRls::with_integrator(start, p, weights).expect("a positive start")
}

fn blocks<const N: usize, const P: usize, I: Integrator>() -> BlockDiagonal<N, P, I> {
    BlockDiagonal::new(block(start::<N, P>()), block(binomials::<N>().into()))
}

fn input(k: usize) -> f64 {
    let t = k as f64 * DT;
    t.sin() + (0.31 * t).sin() + (2.3 * t).cos()
}

/// A signal that moves as an output would, with derivatives, for the gains to work on.
fn known<const N: usize>() -> Vec<KnownSample<N, 1>> {
    (0..SAMPLES)
        .map(|k| KnownSample {
            u: [input(k)],
            y: 0.5 * input(k) + 0.01 * (k as f64).sin(),
            derivatives: core::array::from_fn(|i| 0.3 * (0.7 * k as f64 * DT + i as f64).cos()),
        })
        .collect()
}

fn measured() -> Vec<IoSample> {
    let sample = |k| IoSample {
        u: input(k),
        y: 0.5 * input(k) + 0.01 * (k as f64).sin(),
    };
    (0..SAMPLES).map(sample).collect()
}

fn run<const N: usize, const P: usize, G: Gain<N, P>, D: Derivatives<N>>(
    gain: G,
    derivatives: D,
    samples: &[D::Sample],
) -> f64 {
    let mut estimator = StabilizedOe::new(gain, derivatives).expect("a stable start");
    let mut used = true;
    for sample in samples {
        used &= estimator.update(sample, DT).outcome.used();
    }
    // a run that had stopped would be fast
    assert!(used, "a sample was not used");
    estimator.theta()[0]
}

fn order<const N: usize, const P: usize, const T: usize>(criterion: &mut Criterion) {
    let samples = known::<N>();
    let scheme = Known::<N, 1>::new(false);
    let mut group = criterion.benchmark_group(format!("stabilized-oe/n={N}"));
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.bench_function("Euler", |b| {
        b.iter(|| run(blocks::<N, P, Euler>(), scheme, &samples))
    });
    group.bench_function("exact", |b| {
        b.iter(|| run(blocks::<N, P, ExactHold>(), scheme, &samples))
    });
    group.bench_function("exact, full gain", |b| {
        let gain = || Full::<N, P, T>::new(block(start::<N, T>()));
        b.iter(|| run(gain(), scheme, &samples))
    });
    let measured = measured();
    group.bench_function("exact, state variable filters", |b| {
        let filters = || StateVariableFilters::<N>::new(4.0).expect("a bandwidth above 0");
        b.iter(|| run(blocks::<N, P, ExactHold>(), filters(), &measured))
    });
    group.finish();
}

fn all(criterion: &mut Criterion) {
    order::<1, 2, 3>(criterion);
    order::<2, 3, 5>(criterion);
    order::<4, 5, 9>(criterion);
    let samples = measured();
    let mut group = criterion.benchmark_group("stabilized-oe/n=1, the paper's differences");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.bench_function("Euler", |b| {
        b.iter(|| {
            run(
                blocks::<1, 2, Euler>(),
                LateDifference::<5>::new(),
                &samples,
            )
        })
    });
    group.finish();
}

fn ratios<const N: usize, const P: usize>() {
    let samples = known::<N>();
    let scheme = Known::<N, 1>::new(false);
    let mut best = [Duration::MAX; 2];
    for _ in 0..500 {
        let start = Instant::now();
        black_box(run(blocks::<N, P, Euler>(), scheme, &samples));
        best[0] = start.elapsed().min(best[0]);
        let start = Instant::now();
        black_box(run(blocks::<N, P, ExactHold>(), scheme, &samples));
        best[1] = start.elapsed().min(best[1]);
    }
    let [euler, exact] = best.map(|best| best.as_nanos() as f64 / SAMPLES as f64);
    println!(
        "| {N} | {euler:.0} | {exact:.0} | {:.1} | {:.1} | {:.2} |",
        1e3 / euler,
        1e3 / exact,
        exact / euler
    );
}

criterion_group!(benches, all);

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    println!("shortest run:");
    println!("| n | Euler, ns | exact, ns | Euler, million/s | exact, million/s | exact/Euler |");
    println!("|---|---|---|---|---|---|");
    ratios::<1, 2>();
    ratios::<2, 3>();
    ratios::<4, 5>();
}
