//! Whether first-order noise describes the correlation of a residual.
//!
//! First-order noise is an ARMA(1,1) process: noise with one correlation time, or the sum of such noise and white noise (a slow disturbance
//! of the output beside a sensor's noise). Whitened by the process of the largest likelihood, its spectrum is flat. The error of a wrong
//! model, and a disturbance in a band of frequencies, leave a peak or a dip in the whitened spectrum, even if an autoregressive model of high
//! order can describe it as noise. The powers of bands of frequencies are compared with their mean (likelihood ratio of exponential variables).
//!
//! **Reference**: C. W. J. Granger, M. J. Morris, J. Royal Statistical Society A 139 (1976) 246-257 (the sum of a first-order autoregression
//! and white noise is ARMA(1,1)).

use ct_signals::StationaryNoise;
use realfft::RealFftPlanner;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::bands::bands;

/// Values of `atanh` of the two coefficients from which the search begins: for the pole correlation times from 0.7 to 450 samples.
const STARTS: [f64; 9] = [-1.5, -0.7, -0.25, 0.25, 0.7, 1.2, 1.8, 2.5, 3.4];
/// Largest `atanh` of a coefficient.
const LARGEST: f64 = 4.0;
/// First and last step of the search in `atanh` of the coefficients.
const STEPS: (f64, f64) = (0.4, 0.02);
/// Number of spectral lines in the lowest band.
const LINES: usize = 3;
/// Shortest residual that is tested \[samples\].
const SHORTEST: usize = 60;

/// p-value of the test that a residual is first-order noise; 1 where it is too short for that.
///
/// `fitted`: number of fitted parameters. They lower the power of as many lines at most, usually the lowest ones: there a lack of power is
/// not counted. The fitted coefficients of the noise are not subtracted from the degrees of freedom, which makes the p-value too large rather
/// than too small.
#[must_use]
pub fn first_order_p(residual: &[f64], fitted: usize) -> f64 {
    let n = residual.iter().filter(|e| !e.is_nan()).count();
    if n < SHORTEST {
        return 1.0;
    }
    let mut white = first_order(residual, n as f64);
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(white.len());
    let mut spectrum = transform.make_output_vec();
    if transform.process(&mut white, &mut spectrum).is_err() {
        return 1.0;
    }
    let power: Vec<f64> = spectrum[1..white.len().div_ceil(2)]
        .iter()
        .map(|line| line.norm_sqr())
        .collect();
    let mean = power.iter().sum::<f64>() / power.len() as f64;
    if !(mean > 0.0 && mean.is_finite()) {
        return 1.0;
    }
    let (mut deviance, mut count) = (0.0, 0.0);
    for band in bands(power.len(), LINES) {
        let lines = band.len() as f64;
        let ratio = power[band.clone()].iter().sum::<f64>() / (mean * lines);
        if ratio > 1.0 || band.start >= fitted {
            deviance += 2.0 * lines * (ratio - 1.0 - ratio.max(f64::MIN_POSITIVE).ln());
        }
        count += 1.0;
    }
    // The mean is one of the bands' degrees of freedom.
    ChiSquared::new(count - 1.0).map_or(1.0, |chi| chi.sf(deviance))
}

