//! A tank whose parameters drift while its second inlet stays closed. Time is in units of the tank's time constant.
//!
//! Model: `dh/dt = b u - a h + g d`: `u` the pump's command, `h` the level, `d` the second inlet; the regressor is `(u, -h, d)`.
//! `b` and `a` drift, `g` is constant; `d` moves during the first 2000 samples, is 0 for all the rest but the last 2000, and
//! moves again. `dh/dt` is measured with noise of 1e-3.

use ct_rls::{ContinuousRls, Error, Integrator, RecursiveEstimator, Sample};
use nalgebra::{SVector, vector};
use rand_chacha::ChaCha8Rng;

use super::{normal, rng};

pub const DT: f64 = 0.05;
/// Samples at each end in which the second inlet moves.
pub const OPEN: u64 = 2000;
/// Samples between two looks at P.
const LOOK: u64 = 10_007;

pub struct Tank {
    h: f64,
    noise: ChaCha8Rng,
    k: u64,
    samples: u64,
}

impl Tank {
    pub fn new(samples: u64) -> Self {
        Self {
            h: 0.0,
            noise: rng(5),
            k: 0,
            samples,
        }
    }

    /// The next sample, and the true parameters over it.
    pub fn next(&mut self) -> (Sample<3>, SVector<f64, 3>) {
        let t = self.k as f64 * DT;
        let theta = vector![
            1.0 + 0.3 * (std::f64::consts::TAU * t / 1000.0).sin(),
            1.0 + 0.2 * (std::f64::consts::TAU * t / 700.0 + 1.0).sin(),
            0.7
        ];
        let moves = |period: u64| {
            if (self.k / period).is_multiple_of(2) {
                1.0
            } else {
                -1.0
            }
        };
        let open = self.k < OPEN || self.k + OPEN >= self.samples;
        let d = if open { moves(13) } else { 0.0 };
        // two periods that do not fit each other
        let u = 0.6 * moves(17) + 0.4 * moves(71);
        let phi = vector![u, -self.h, d];
        let y = theta.dot(&phi);
        // the level over the step, exactly
        let settled = (theta[0] * u + theta[2] * d) / theta[1];
        self.h = settled + (self.h - settled) * (-theta[1] * DT).exp();
        self.k += 1;
        let y = y + 1e-3 * normal(&mut self.noise);
        (Sample { phi, y }, theta)
    }
}

/// Results of a run of one estimator after its first `OPEN` samples.
#[derive(Debug)]
pub struct Run {
    /// Largest relative error of `b` and of `a` in each tenth of the run; infinite where an estimate was no number.
    pub drifting: [f64; 10],
    /// Largest relative error of `g`, the constant parameter.
    pub constant: f64,
    /// Largest diagonal entry of P, and smallest pivot.
    pub largest: f64,
    pub smallest_pivot: f64,
    /// Number of steps in which a guard reduced forgetting.
    pub capped: u64,
}

pub fn run<I: Integrator>(mut rls: ContinuousRls<3, I>, samples: u64) -> Result<Run, Error> {
    let mut tank = Tank::new(samples);
    let mut run = Run {
        drifting: [0.0; 10],
        constant: 0.0,
        largest: 0.0,
        smallest_pivot: f64::INFINITY,
        capped: 0,
    };
    for k in 0..samples {
        let (sample, theta) = tank.next();
        rls.update(&sample, DT).accepted()?;
        if k >= OPEN {
            let off = (rls.theta() - theta).component_div(&theta).abs();
            let tenth = &mut run.drifting[(10 * k / samples) as usize];
            // max() would pass over a NaN
            let worst = if off.sum().is_nan() {
                f64::INFINITY
            } else {
                off[0].max(off[1])
            };
            *tenth = tenth.max(worst);
            run.constant = run.constant.max(off[2]);
        }
        if k >= OPEN && (k.is_multiple_of(LOOK) || k + 1 == samples) {
            let health = rls.health()?;
            run.largest = run.largest.max(rls.covariance().diagonal().max());
            run.smallest_pivot = run.smallest_pivot.min(health.smallest_pivot);
            run.capped = health.capped;
        }
    }
    Ok(run)
}
