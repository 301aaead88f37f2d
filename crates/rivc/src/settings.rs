//! Settings of an estimation.

use serde::{Deserialize, Serialize};

/// Largest order of the noise model for the standard errors of SRIVC.
const NOISE_ORDER: usize = 8;

/// Assumed noise model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Noise {
    /// White: SRIVC. Other noise costs efficiency; the standard errors allow for it.
    White,
    /// Autoregressive, of an order that is chosen: RIVC.
    Autoregressive,
}

/// Settings of an estimation.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Assumed noise model.
    pub noise: Noise,
    /// Largest order of autoregressive noise.
    pub noise_order: usize,
    /// Bandwidths of the first filters \[1/time\]; empty for a grid over all that the records show.
    pub bandwidths: Vec<f64>,
    /// Most iterations.
    pub max_iterations: usize,
}

impl Settings {
    /// Up to 60 iterations, noise of up to order 8, a grid of bandwidths.
    pub fn new(noise: Noise) -> Self {
        Self {
            noise,
            noise_order: NOISE_ORDER,
            bandwidths: Vec::new(),
            max_iterations: 60,
        }
    }
}
