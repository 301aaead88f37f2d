//! Measurement noise and slow disturbances with a known law, from a seeded generator.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// White Gaussian noise: `n` values of mean 0 and standard deviation `sigma` (any unit, `>= 0`).
///
/// Nothing is drawn when `sigma` is not finite: the values are then NaN, so that a mistake cannot
/// pass for data.
pub fn white<R: Rng + ?Sized>(n: usize, sigma: f64, rng: &mut R) -> Vec<f64> {
    if !sigma.is_finite() {
        return vec![f64::NAN; n];
    }
    (0..n).map(|_| sigma * normal(rng)).collect()
}

/// First-order coloured Gaussian noise, stationary from the first sample on:
/// `v[k] = rho v[k-1] + e[k]`.
///
/// `sigma_total` is the standard deviation of `v` (any unit, `>= 0`), not of `e`, which has
/// `sigma_total sqrt(1 - rho^2)`; `rho` is the correlation of neighbours, `-1 < rho < 1`. With
/// `rho = exp(-dt/T)` it is a disturbance of time constant `T` sampled every `dt`.
///
/// Outside these ranges there is no such process, and the values are NaN.
pub fn ar1<R: Rng + ?Sized>(n: usize, sigma_total: f64, rho: f64, rng: &mut R) -> Vec<f64> {
    if !sigma_total.is_finite() || rho.is_nan() || rho.abs() >= 1.0 {
        return vec![f64::NAN; n];
    }
    let sigma = sigma_total * (1.0 - rho * rho).sqrt();
    let mut v = sigma_total * normal(rng);
    (0..n)
        .map(|k| {
            if k > 0 {
                v = rho * v + sigma * normal(rng);
            }
            v
        })
        .collect()
}

fn normal<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    rng.sample(StandardNormal)
}
