//! Test whether functions of time explain more than a random walk in addition to the noise.
//!
//! **Model of the residual** (local level model): `e[k] = l[k] + v[k]`, `l[k+1] = l[k] + w[k]`, `v` and `w` white with variances
//! `s^2` and `q s^2`, `l[0]` zero or unknown. No autoregressive model of low order describes it, and every drift, step or slow period looks
//! significant beside one that does not. The likelihood follows from the Kalman filter; `s^2` is at its best in closed form, `q` by a
//! search over its logarithm.
//!
//! Both residuals are whitened first by the noise model of the set with the effects: if the noise is coloured, a random walk would
//! otherwise describe the noise, and the effects with it. A whitened walk is still a walk, smaller by the factor `A(1)`; sizes
//! are stated in the standard deviation of the noise itself.
//!
//! **Parameters**: a walk that is attributed to the plant biases the parameters, so each model is fitted again together with
//! the walk, in one step from its linearisation. Without this step a false effect is significant in one of thirty records with drifting
//! noise.
//!
//! **Cost**: `O(N p^2)` for a value of `q`.
//!
//! **Reference**: A. C. Harvey, Forecasting, Structural Time Series Models and the Kalman Filter, Cambridge 1989, ch. 4.

use ct_signals::ArModel;
use greybox::{Noise, Triangle};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{
    Error,
    fit::{
        criterion::{BIC_MARGIN, chance_of},
        node::Node,
        noise_model::noise_of,
    },
};

/// Number of decades of `q` in the search, and values in each.
const DECADES: std::ops::Range<i32> = -9..2;
const EACH: i32 = 6;

/// The chi-square distribution is only approximate here, because the walk's size is fitted and the fit is one step: therefore the
/// significance level is divided by this.
const STRICTER: f64 = 3.0;

/// A walk changes the output through the parameters by about this rms relative to the noise, at most: that of a walk that ends at half the
/// size of the noise.
const BENDING: f64 = 0.35;

/// The random walks that may replace effects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Walk {
    /// The first value is unknown (diffuse start); otherwise it is zero, so that a constant offset is no random walk.
    pub anywhere: bool,
    /// Largest standard deviation at the end of a record relative to the noise.
    pub largest: f64,
    /// Whether the parameters are fitted again together with the walk.
    pub fitted_again: bool,
}

impl Walk {
    /// A walk of any size; the models keep their fitted parameters.
    pub const ANY: Self = Self {
        anywhere: true,
        largest: f64::INFINITY,
        fitted_again: false,
    };
    /// A walk that is at most as large as the noise over the longest record; the parameters are fitted again together with it.
    pub const SMALL: Self = Self {
        anywhere: true,
        largest: 1.0,
        fitted_again: true,
    };
    /// [`Self::SMALL`] from zero: it has no offset, and does not describe what effects close to an offset describe.
    pub const SMALL_FROM_ZERO: Self = Self {
        anywhere: false,
        ..Self::SMALL
    };
}

/// Residuals whitened by the noise model of their output, divided by its innovations, with their derivatives with respect to the free
/// parameters, row by row, a series for each record and output; the residual is the last column. The first samples of a record are left
/// out: they have no complete past and another scaling, so that a constant level would look like a step.
struct Whitened {
    columns: usize,
    series: Vec<Vec<f64>>,
    /// Gain of the whitening filter for a slow change of the output: its size in the whitened rows over that of their innovations, for a
    /// change as large as the noise.
    slow: f64,
}

impl Whitened {
    fn of(columns: usize, series: impl Iterator<Item = Vec<f64>>, noise: &Noise) -> Self {
        let first = noise.output(0).sigma();
        let whiten = |(i, mut rows): (usize, Vec<f64>)| {
            let model = noise.of_series(i);
            let mut whitener = model.whitener(columns);
            let weight = if noise.outputs() > 1 {
                first / model.sigma()
            } else {
                1.0
            };
            for row in rows.chunks_exact_mut(columns) {
                // The row of a missing sample has no residual.
                if row[columns - 1].is_nan() {
                    whitener.skip();
                } else {
                    whitener.push(row);
                    row.iter_mut().for_each(|value| *value *= weight);
                }
            }
            rows.split_off((model.order() * columns).min(rows.len()))
        };
        Self {
            columns,
            series: series.enumerate().map(whiten).collect(),
            slow: noise.iter().map(ArModel::slow_gain).fold(0.0, f64::max),
        }
    }

