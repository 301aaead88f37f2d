//! Tests whether a residual is autoregressive noise. Each one looks for:
//!
//! - **an input**: correlation of signals derived from an input with the residual whitened by its own noise model ([`of_command`]);
//! - **a period**: a spectral line above the neighbouring spectrum ([`period`]);
//! - **harmonics** of an identified period: a periodic disturbance that is not a sine ([`harmonics_p`]);
//! - **an instant**: windows of 1, 2, 4, ... samples whose sums over the root of their length are standard normal ([`instant`]);
//! - **a level**: regression of the whitened residual on functions of the model's previous output ([`level_p`]). A white residual is independent
//!   of the past, so its regression on any past signal is chi-square distributed, whatever the spectrum of the regressors.
//!
//! **References**: L. D. Haugh, J. American Statistical Association 71 (1976) 378-385; S. A. Billings, W. S. F. Voon, Int. J. Control 44 (1986)
//! 235-244.

use std::f64::consts::{SQRT_2, TAU};

use ct_signals::{ArModel, Error};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use statrs::function::erf::erfc;

use super::spectral_line::strongest_line;

/// Longest tested window, as a fraction (1 over this number) of the record.
const LONGEST_WINDOW: usize = 4;

/// Knots of the functions of the level, evenly spaced over the range of the model's output.
const KNOTS: usize = 11;
/// A function is used if the sum of its squares is at least this many samples: a sum over fewer samples is not close to Gaussian.
const VISITED: f64 = 5.0;

