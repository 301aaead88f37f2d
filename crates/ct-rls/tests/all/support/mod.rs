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

pub mod drifting_tank;
pub mod textbook;