    /// Minus twice the logarithm of the likelihood with white noise and a random walk, minimised over the parameters (one Gauss-Newton step
    /// weighted by this noise model, within [`BENDING`]) and over `q`.
    fn deviance(&self, walk: Walk) -> f64 {
        let rows = |values: &Vec<f64>| values.len() / self.columns;
        let longest = self.series.iter().map(rows).max().unwrap_or(1);
        let largest = (self.slow * walk.largest).powi(2) / longest as f64;
        (DECADES.start * EACH..DECADES.end * EACH)
            .map(|step| 10_f64.powf(f64::from(step) / f64::from(EACH)))
            .filter(|q| *q <= largest)
            .map(|q| self.at(q, walk.anywhere))
            .fold(self.at(0.0, walk.anywhere), f64::min)
    }

    fn at(&self, q: f64, anywhere: bool) -> f64 {
        let last = self.columns - 1;
        let (mut triangle, mut log_det) = (Triangle::new(self.columns), 0.0);
        let (mut level, mut innovation) = (vec![0.0; self.columns], vec![0.0; self.columns]);
        for rows in &self.series {
            let mut rows = rows.chunks_exact(self.columns);
            let mut variance = 0.0;
            level.fill(0.0);
            // The first sample determines the start.
            if anywhere {
                let Some(first) = rows.find(|row| !row[last].is_nan()) else {
                    continue;
                };
                level.copy_from_slice(first);
                variance = 1.0 + q;
            }
            for row in rows {
                if row[last].is_nan() {
                    variance += q;
                    continue;
                }
                let whole = variance + 1.0;
                let gain = variance / whole;
                let scale = whole.sqrt().recip();
                for ((innovation, level), value) in innovation.iter_mut().zip(&mut level).zip(row) {
                    let new = value - *level;
                    *innovation = scale * new;
                    *level += gain * new;
                }
                triangle.push(&innovation);
                log_det += f64::ln(whole);
                variance = variance * (1.0 - gain) + q;
            }
        }
        let count = triangle.rows() as f64;
        // A walk changes the parameters by no more than slow parameter changes would change the output.
        let bend = ((self.slow * BENDING).powi(2) * count / last.max(1) as f64).sqrt();
        for row in self
            .series
            .iter()
            .flat_map(|rows| rows.chunks_exact(self.columns))
            .filter(|row| !row[last].is_nan())
        {
            for (to, value) in innovation.iter_mut().zip(&row[..last]) {
                *to = value / bend;
            }
            innovation[last] = 0.0;
            triangle.push(&innovation);
        }
        triangle.finish();
        let squares = triangle.at(last, last).powi(2);
        count * f64::ln((squares / count).max(f64::MIN_POSITIVE)) + log_det
    }
}

/// Whether a set lowers the deviance significantly compared with a set that lacks some of its effects, if either residual may contain a
/// random walk.
pub(crate) fn beyond_random_walk(gained: &Node, lacking: &Node, walk: Walk) -> Result<bool, Error> {
    let noise = noise_of(gained)?;
    // A model that cannot be simulated any more is not significant.
    let (Some(with), Some(without)) = (
        of_node(gained, &noise, walk),
        of_node(lacking, &noise, walk),
    ) else {
        return Ok(false);
    };
    let free = |node: &Node| node.setup.free().len();
    let fall = without.deviance(walk) - with.deviance(walk);
    let freedom = free(gained).saturating_sub(free(lacking)).max(1);
    let penalty = gained.setup.bic_penalty(0) - lacking.setup.bic_penalty(0);
    let chance = ChiSquared::new(freedom as f64).map_or(1.0, |chi| chi.sf(fall.max(0.0)));
    Ok(fall > penalty + BIC_MARGIN && chance_of(gained, lacking, STRICTER * chance))
}