/// A series whitened by the ARMA(1,1) process of the largest likelihood; zero where a sample is missing.
fn first_order(series: &[f64], n: f64) -> Vec<f64> {
    let whitened = |[a, c]: [f64; 2]| {
        let (pole, zero) = (a.tanh(), c.tanh());
        // In innovations form: x+ = pole x + (pole - zero) e, v = x + e.
        let process = StationaryNoise::new(vec![pole], &[pole - zero], vec![1.0], 1.0);
        let mut whitener = process.whitener(1);
        let mut log_det = 0.0;
        let white: Vec<f64> = series
            .iter()
            .map(|value| {
                if value.is_nan() {
                    whitener.skip();
                    return 0.0;
                }
                let mut row = [*value];
                log_det += whitener.push(&mut row).ln();
                row[0]
            })
            .collect();
        let squares: f64 = white.iter().map(|w| w * w).sum();
        (
            n * (squares / n).max(f64::MIN_POSITIVE).ln() + log_det,
            white,
        )
    };
    let cost = |point| whitened(point).0;
    let grid = STARTS.iter().flat_map(|&a| STARTS.map(|c| [a, c]));
    let costs = grid.map(|point| (cost(point), point));
    let best = costs.min_by(|a, b| a.0.total_cmp(&b.0));
    let (mut least, mut point) = best.unwrap_or((f64::INFINITY, [0.0; 2]));
    let mut step = STEPS.0;
    while step > STEPS.1 {
        let around = [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]];
        let diagonal = [[step, step], [-step, -step]];
        let moved = around.iter().chain(&diagonal).find_map(|[a, c]| {
            let next = [point[0] + a, point[1] + c].map(|z| z.clamp(-LARGEST, LARGEST));
            let cost = cost(next);
            (cost < least).then_some((cost, next))
        });
        match moved {
            Some(better) => (least, point) = better,
            None => step *= 0.5,
        }
    }
    whitened(point).1
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::TAU;

    use ct_signals::{ArModel, noise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::thresholds::Thresholds;

    const SAMPLES: usize = 800;

    /// White, autoregressive, and the sum of both, also with missing samples.
    #[test]
    fn first_order_noise_passes() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut chance, mut of_high_order) = (0, 0);
        for run in 0..400 {
            let slow = noise::ar1(SAMPLES, 1.0, [0.0, 0.8, 0.95, 0.98][run % 4], &mut rng);
            let white = noise::white(SAMPLES, [0.0, 0.3, 1.0][run % 3], &mut rng);
            let mut e: Vec<f64> = slow.iter().zip(&white).map(|(a, b)| a + b).collect();
            if run % 2 == 1 {
                e.iter_mut().skip(3).step_by(4).for_each(|e| *e = f64::NAN);
            }
            of_high_order += usize::from(ArModel::fit(&[&e], 6).unwrap().order() > 1);
            chance += usize::from(first_order_p(&e, 0) < 0.01);
        }
        // One in a hundred is expected, of 400; an autoregression needs a high order for many of them.
        assert!(
            chance <= 10 && of_high_order > 100,
            "{chance}, {of_high_order}"
        );
    }

    /// Parameters that are fitted to a residual remove its slow part: constants, ramps, slow functions of time.
    #[test]
    fn the_residual_of_a_fit_passes() {
        const FITTED: usize = 9;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut chance = 0;
        for run in 0..300 {
            let n = [200, 800][run % 2];
            let e = noise::ar1(n, 1.0, [0.0, 0.8, 0.95][run % 3], &mut rng);
            let wave =
                |k: usize, i: usize| (TAU * 0.5 * i as f64 * (k as f64 + 0.5) / n as f64).cos();
            // The waves are orthogonal.
            let mut left = e.clone();
            for i in 0..FITTED {
                let square: f64 = (0..n).map(|k| wave(k, i).powi(2)).sum();
                let size: f64 = (0..n).map(|k| wave(k, i) * e[k]).sum::<f64>() / square;
                for (k, left) in left.iter_mut().enumerate() {
                    *left -= size * wave(k, i);
                }
            }
            chance += usize::from(first_order_p(&left, FITTED) < 0.01);
        }
        // One in a hundred is expected, of 300.
        assert!(chance <= 8, "{chance}");
        for constant in [0.0, 3.0, f64::INFINITY] {
            assert!(first_order_p(&[constant; 100], 0) > 0.01);
        }
    }

    /// A line whose frequency moves, and a resonance, beside noise: an autoregressive noise model describes them.
    #[test]
    fn a_band_of_frequencies_is_no_first_order_noise() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut seen = [0; 4];
        for _ in 0..10 {
            let chirp = (0..SAMPLES).map(|k| {
                let part = k as f64 / SAMPLES as f64;
                (TAU * (4.0 * part + 10.0 * part * part)).sin()
            });
            let mut past = [0.0; 2];
            let resonance = noise::white(SAMPLES, 0.1, &mut rng).into_iter().map(|e| {
                let next = 1.9 * past[0] - 0.95 * past[1] + e;
                past = [next, past[0]];
                next
            });
            for (kind, signal) in [chirp.collect(), resonance.collect::<Vec<f64>>()]
                .into_iter()
                .enumerate()
            {
                let rms = (signal.iter().map(|v| v * v).sum::<f64>() / SAMPLES as f64).sqrt();
                for (colour, correlation) in [0.0, 0.9].into_iter().enumerate() {
                    let beside = noise::ar1(SAMPLES, 0.7 * rms, correlation, &mut rng);
                    let e: Vec<f64> = signal.iter().zip(&beside).map(|(a, b)| a + b).collect();
                    seen[2 * kind + colour] +=
                        usize::from(first_order_p(&e, 0) < Thresholds::DEFAULT.not_noise);
                }
            }
        }
        assert!(seen.iter().all(|seen| *seen >= 9), "{seen:?}");
    }
}
