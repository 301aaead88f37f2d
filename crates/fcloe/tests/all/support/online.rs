//! Experiments with the recursive estimator whose truth is known. One sample a second, noise in the loop.
#![allow(dead_code)]

use std::ops::Range;

use ct_lti::{Hold, Polynomial};
use ct_rls::RecursiveEstimator;
use ct_signals::excitation;
use fcloe::start::{self, PipelineSettings};
use fcloe::{
    Controller, Filter, LoopData, LoopRecord, LoopSample, Noise, Offsets, PlantModel,
    RecursiveFcloe, RecursiveSettings, continuous_loop, noise_at_snr,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The plant and the controller of the paper's first table.
pub fn first_order() -> (PlantModel, Controller) {
    let plant = PlantModel::first_order(6.0, 110.0).unwrap();
    (plant, Controller::pi(0.2292, 0.0021).unwrap())
}

/// n = 2, m = 1.
pub fn second_order() -> (PlantModel, Controller) {
    let plant = PlantModel::new(&[210.0, 9000.0], &[5.0, 40.0]).unwrap();
    (plant, Controller::pi(0.3, 0.004).unwrap())
}

pub fn data(
    plant: &PlantModel,
    controller: &Controller,
    r: &[f64],
    snr: f64,
    seed: u64,
) -> LoopData {
    let simulate = |noise| continuous_loop(plant, controller, 1.0, r, Hold::Zero, noise).unwrap();
    let clean = simulate(Noise::None).y;
    let w = noise_at_snr(&clean, snr, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
    simulate(Noise::InLoop(&w))
}

pub fn first_order_settings() -> RecursiveSettings {
    RecursiveSettings::new(10.0, -0.98_f64.ln(), 300.0, 0.05)
}

pub fn second_order_settings() -> RecursiveSettings {
    RecursiveSettings::new(1.0, -0.995_f64.ln(), 1000.0, 0.02)
}

pub fn run(estimator: &mut RecursiveFcloe, r: &[f64], y: &[f64]) {
    for (&drive, &y) in r.iter().zip(y) {
        let innovation = estimator.update(&LoopSample { drive, y }, 1.0);
        assert!(innovation.outcome.used());
    }
}

/// The largest relative error of a parameter.
pub fn worst(theta: &[f64], truth: &PlantModel) -> f64 {
    let pairs = theta.iter().zip(truth.theta());
    pairs.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

fn within_a_factor(plant: &PlantModel, factor: f64, seed: u64) -> PlantModel {
    let rng = &mut ChaCha8Rng::seed_from_u64(1000 + seed);
    let mut off = |t: &f64| t * factor.powf(rng.random_range(-1.0..1.0));
    let theta: Vec<f64> = plant.theta().iter().map(&mut off).collect();
    PlantModel::from_theta(plant.orders(), &theta).unwrap()
}

/// Starts within a factor of the truth, n = 1, 2540 samples at 20 dB, one for each seed: how many end within 3 %.
pub fn first_order_from_afar(factor: f64, filter: Filter, seeds: Range<u64>) -> usize {
    let (plant, controller) = first_order();
    let r = excitation::prbs(2540, 10, -1.0, 1.0, 7).unwrap();
    let good = seeds.filter(|&seed| {
        let start = within_a_factor(&plant, factor, seed);
        let y = data(&plant, &controller, &r, 20.0, seed).y;
        let settings = first_order_settings().with_filter(filter);
        let mut estimator = RecursiveFcloe::new(&start, &controller, settings).unwrap();
        run(&mut estimator, &r, &y);
        worst(estimator.theta(), &plant) < 0.03
    });
    good.count()
}

/// Start of the recursion of second order.
#[derive(Debug, Clone, Copy)]
pub enum From {
    /// Least squares with a filter of 0.04 rad/s on the beginning of the record.
    LeastSquares,
    /// Instruments from r with the same filter on the same beginning.
    Instruments,
    /// The first candidate of the pipeline on that beginning.
    Pipeline,
    /// Each parameter is off by up to this factor.
    Factor(f64),
}

/// Records of n = 2, m = 1: 10 160 samples.
#[derive(Debug, Clone, Copy)]
pub struct SecondOrder {
    /// \[dB\]
    pub snr: f64,
    /// Number of samples for the regressions.
    pub beginning: usize,
}

/// Final estimates of the runs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ends {
    /// Ends, and starts, within 10 % in all four parameters.
    pub good: usize,
    pub good_starts: usize,
    /// Mean of the largest relative error, at the end and at the start.
    pub off: f64,
    pub starts_off: f64,
}

impl SecondOrder {
    /// One run for each seed. If a regression gives no stable loop, start and end count as off by 100 %.
    pub fn runs(self, from: From, filter: Filter, seeds: Range<u64>) -> Ends {
        let (plant, controller) = second_order();
        let r = excitation::prbs(10_160, 20, -1.0, 1.0, 7).unwrap();
        let runs = (seeds.end - seeds.start) as f64;
        let mut ends = Ends::default();
        for seed in seeds {
            let data = data(&plant, &controller, &r, self.snr, seed);
            let start = self.start(from, &r, &data, seed);
            let settings = second_order_settings().with_filter(filter);
            let estimator =
                start.and_then(|start| RecursiveFcloe::new(&start, &controller, settings).ok());
            let (begin, end) = estimator.map_or((1.0, 1.0), |mut estimator| {
                let begin = worst(estimator.theta(), &plant);
                run(&mut estimator, &r, &data.y);
                (begin, worst(estimator.theta(), &plant))
            });
            ends.good += usize::from(end < 0.1);
            ends.good_starts += usize::from(begin < 0.1);
            ends.off += end / runs;
            ends.starts_off += begin / runs;
        }
        ends
    }

    fn start(self, from: From, r: &[f64], data: &LoopData, seed: u64) -> Option<PlantModel> {
        let (plant, controller) = second_order();
        let (orders, n) = (plant.orders(), self.beginning);
        let (u, y) = (data.u[..n].to_vec(), data.y[..n].to_vec());
        let offsets = Offsets::Deviations;
        let records = [LoopRecord::closed_loop(
            1.0,
            r[..n].to_vec(),
            Some(u),
            y,
            offsets,
        )];
        let svf = Polynomial::new([0.04, 1.0]).unwrap().pow(2);
        let least_squares = || start::least_squares(&records, &controller, orders, &svf).ok();
        match from {
            From::LeastSquares => least_squares(),
            From::Instruments => {
                start::instruments(&records, &controller, &svf, &least_squares()?).ok()
            }
            From::Pipeline => {
                let settings = PipelineSettings::default();
                let found = start::pipeline(&records, &controller, orders, &settings).ok()?;
                Some(found.into_iter().next()?.plant)
            }
            From::Factor(factor) => Some(within_a_factor(&plant, factor, seed)),
        }
    }
}

/// tau grows evenly by 30 % over the samples, at 20 dB: the largest relative error of its estimate at any sample
/// once three memories have passed.
pub fn drift(samples: usize, memory: f64, seed: u64) -> f64 {
    let (plant, controller) = first_order();
    let r = excitation::prbs(samples, 10, -1.0, 1.0, 7).unwrap();
    let tau = |k: usize| 110.0 * (1.0 + 0.3 * k as f64 / samples as f64);
    let simulate = |noise| drifting_first_order(6.0, tau, (0.2292, 0.0021), &r, noise);
    let w = noise_at_snr(&simulate(None), 20.0, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
    let y = simulate(Some(&w));
    let settings = RecursiveSettings::new(1.0, 1.0 / memory, f64::INFINITY, 0.05);
    let mut estimator = RecursiveFcloe::new(&plant, &controller, settings).unwrap();
    let mut most = 0.0_f64;
    for (k, (&drive, &y)) in r.iter().zip(&y).enumerate() {
        estimator.update(&LoopSample { drive, y }, 1.0);
        if k as f64 > 3.0 * memory {
            most = most.max((estimator.theta()[0] / tau(k) - 1.0).abs());
        }
    }
    most
}

/// y of `tau(t) y' + y = K u` under PI, r and the noise in the loop held over steps of 1, by Runge-Kutta with 10 steps
/// each.
fn drifting_first_order(
    gain: f64,
    tau: impl Fn(usize) -> f64,
    (kp, ki): (f64, f64),
    r: &[f64],
    noise: Option<&[f64]>,
) -> Vec<f64> {
    const STEPS: usize = 10;
    let h = 1.0 / STEPS as f64;
    let (mut y, mut integral) = (0.0, 0.0);
    let mut ys = Vec::with_capacity(r.len());
    for (k, r) in r.iter().enumerate() {
        let w = noise.map_or(0.0, |w| w[k]);
        ys.push(y + w);
        let tau = tau(k);
        let slope = |y: f64, integral: f64| {
            let e = r - y - w;
            let u = kp * e + ki * integral;
            ((gain * u - y) / tau, e)
        };
        for _ in 0..STEPS {
            let a = slope(y, integral);
            let b = slope(y + 0.5 * h * a.0, integral + 0.5 * h * a.1);
            let c = slope(y + 0.5 * h * b.0, integral + 0.5 * h * b.1);
            let d = slope(y + h * c.0, integral + h * c.1);
            y += h / 6.0 * (a.0 + 2.0 * b.0 + 2.0 * c.0 + d.0);
            integral += h / 6.0 * (a.1 + 2.0 * b.1 + 2.0 * c.1 + d.1);
        }
    }
    ys
}
