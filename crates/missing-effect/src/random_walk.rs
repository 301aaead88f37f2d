//! Whether effects that follow time alone explain more than a random walk beside the noise does.
//!
//! **Model of the residual** (local level model): `e[k] = l[k] + v[k]`, `l[k+1] = l[k] + w[k]`, `v` and `w` white with variances
//! `s^2` and `q s^2`, `l[0]` unknown. No autoregressive model of low order describes it, and every drift, step or slow period looks
//! significant beside one that does not. The likelihood follows from the Kalman filter; `s^2` is at its best in closed form, `q` by a
//! search over its logarithm.
//!
//! Both residuals are whitened first by the noise model of the set with the effects: beside coloured noise a random walk would
//! otherwise describe the noise, and the effects with it. Whitened, a walk is a walk still, smaller by the sum of the filter.
//!
//! **Cost**: `O(N)` for a value of `q`.
//!
//! **Reference**: A. C. Harvey, Forecasting, Structural Time Series Models and the Kalman Filter, Cambridge 1989, ch. 4.

use ct_signals::ArModel;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{
    Error,
    confirm::{BIC_MARGIN, chance_of},
    node::Node,
    noise_floor::colour,
};

/// Decades of `q` that are searched, and values in each.
const DECADES: std::ops::Range<i32> = -9..2;
const EACH: i32 = 6;

/// Minus twice the logarithm of the likelihood of residuals, a series for each record, under white noise and a random walk.
fn deviance(residuals: &[Vec<f64>]) -> f64 {
    let at = |q: f64| {
        let (mut squares, mut log_det, mut count) = (0.0, 0.0, 0.0);
        for residual in residuals {
            // Nothing is known of the walk's first value (diffuse start): the first sample tells it.
            let Some((first, others)) = residual.split_first() else {
                continue;
            };
            let (mut level, mut variance) = (*first, 1.0 + q);
            for e in others {
                let innovation = e - level;
                let whole = variance + 1.0;
                squares += innovation * innovation / whole;
                log_det += f64::ln(whole);
                count += 1.0;
                let gain = variance / whole;
                level += gain * innovation;
                variance = variance * (1.0 - gain) + q;
            }
        }
        count * f64::ln((squares / count).max(f64::MIN_POSITIVE)) + log_det
    };
    (DECADES.start * EACH..DECADES.end * EACH)
        .map(|step| 10_f64.powf(f64::from(step) / f64::from(EACH)))
        .map(at)
        .fold(at(0.0), f64::min)
}

/// Residuals whitened by a noise model, without the first samples: they have no complete past, and are scaled otherwise, so that a level
/// other than zero would look like a jump.
fn whitened(residuals: &[Vec<f64>], noise: &ArModel) -> Vec<Vec<f64>> {
    let settled = |residual: &Vec<f64>| {
        let white = noise.whiten(residual);
        white.into_iter().skip(noise.order()).collect()
    };
    residuals.iter().map(settled).collect()
}

/// Whether a set lowers the deviance beyond chance against one that lacks some of its effects, where either residual may hold a random
/// walk.
pub(crate) fn beyond_random_walk(gained: &Node, lacking: &Node) -> Result<bool, Error> {
    let noise = colour(gained)?;
    let of = |node: &Node| {
        let residuals = node.setup.disturbance(&node.fit.x)?;
        Ok::<_, Error>(deviance(&whitened(&residuals, &noise)))
    };
    let free = |node: &Node| node.setup.free().len();
    let fall = of(lacking)? - of(gained)?;
    let freedom = free(gained).saturating_sub(free(lacking)).max(1);
    let penalty = gained.setup.price(0) - lacking.setup.price(0);
    let chance = ChiSquared::new(freedom as f64).map_or(1.0, |chi| chi.sf(fall.max(0.0)));
    Ok(fall > penalty + BIC_MARGIN && chance_of(gained, lacking, chance))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::noise_floor::NOISE_ORDER;

    const N: usize = 600;

    /// Noise of this correlation from sample to sample, a random walk of this standard deviation at the end, and a line that rises by so
    /// much.
    fn series(correlation: f64, walk: f64, rise: f64, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut level, mut noise): (f64, f64) = (0.0, 0.0);
        (0..N)
            .map(|k| {
                let [white, step]: [f64; 2] = std::array::from_fn(|_| rng.sample(StandardNormal));
                level += walk * step / (N as f64).sqrt();
                noise = correlation * noise + (1.0 - correlation.powi(2)).sqrt() * white;
                noise + level + rise * k as f64 / N as f64
            })
            .collect()
    }

    fn without_line(series: &[f64]) -> Vec<f64> {
        let t = |k: usize| k as f64 / N as f64 - 0.5;
        let mean = series.iter().sum::<f64>() / N as f64;
        let power: f64 = (0..N).map(|k| t(k) * t(k)).sum();
        let slope = series
            .iter()
            .enumerate()
            .map(|(k, e)| e * t(k))
            .sum::<f64>()
            / power;
        let line = |(k, e): (usize, &f64)| e - mean - slope * t(k);
        series.iter().enumerate().map(line).collect()
    }

    #[test]
    fn a_random_walk_is_no_drift_and_a_drift_is_no_random_walk() {
        let fall = |correlation: f64, walk: f64, rise: f64, seed: u64| {
            let series = series(correlation, walk, rise, seed);
            let mean = series.iter().sum::<f64>() / N as f64;
            let centred: Vec<f64> = series.iter().map(|e| e - mean).collect();
            let gained = without_line(&series);
            let noise = ArModel::fit(&[&gained], NOISE_ORDER).unwrap();
            let of = |residual: Vec<f64>| deviance(&whitened(&[residual], &noise));
            of(centred) - of(gained)
        };
        // Beyond the penalty of a parameter and the margin.
        let named = |correlation: f64, walk: f64, rise: f64| {
            (0..100)
                .filter(|&seed| fall(correlation, walk, rise, seed) > (N as f64).ln() + BIC_MARGIN)
                .count()
        };
        for correlation in [0.0, 0.8] {
            let walks = [0.5, 3.0].map(|walk| named(correlation, walk, 0.0));
            assert!(walks.iter().all(|count| *count <= 1), "{walks:?}");
        }
        // A drift whose rms is as large as the noise; three times as large beside coloured noise.
        let drifts = (named(0.0, 0.0, 3.5), named(0.8, 0.0, 10.0));
        assert!(drifts.0 >= 97 && drifts.1 >= 90, "{drifts:?}");
    }

    #[test]
    fn white_noise_has_no_random_walk() {
        let white = series(0.0, 0.0, 0.0, 3);
        let squares: f64 = white.iter().map(|e| e * e).sum();
        // An unknown mean costs the logarithm of the samples.
        let plain = N as f64 * (squares / N as f64).ln() + (N as f64).ln();
        assert!((deviance(&[white]) - plain).abs() < 3.0);
    }
}
