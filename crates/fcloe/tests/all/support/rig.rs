//! Simulated experiments whose truth is known.

use ct_lti::Hold;
use ct_signals::excitation;
use fcloe::{
    Controller, LoopRecord, Noise, Offsets, PlantModel, Problem, Settings, Uncertainty,
    continuous_loop, noise_at_snr,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// A plant, its controller and a reference.
#[derive(Debug, Clone)]
pub struct Rig {
    pub name: &'static str,
    pub plant: PlantModel,
    pub controller: Controller,
    pub step: f64,
    pub r: Vec<f64>,
    /// In decibels.
    pub snr: f64,
    pub in_loop: bool,
    /// Raw levels instead of deviations, to be estimated.
    pub unknown_levels: bool,
    /// Standard deviation of white noise, or the correlation of neighbours.
    pub rho: f64,
    /// 30 % of the readings are missing at random, and a block of 10 rows.
    pub missing: bool,
}

impl Rig {
    /// The first table's plant and controller, with assumptions that reproduce it.
    pub fn first_order(in_loop: bool) -> Self {
        let pattern = [0.82, 0.82, -0.82, -0.82, 0.82, -0.82, 0.82];
        Self {
            name: "n = 1, m = 0, PI, slow steps",
            plant: PlantModel::first_order(6.0, 110.0).unwrap(),
            controller: Controller::pi(0.2292, 0.0021).unwrap(),
            step: 1.0,
            r: excitation::levels(2800, 400, &pattern).unwrap(),
            snr: 20.0,
            in_loop,
            unknown_levels: false,
            rho: 0.0,
            missing: false,
        }
    }

    pub fn second_order(in_loop: bool) -> Self {
        Self {
            name: "n = 2, m = 1, PI, pseudo-random",
            plant: PlantModel::new(&[210.0, 9000.0], &[5.0, 40.0]).unwrap(),
            controller: Controller::pi(0.3, 0.004).unwrap(),
            step: 2.0,
            r: excitation::prbs(1270, 10, -1.0, 1.0, 7).unwrap(),
            snr: 20.0,
            in_loop,
            unknown_levels: false,
            rho: 0.0,
            missing: false,
        }
    }

    pub fn filtered_pid(in_loop: bool) -> Self {
        Self {
            name: "n = 2, m = 0, filtered PID and sensor filter, pseudo-random",
            plant: PlantModel::new(&[210.0, 9000.0], &[5.0]).unwrap(),
            controller: Controller::pid(0.3, 0.004, 4.0, 10.0)
                .unwrap()
                .with_sensor_filter(0.2)
                .unwrap(),
            ..Self::second_order(in_loop)
        }
    }

    /// A plant with direct feedthrough: the loop passes the noise directly.
    pub fn direct_term(in_loop: bool) -> Self {
        Self {
            name: "n = 1, m = 1, PI, pseudo-random",
            plant: PlantModel::new(&[3.0], &[2.0, 0.7]).unwrap(),
            controller: Controller::pi(0.5, 0.2).unwrap(),
            step: 0.3,
            ..Self::second_order(in_loop)
        }
    }

    pub fn with_unknown_levels(self) -> Self {
        Self {
            name: "the same, levels estimated",
            unknown_levels: true,
            ..self
        }
    }

    pub fn with_missing_readings(self) -> Self {
        Self {
            missing: true,
            ..self
        }
    }

    /// Without a controller, and with coloured noise.
    pub fn open_loop() -> Self {
        Self {
            name: "n = 2, m = 1, open loop, coloured noise",
            controller: Controller::none(),
            rho: 0.8,
            ..Self::second_order(false)
        }
    }

    pub fn record(&self, seed: u64) -> LoopRecord {
        let data = |noise| {
            continuous_loop(
                &self.plant,
                &self.controller,
                self.step,
                &self.r,
                Hold::Zero,
                noise,
            )
            .unwrap()
        };
        let clean = data(Noise::None);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut w = noise_at_snr(&clean.y, self.snr, &mut rng).unwrap();
        for k in 1..w.len() {
            w[k] = self.rho * w[k - 1] + (1.0 - self.rho * self.rho).sqrt() * w[k];
        }
        let mut data = data(if self.in_loop {
            Noise::InLoop(&w)
        } else {
            Noise::OnRecord(&w)
        });
        let mut r = self.r.clone();
        let mut offsets = Offsets::Deviations;
        if self.unknown_levels {
            for v in data.y.iter_mut().chain(&mut r) {
                *v += 20.0;
            }
            offsets = Offsets::Estimated;
        }
        if self.missing {
            let block = data.y.len() / 2..data.y.len() / 2 + 10;
            for (k, y) in data.y.iter_mut().enumerate() {
                if rng.random_bool(0.3) || block.contains(&k) {
                    *y = f64::NAN;
                }
            }
        }
        if self.controller.is_open_loop() {
            return LoopRecord::open_loop(self.step, r, data.y, offsets);
        }
        LoopRecord::closed_loop(self.step, r, Some(data.u), data.y, offsets)
    }

    /// Estimates and their uncertainty, from a start with an error of a fifth.
    pub fn fit(&self, seed: u64) -> (Vec<f64>, Uncertainty) {
        let orders = self.plant.orders();
        let problem = Problem::new(&[self.record(seed)], &self.controller, orders).unwrap();
        let factors = [1.2, 0.85].into_iter().cycle();
        let theta: Vec<f64> = self
            .plant
            .theta()
            .iter()
            .zip(factors)
            .map(|(t, f)| t * f)
            .collect();
        let start = PlantModel::from_theta(orders, &theta).unwrap();
        let fit = problem.fit(&start, &Settings::default()).unwrap();
        assert!(fit.stop.was_successful(), "{:?}", fit.stop);
        let uncertainty = problem.uncertainty(&fit, None).unwrap();
        (fit.plant.theta().to_vec(), uncertainty)
    }

    /// Fits of so many runs beside the truth.
    pub fn coverage(&self, runs: u64) -> Coverage {
        use fcloe::NoisePath;
        use rayon::prelude::*;

        let each: Vec<Run> = (0..runs)
            .into_par_iter()
            .map(|seed| self.fit(seed))
            .collect();
        let truth = self.plant.theta();
        let parameters = 0..truth.len();
        let hits = |half: &dyn Fn(&Uncertainty) -> Vec<f64>| -> Vec<usize> {
            let halves: Vec<Vec<f64>> = each.iter().map(|(_, known)| half(known)).collect();
            let hit = |i: usize, run: usize| (each[run].0[i] - truth[i]).abs() <= halves[run][i];
            let of = |i| (0..each.len()).filter(|run| hit(i, *run)).count();
            parameters.clone().map(of).collect()
        };
        let path = |known: &Uncertainty| (known.noise.path == NoisePath::Loop) == self.in_loop;
        Coverage {
            hits: hits(&|known| known.half_widths(0.95).unwrap()),
            white: hits(&|known| known.white_std_errors.iter().map(|s| 1.96 * s).collect()),
            placed: each.iter().filter(|(_, known)| path(known)).count(),
            variance_ratios: parameters
                .clone()
                .map(|i| variance_ratio(&each, i))
                .collect(),
        }
    }
}

/// Coverage of the intervals over many runs.
#[derive(Debug)]
pub struct Coverage {
    /// In how many runs the 95 % interval of each parameter contains the true value.
    pub hits: Vec<usize>,
    /// Coverage of intervals that assume a white residual.
    pub white: Vec<usize>,
    /// Number of runs with the correct path of the noise.
    pub placed: usize,
    /// Mean of the estimated variances of each parameter over the variance of its estimates.
    pub variance_ratios: Vec<f64>,
}

/// Estimates and their uncertainty.
type Run = (Vec<f64>, Uncertainty);

fn variance_ratio(each: &[Run], i: usize) -> f64 {
    let mean = |of: &dyn Fn(&Run) -> f64| each.iter().map(of).sum::<f64>() / each.len() as f64;
    let centre = mean(&|(theta, _)| theta[i]);
    let scatter = mean(&|(theta, _)| (theta[i] - centre).powi(2));
    mean(&|(_, known)| known.std_errors[i].powi(2)) / scatter
}
