//! Expected residual of a noise model, and significant excess over it.
//!
//! A bin fails where its mean square is clearly above what the noise would show there. A coloured noise has fewer
//! independent samples than samples, and more at some frequencies than at others; with its autocovariance `r(h)` and
//! autocorrelation `rho(h)` over a record of `n` samples
//! ```text
//! samples for one that is independent   1 + 2 sum_h (1 - h/n) rho(h)^2              (the variance of a mean square)
//! E |X_k|^2/n                           r(0) + 2 sum_h (1 - h/n) r(h) cos(2 pi h k/n)   (a line of the periodogram)
//! ```
//! both exact for Gaussian noise, the second including leakage from other frequencies. Sums of squares are then treated as
//! chi-square variables with the number of degrees of freedom that gives their variance.
//!
//! **Reference**: M. B. Priestley, Spectral Analysis and Time Series (1981), 5.3.3 and 6.2.2.

use std::f64::consts::TAU;

use ct_signals::ArModel;
use realfft::{RealFftPlanner, num_complex::Complex};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A bin fails where its mean square exceeds that of the noise by this factor ...
const FACTOR: f64 = 3.0;
/// ... a band by this one, because the spectrum of the noise is less well known than its variance ...
pub(super) const FACTOR_OF_A_BAND: f64 = 6.0;
/// ... and if chance would cause it less often than this: one in ten thousand over about fifty bins.
const CHANCE: f64 = 2e-6;

/// Expected statistics of a noise in a record of `n` samples.
pub(super) struct Expected {
    /// Mean square.
    square: f64,
    /// Samples per independent sample.
    spacing: f64,
    /// `E |X_k|^2/n` from zero to half the sampling rate.
    pub lines: Vec<f64>,
}

impl Expected {
    pub fn of(noise: &ArModel, n: usize) -> Self {
        let square = noise.stationary_std().powi(2);
        if noise.order() == 0 {
            return Self {
                square,
                spacing: 1.0,
                lines: vec![square; n / 2 + 1],
            };
        }
        let r = autocovariance(noise, n);
        let spacing = 1.0
            + 2.0
                * (1..n)
                    .map(|h| (1.0 - h as f64 / n as f64) * (r[h] / square).powi(2))
                    .sum::<f64>();
        let folded: Vec<f64> = (0..n)
            .map(|h| {
                let part = h as f64 / n as f64;
                (1.0 - part) * r[h] + if h > 0 { part * r[n - h] } else { 0.0 }
            })
            .collect();
        Self {
            square,
            spacing,
            lines: transform(&folded)
                .iter()
                .map(|line| line.re.max(0.0))
                .collect(),
        }
    }

    /// Whether this mean square is significantly larger than that of the same number of noise samples.
    pub fn exceeded(&self, mean_square: f64, samples: usize) -> bool {
        let ratio = mean_square / self.square.max(f64::MIN_POSITIVE);
        ratio > FACTOR && beyond_chance(ratio, samples as f64 / self.spacing)
    }
}

/// `r(0)` to `r(n - 1)`, from the spectrum on a grid four times as fine as the record's.
fn autocovariance(noise: &ArModel, n: usize) -> Vec<f64> {
    let grid = 4 * n;
    let mut spectrum: Vec<Complex<f64>> = (0..=grid / 2)
        .map(|j| {
            let w = TAU * j as f64 / grid as f64;
            let filter = noise
                .coefficients()
                .iter()
                .enumerate()
                .fold(Complex::new(1.0, 0.0), |sum, (i, a)| {
                    sum - Complex::from_polar(*a, -w * (i + 1) as f64)
                });
            Complex::new(noise.sigma().powi(2) / filter.norm_sqr() / grid as f64, 0.0)
        })
        .collect();
    let plan = RealFftPlanner::<f64>::new().plan_fft_inverse(grid);
    let mut r = plan.make_output_vec();
    // The lengths are those of the plan, and a real spectrum belongs to a real signal.
    if plan.process(&mut spectrum, &mut r).is_err() {
        r.fill(0.0);
    }
    r.truncate(n);
    r
}

/// Whether the ratio of a mean square to its expectation is significant.
pub(super) fn beyond_chance(ratio: f64, independent: f64) -> bool {
    let freedom = independent.max(1.0);
    ChiSquared::new(freedom).is_ok_and(|chi| chi.sf(freedom * ratio) < CHANCE)
}

/// The Fourier transform from zero to half the sampling rate.
pub(super) fn transform(x: &[f64]) -> Vec<Complex<f64>> {
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(x.len());
    let mut output = plan.make_output_vec();
    // The lengths are those of the plan.
    if plan.process(&mut x.to_vec(), &mut output).is_err() {
        output.clear();
    }
    output
}