/// The command, its square about the mean, and the size of its moves.
#[must_use]
pub fn of_command(u: &[f64]) -> Vec<Vec<f64>> {
    let mean = u.iter().sum::<f64>() / u.len() as f64;
    let square = u.iter().map(|u| (u - mean).powi(2)).collect();
    let mut moves = vec![0.0];
    moves.extend(u.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    vec![u.to_vec(), square, moves]
}

/// The whitened residual with unit variance; zero if the sample is missing, so that sums and products ignore it.
#[must_use]
pub fn standardised(noise: &ArModel, residual: &[f64]) -> Vec<f64> {
    let mut white = noise.whiten(residual);
    let present = || white.iter().filter(|w| !w.is_nan());
    let count = present().count().max(1);
    let rms = (present().map(|w| w * w).sum::<f64>() / count as f64).sqrt();
    for w in &mut white {
        *w = if w.is_nan() {
            0.0
        } else {
            *w / rms.max(f64::MIN_POSITIVE)
        };
    }
    white
}

/// p-value of the test that a whitened residual is independent of the model's previous output.
#[must_use]
pub fn level_p(model: &[f64], white: &[f64]) -> f64 {
    let (low, high) = ct_signals::range_of(model);
    let width = (high - low) / (KNOTS - 1) as f64;
    if !(width.is_finite() && width > 0.0) {
        return 1.0;
    }
    // Piecewise linear (hat) functions, which sum to one: two neighbours are nonzero at each sample.
    let mut gram = DMatrix::<f64>::zeros(KNOTS, KNOTS);
    let mut moment = DVector::<f64>::zeros(KNOTS);
    // Zero where the sample is missing.
    for (y, w) in model.iter().zip(&white[1..]).filter(|(_, w)| **w != 0.0) {
        let at = (y - low) / width;
        let left = (at as usize).min(KNOTS - 2);
        let hats = [(left, left as f64 + 1.0 - at), (left + 1, at - left as f64)];
        for (i, a) in hats {
            moment[i] += a * w;
            for (j, b) in hats {
                gram[(i, j)] += a * b;
            }
        }
    }
    let visited: Vec<usize> = (0..KNOTS).filter(|&i| gram[(i, i)] > VISITED).collect();
    let gram = gram.select_rows(&visited).select_columns(&visited);
    let moment = moment.select_rows(&visited);
    let explained = gram
        .cholesky()
        .map_or(0.0, |factor| moment.dot(&factor.solve(&moment)));
    ChiSquared::new(visited.len() as f64).map_or(1.0, |chi| chi.sf(explained.max(0.0)))
}

/// The first and the last sample of the window whose sum is least probable in white noise; `None` if its p-value, corrected for the number of
/// windows, is `level` or more.
#[must_use]
pub fn instant(white: &[f64], level: f64) -> Option<(usize, usize)> {
    let n = white.len();
    let lengths =
        || std::iter::successors(Some(1), |l| Some(2 * l)).take_while(|l| LONGEST_WINDOW * l <= n);
    let windows: usize = lengths().map(|length| n - length + 1).sum();
    let mut running = vec![0.0];
    running.extend(white.iter().scan(0.0, |sum, w| {
        *sum += w;
        Some(*sum)
    }));
    let (size, from, length) = lengths()
        .flat_map(|length| (0..=n - length).map(move |from| (from, length)))
        .map(|(from, length)| {
            let sum: f64 = running[from + length] - running[from];
            (sum.abs() / (length as f64).sqrt(), from, length)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    let chance = windows as f64 * erfc(size / SQRT_2);
    (chance < level).then(|| {
        let to = (from + length).min(n - 1);
        (from, to)
    })
}

/// Number of periods in the residual of its strongest spectral line; `None` if the p-value of the line is `level` or more.
///
/// # Errors
/// Where the residual is too short for a noise model of first order.
pub fn period(residual: &[f64], level: f64) -> Result<Option<usize>, Error> {
    let line = strongest_line(residual)?.filter(|line| line.chance < level);
    Ok(line.map(|line| line.cycles))
}

/// Tested harmonics.
const HARMONICS: [f64; 2] = [2.0, 3.0];

/// p-value of the second and third harmonic of a period in a residual: by the fall of -2 log likelihood when they are removed, with
/// autoregressive noise of at most this order. `time` and `period` in one unit.
///
/// # Errors
/// Where the residual is too short for a noise model.
pub fn harmonics_p(
    time: &[f64],
    residual: &[f64],
    period: f64,
    order: usize,
) -> Result<f64, Error> {
    let rows: Vec<usize> = (0..residual.len())
        .filter(|&k| !residual[k].is_nan())
        .collect();
    let columns = 1 + 2 * HARMONICS.len();
    let waves = |k: usize, column: usize| {
        let Some(wave) = column.checked_sub(1) else {
            return 1.0;
        };
        let angle = TAU * HARMONICS[wave / 2] * time[k] / period;
        if wave % 2 == 0 {
            angle.cos()
        } else {
            angle.sin()
        }
    };
    let regressors = DMatrix::from_fn(rows.len(), columns, |i, column| waves(rows[i], column));
    let of_residual = DVector::from_iterator(rows.len(), rows.iter().map(|&k| residual[k]));
    let gram = regressors.transpose() * &regressors;
    let Some(factor) = gram.cholesky() else {
        return Ok(1.0);
    };
    let sizes = factor.solve(&(regressors.transpose() * of_residual));
    let less = |columns: usize| -> Vec<f64> {
        let without = |k: usize| {
            let wave: f64 = (0..columns)
                .map(|column| sizes[column] * waves(k, column))
                .sum();
            residual[k] - wave
        };
        (0..residual.len()).map(without).collect()
    };
    let with = ArModel::fit(&[&less(1)], order)?;
    let without = ArModel::fit(&[&less(columns)], order)?;
    let n = rows.len() as f64;
    // BIC chose the orders, so each coefficient has the penalty of BIC.
    let coefficients = with.order() as f64 - without.order() as f64;
    let fall = 2.0 * n * (with.sigma() / without.sigma()).ln() + coefficients * n.ln();
    Ok(ChiSquared::new((columns - 1) as f64).map_or(1.0, |chi| chi.sf(fall.max(0.0))))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]
    use std::f64::consts::PI;

    use ct_signals::ArModel;

    use super::*;
    use ct_signals::noise;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const SAMPLES: usize = 800;
    const NOT_NOISE: f64 = 1e-4;

    #[test]
    fn noise_of_any_colour_has_no_period_and_no_instant() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        // At a level of one in a hundred, 600 series: chance exceeds 15 of them once in a thousand.
        let (mut periods, mut instants, mut levels) = (0, 0, 0);
        // A level that drifts, and one that steps and stays.
        let drift = noise::ar1(SAMPLES, 3.0, 0.99, &mut rng);
        let steps: Vec<f64> = (0..SAMPLES).map(|k| drift[k / 50 * 50]).collect();
        for run in 0..600 {
            let colour = [0.0, 0.8, 0.95][run % 3];
            let e = noise::ar1(SAMPLES, 0.1, colour, &mut rng);
            let model = ArModel::from_coefficients(&[colour], 1.0).unwrap();
            periods += usize::from(period(&e, 0.01).unwrap().is_some());
            let white = standardised(&model, &e);
            instants += usize::from(instant(&white, 0.01).is_some());
            levels += usize::from(level_p([&drift, &steps][run % 2], &white) < 0.01);
        }
        assert!(periods <= 15 && instants <= 15, "{periods}, {instants}");
        assert!((1..=15).contains(&levels), "{levels}");
    }

    #[test]
    fn a_period_is_found_with_its_length_in_noise_of_its_own_size() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for wanted in [5.0, 21.3, 160.0, 400.0] {
            let e: Vec<f64> = noise::white(SAMPLES, 0.1, &mut rng)
                .into_iter()
                .enumerate()
                .map(|(k, e)| e + 0.14 * (2.0 * PI * 2.0 * k as f64 / wanted).sin())
                .collect();
            let Some(cycles) = period(&e, NOT_NOISE).unwrap() else {
                panic!("no period of {wanted} s");
            };
            // To the width of a line.
            assert!((cycles as f64 - 2.0 * (SAMPLES - 1) as f64 / wanted).abs() < 1.0);
        }
    }

    #[test]
    fn a_function_of_the_level_is_found_under_noise_of_its_own_size() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let level = noise::ar1(SAMPLES, 3.0, 0.99, &mut rng);
        let mut white = noise::white(SAMPLES, 1.0, &mut rng);
        assert!(level_p(&level, &white) > 0.01);
        for k in 1..SAMPLES {
            white[k] += 0.5 * (2.0 * level[k - 1]).sin();
        }
        assert!(level_p(&level, &white) < NOT_NOISE);
        assert!(level_p(&[2.0; SAMPLES], &white) == 1.0);
    }

    #[test]
    fn an_instant_is_found_where_it_is() {
        let mut white = noise::white(SAMPLES, 1.0, &mut ChaCha8Rng::seed_from_u64(3));
        white[300] += 8.0;
        assert_eq!(instant(&white, NOT_NOISE), Some((300, 301)));
        white[300] -= 8.0;
        for value in &mut white[500..520] {
            *value += 2.0;
        }
        let Some((from, to)) = instant(&white, NOT_NOISE) else {
            panic!("nothing was found");
        };
        assert!(from.abs_diff(500) < 10 && (to - from).abs_diff(20) < 15);
    }

    /// A square wave of which only the sine was found leaves harmonics in the residual; noise has none, whatever its spectrum.
    #[test]
    fn harmonics_are_found_beside_a_named_period_and_not_in_noise() {
        let period = 90.0;
        let time: Vec<f64> = (0..SAMPLES).map(|k| k as f64).collect();
        let mut chance = 0;
        for seed in 0..60 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            for correlation in [0.0, 0.8, 0.95] {
                let noise = noise::ar1(SAMPLES, 1.0, correlation, &mut rng);
                let p = harmonics_p(&time, &noise, period, 6).unwrap();
                chance += usize::from(p < 0.01);
            }
            let white = noise::white(SAMPLES, 1.0, &mut rng);
            let square = |t: f64| {
                let sine = (2.0 * PI * t / period).sin();
                sine.signum() - 4.0 / PI * sine
            };
            let residual: Vec<f64> = time
                .iter()
                .zip(&white)
                .map(|(t, e)| square(*t) + e)
                .collect();
            assert!(harmonics_p(&time, &residual, period, 6).unwrap() < NOT_NOISE);
        }
        // One in a hundred is asked for, of 180.
        assert!(chance <= 8, "{chance}");
    }
}
