//! Whether the energy of a residual is concentrated in a part of the record.
//!
//! An autoregressive noise model describes a temporary disturbance as noise with a long correlation time, and the whitened
//! residual does not show it. Noise with this correlation time would disturb the rest of the record as well. The share of the squared residual
//! in the best window of a quarter or an eighth of the record is compared with that of simulated residuals: the same innovations with random
//! signs, coloured by the noise model (wild bootstrap). Under the null hypothesis the signs of successive innovations are independent; their
//! size may change during the record.
//!
//! **Cost**: up to 20 000 simulated residuals, in parallel; a residual of more than 10 000 samples is not tested.
//!
//! **Reference**: E. Mammen, Annals of Statistics 21 (1993) 255-285 (wild bootstrap).

use std::ops::Range;

use ct_signals::ArModel;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Lengths of the windows, as a fraction (1 over these numbers) of the record.
const WINDOWS: [usize; 2] = [4, 8];
/// Shortest window \[samples\].
const SHORTEST_WINDOW: usize = 15;
/// Longest residual that is tested \[samples\]. Chosen, for time.
const LONGEST: usize = 10_000;
/// Simulated residuals of each round; another round follows while none is as concentrated. None of all 22 200 is a p-value of one in ten
/// thousand for two windows.
const ROUNDS: [u64; 3] = [200, 2_000, 20_000];
/// Simulated samples before the first one, so that the simulated residual is stationary.
const RUN_IN: usize = 200;

/// The window with so large a share of the squared residual that no simulated residual has one: a p-value of at most one in ten thousand.
/// `None` if there is no such window, the noise model is white, or the test is interrupted.
///
/// `white`: the residual whitened by the model, zero where a sample is missing.
#[must_use]
pub fn concentrated(
    noise: &ArModel,
    residual: &[f64],
    white: &[f64],
    interrupted: impl Fn() -> bool + Sync,
) -> Option<Range<usize>> {
    let n = residual.len();
    let innovations: Vec<f64> = white.iter().copied().filter(|w| *w != 0.0).collect();
    if noise.order() == 0
        || n / WINDOWS[0] < SHORTEST_WINDOW
        || n > LONGEST
        || innovations.is_empty()
    {
        return None;
    }
    let lengths = WINDOWS.map(|window| (n / window).max(SHORTEST_WINDOW));
    let measured = lengths.map(|length| largest_share(residual, length));
    let exceeds = |seed: u64| {
        let simulated = with_random_signs(noise, residual, white, &innovations, seed);
        let shares = lengths.iter().zip(&measured);
        shares
            .map(|(length, (share, _))| largest_share(&simulated, *length).0 >= *share)
            .collect::<Vec<bool>>()
    };
    let mut open = [true; WINDOWS.len()];
    let mut first = 0;
    for round in ROUNDS {
        let exceeding = (first..first + round)
            .into_par_iter()
            .map(|seed| {
                if interrupted() {
                    vec![true; WINDOWS.len()]
                } else {
                    exceeds(seed)
                }
            })
            .reduce(
                || vec![false; WINDOWS.len()],
                |a, b| a.iter().zip(&b).map(|(a, b)| *a || *b).collect(),
            );
        for (open, exceeding) in open.iter_mut().zip(exceeding) {
            *open &= !exceeding;
        }
        if !open.contains(&true) {
            return None;
        }
        first += round;
    }
    let window = open.iter().position(|open| *open)?;
    let from = measured[window].1;
    Some(from..from + lengths[window] - 1)
}

/// A residual of the noise model with the innovations of `white` in their order and with random signs. Where a sample is missing, and before
/// the first one, innovations are drawn.
fn with_random_signs(
    noise: &ArModel,
    residual: &[f64],
    white: &[f64],
    innovations: &[f64],
    seed: u64,
) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let n = residual.len();
    let mut series = vec![0.0; RUN_IN + n];
    for k in 0..series.len() {
        let own = k.checked_sub(RUN_IN).map_or(0.0, |k| white[k]);
        let innovation = if own == 0.0 {
            innovations[rng.random_range(0..innovations.len())]
        } else {
            own
        };
        let sign = if rng.random::<bool>() { 1.0 } else { -1.0 };
        let past = noise.coefficients().iter().zip(series[..k].iter().rev());
        series[k] = past.map(|(a, e)| a * e).sum::<f64>() + sign * innovation;
    }
    series.drain(..RUN_IN);
    for (value, measured) in series.iter_mut().zip(residual) {
        if measured.is_nan() {
            *value = f64::NAN;
        }
    }
    series
}

/// The largest share of the squares in a window of this length, and where that window begins.
fn largest_share(residual: &[f64], length: usize) -> (f64, usize) {
    let square = |e: &f64| if e.is_nan() { 0.0 } else { e * e };
    let all: f64 = residual.iter().map(square).sum();
    let mut sum: f64 = residual[..length].iter().map(square).sum();
    let mut largest = (sum, 0);
    for from in 1..=residual.len() - length {
        sum += square(&residual[from + length - 1]) - square(&residual[from - 1]);
        if sum > largest.0 {
            largest = (sum, from);
        }
    }
    (largest.0 / all.max(f64::MIN_POSITIVE), largest.1)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use ct_signals::noise;

    use super::*;
    use crate::residual_tests::white::standardised;

    const SAMPLES: usize = 600;

    fn window(e: &[f64]) -> Option<Range<usize>> {
        let model = ArModel::fit(&[e], 6).unwrap();
        concentrated(&model, e, &standardised(&model, e), || false)
    }

    #[test]
    fn noise_is_not_concentrated_even_where_its_size_changes() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut chance = 0;
        for run in 0..300 {
            let correlation = [0.5, 0.9, 0.97][run % 3];
            // Innovations that are three times as large in a fifth of the record, or at its start.
            let larger = [200..320, 0..0, 0..60][run % 3].clone();
            let size = |k: usize| if larger.contains(&k) { 3.0 } else { 1.0 };
            let innovations = noise::white(SAMPLES, 1.0, &mut rng).into_iter().enumerate();
            let mut past = 0.0;
            let noise = innovations.map(|(k, w)| {
                past = correlation * past + size(k) * w;
                past
            });
            let mut e: Vec<f64> = noise.collect();
            if run % 5 == 0 {
                e.iter_mut().skip(1).step_by(3).for_each(|e| *e = f64::NAN);
            }
            chance += usize::from(window(&e).is_some());
        }
        // One in ten thousand is asked for. The correlation is estimated too low, so that there are more; three of 300 would be a hundred times
        // as many.
        assert!(chance <= 2, "{chance}");
    }

    #[test]
    fn a_disturbance_for_a_while_is_found_in_coloured_noise() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut seen = 0;
        for _ in 0..10 {
            let mut e = noise::ar1(SAMPLES, 1.0, 0.85, &mut rng);
            let mut level = 0.0;
            for (k, e) in e.iter_mut().enumerate() {
                let wanted = if (200..270).contains(&k) { 8.0 } else { 0.0 };
                level += 0.15 * (wanted - level);
                *e += level;
            }
            seen += usize::from(window(&e).is_some_and(|w| w.start < 210 && w.end > 260));
        }
        assert!(seen >= 9, "{seen}");
        let zero = vec![0.0; SAMPLES];
        assert!(window(&zero).is_none());
    }
}
