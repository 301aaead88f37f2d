//! Shared parts of the tests: random numbers, random covariances, and the textbook's update for comparison.
#![allow(dead_code, missing_docs)]

use nalgebra::{SMatrix, SVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

pub fn normals<const P: usize>(rng: &mut ChaCha8Rng) -> SVector<f64, P> {
    SVector::from_fn(|_, _| normal(rng))
}

/// A symmetric positive definite matrix with eigenvalues around 1.
pub fn spd<const P: usize>(rng: &mut ChaCha8Rng) -> SMatrix<f64, P, P> {
    let a = SMatrix::<f64, P, P>::from_fn(|_, _| 0.5 * normal(rng));
    a * a.transpose() + SMatrix::identity() * 0.5
}

/// Estimate and covariance.
pub type State = (SVector<f64, 3>, SMatrix<f64, 3, 3>);

/// An equation of the estimate and its covariance over a time, by the Runge-Kutta rule in 4000 steps.
pub fn runge_kutta(rate: impl Fn(State) -> State, (mut theta, mut p): State, t: f64) -> State {
    let h = t / 4000.0;
    for _ in 0..4000 {
        let a = rate((theta, p));
        let b = rate((theta + a.0 * (0.5 * h), p + a.1 * (0.5 * h)));
        let c = rate((theta + b.0 * (0.5 * h), p + b.1 * (0.5 * h)));
        let d = rate((theta + c.0 * h, p + c.1 * h));
        theta += (a.0 + (b.0 + c.0) * 2.0 + d.0) * (h / 6.0);
        p += (a.1 + (b.1 + c.1) * 2.0 + d.1) * (h / 6.0);
    }
    (theta, p)
}

pub mod drifting_tank;
pub mod textbook;