fn of_node(node: &Node, noise: &Noise, walk: Walk) -> Option<Whitened> {
    let rows = node.setup.rows(&node.fit.x)?;
    let last = rows.columns - 1;
    let (columns, from) = if walk.fitted_again {
        (rows.columns, 0)
    } else {
        (1, last)
    };
    let series = rows.series().map(|(_, series)| {
        let rows = series.chunks_exact(rows.columns);
        rows.flat_map(|row| &row[from..]).copied().collect()
    });
    Some(Whitened::of(columns, series, noise))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use ct_signals::ArModel;

    use super::*;
    use crate::fit::noise_model::NOISE_ORDER;

    const N: usize = 600;

    /// Noise with this correlation from sample to sample, a random walk with this standard deviation at the end, and a line with this rise.
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
            let noise = Noise::fit(std::slice::from_ref(&gained), 1, NOISE_ORDER).unwrap();
            let of = |residual: Vec<f64>| {
                Whitened::of(1, std::iter::once(residual), &noise).deviance(Walk::ANY)
            };
            of(centred) - of(gained)
        };
        // Larger than the penalty of a parameter and the margin.
        let named = |correlation: f64, walk: f64, rise: f64| {
            (0..100)
                .filter(|&seed| fall(correlation, walk, rise, seed) > (N as f64).ln() + BIC_MARGIN)
                .count()
        };
        for correlation in [0.0, 0.8] {
            let walks = [0.5, 3.0].map(|walk| named(correlation, walk, 0.0));
            assert!(walks.iter().all(|count| *count <= 1), "{walks:?}");
        }
        // A drift with an rms as large as the noise; three times as large for coloured noise.
        let drifts = (named(0.0, 0.0, 3.5), named(0.8, 0.0, 10.0));
        assert!(drifts.0 >= 97 && drifts.1 >= 90, "{drifts:?}");
    }

    #[test]
    fn parameters_are_fitted_again_beside_the_walk_as_far_as_it_bends_them() {
        // The parameter's derivative is a line; the line in the series agrees with the parameter, or is much steeper.
        let fits = |rise: f64| {
            let series = series(0.0, 0.1, rise, 5);
            let t = |k: usize| k as f64 / N as f64;
            let of = |columns: usize, rows: Vec<f64>| {
                Whitened::of(columns, std::iter::once(rows), &Noise::white(1))
                    .deviance(Walk::SMALL_FROM_ZERO)
            };
            let fitted = of(2, (0..N).flat_map(|k| [t(k), series[k]]).collect());
            let with_slope = |slope: f64| {
                let left = (0..N).map(|k| series[k] - slope * t(k)).collect();
                of(1, left)
            };
            let least = (-100..=300)
                .map(|part| with_slope(f64::from(part) / 20.0))
                .fold(f64::INFINITY, f64::min);
            [fitted - least, with_slope(0.0) - fitted]
        };
        let [behind, before] = fits(0.6);
        assert!(
            (-0.1..2.0).contains(&behind) && before > 3.0,
            "{behind} {before}"
        );
        let [behind, _] = fits(10.0);
        assert!(behind > 50.0, "{behind}");
    }

    #[test]
    fn an_offset_is_a_walk_only_where_it_may_begin_anywhere() {
        let white = series(0.0, 0.0, 0.0, 7);
        let offset: Vec<f64> = white.iter().map(|e| e + 1.0).collect();
        let fall = |anywhere: bool| {
            let of = |rows: &[f64]| {
                Whitened::of(1, std::iter::once(rows.to_vec()), &Noise::white(1)).deviance(Walk {
                    anywhere,
                    ..Walk::ANY
                })
            };
            of(&offset) - of(&white)
        };
        // A step of one standard deviation in the first sample would need a walk.
        assert!(fall(false) > 20.0, "{}", fall(false));
        assert!(fall(true).abs() < 1e-6);
    }

    #[test]
    fn a_small_walk_is_small_beside_the_noise_itself() {
        // With noise of a long memory, a line is better distinguished from a walk as large as the noise than from a walk of any size.
        let noise = Noise::of(vec![ArModel::from_coefficients(&[0.8], 0.6).unwrap()]);
        let falls = (0..40).map(|seed| {
            let series = series(0.8, 0.0, 5.0, seed);
            let of = |rows: Vec<f64>, walk: Walk| {
                Whitened::of(1, std::iter::once(rows), &noise).deviance(walk)
            };
            let line = without_line(&series);
            [Walk::SMALL, Walk::ANY].map(|walk| of(series.clone(), walk) - of(line.clone(), walk))
        });
        let (mut small, mut any) = (0.0, 0.0);
        for [from_small, from_any] in falls {
            assert!(from_small >= from_any - 1e-9, "{from_small} {from_any}");
            small += from_small / 40.0;
            any += from_any / 40.0;
        }
        assert!(small > any + 2.0, "{small} {any}");
    }

    #[test]
    fn white_noise_has_no_random_walk() {
        let white = series(0.0, 0.0, 0.0, 3);
        let squares: f64 = white.iter().map(|e| e * e).sum();
        // An unknown mean costs the logarithm of the samples.
        let plain = N as f64 * (squares / N as f64).ln() + (N as f64).ln();
        assert!(
            (Whitened::of(1, std::iter::once(white), &Noise::white(1)).deviance(Walk::ANY) - plain)
                .abs()
                < 3.0
        );
    }
}
