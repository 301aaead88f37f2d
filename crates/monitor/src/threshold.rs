//! The threshold of the scores, from the mean number of rows between false alarms.
//!
//! A score is a sum over an exponential window of length `W`, standardised: where nothing has changed it is a Gaussian
//! process with correlations `exp(-lag/W)`, a sampled Ornstein-Uhlenbeck process. Its rate of first passages of a high level
//! `h`, of either sign, is at most `2 h phi(h)/W` a row (D. Aldous, Probability Approximations via the Poisson Clumping
//! Heuristic, 1989, D3), and the scores' rates add up at most.
//!
//! The noise was itself estimated, from `N` rows: the size of its slow part, by which slow scores are divided, has a
//! relative standard error `nu`, from `var(sigma^)/sigma^2 = 1/(2N)` and `cov(a^) = sigma^2 Gamma^-1/N` for
//! the coefficients `a` of the autoregression. The rate is averaged over that error.

use ct_signals::ArModel;

/// Nodes for the average over the error of the noise, in its standard deviations.
const NODES: i32 = 12;

/// The relative standard error of the noise's slow part, `sigma/(1 - sum a)`, when estimated from `rows` rows.
pub(crate) fn relative_error(noise: &ArModel, rows: usize) -> f64 {
    let a = noise.coefficients();
    let p = a.len();
    let n = rows as f64;
    // sigma^2 Gamma^-1 = A A' - B B', lower triangular Toeplitz of (1, -a_1, ...) and (-a_p, ..., -a_1).
    let squares = |column: &dyn Fn(usize) -> f64| -> f64 {
        (0..p)
            .map(|j| (0..p - j).map(column).sum::<f64>().powi(2))
            .sum()
    };
    let first = |i: usize| if i == 0 { 1.0 } else { -a[i - 1] };
    let second = |i: usize| -a[p - 1 - i];
    let of_sum = (squares(&first) - squares(&second)).max(0.0) / n;
    let left = 1.0 - a.iter().sum::<f64>();
    (of_sum / (left * left) + 0.5 / n).sqrt()
}

/// The level that scores over windows of these lengths \[rows\] exceed once in `rows` rows without a change.
pub(crate) fn threshold(windows: &[f64], directions: usize, rows: f64, relative_error: f64) -> f64 {
    let density = |h: f64| h * (-0.5 * h * h).exp() / std::f64::consts::TAU.sqrt();
    let speed: f64 = windows.iter().map(|w| 1.0 / w).sum::<f64>() * directions as f64;
    let rate = |h: f64| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in -NODES..=NODES {
            let node = f64::from(i) / f64::from(NODES) * 4.0;
            let weight = (-0.5 * node * node).exp();
            // Below one, crossings are no rare events, and the rate of a score's own changes is used as a bound.
            sum += weight * density((h * (-relative_error * node).exp()).max(1.0));
            weights += weight;
        }
        2.0 * speed * sum / weights
    };
    let (mut low, mut high) = (1.0, 100.0);
    while high - low > 1e-9 {
        let middle = 0.5 * (low + high);
        if rate(middle) > 1.0 / rows {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    #[test]
    fn a_white_score_passes_as_seldom_as_promised() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (window, wanted) = (20.0, 20_000.0);
        let level = threshold(&[window], 1, wanted, 0.0);
        let noise = ct_signals::noise::white(2_000_000, 1.0, &mut rng);
        let keep = (-1.0 / window).exp();
        let scale = 1.0 / (1.0 - keep * keep).sqrt();
        let (mut z, mut alarms, mut armed) = (0.0, 0, true);
        for e in noise {
            z = keep * z + e;
            let score: f64 = z / scale;
            if armed && score.abs() > level {
                alarms += 1;
                armed = false;
            }
            armed |= score.abs() < 1.0;
        }
        // A hundred were allowed.
        assert!((40..=110).contains(&alarms), "{alarms} at {level}");
    }

    #[test]
    fn the_error_of_the_colour_is_that_of_theory() {
        let noise = ArModel::from_coefficients(&[0.8], 1.0).unwrap();
        let expected = ((1.0 - 0.64) / (0.04 * 1000.0) + 0.0005_f64).sqrt();
        assert!((relative_error(&noise, 1000) - expected).abs() < 1e-12);
        // Against estimates from simulated noise.
        let truth = ArModel::from_coefficients(&[1.2, -0.5], 1.0).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let slow =
            |noise: &ArModel| noise.sigma() / (1.0 - noise.coefficients().iter().sum::<f64>());
        let estimates: Vec<f64> = (0..300)
            .map(|_| {
                let e = ct_signals::noise::white(1100, 1.0, &mut rng);
                let mut v = vec![0.0; e.len()];
                for k in 2..e.len() {
                    v[k] = 1.2 * v[k - 1] - 0.5 * v[k - 2] + e[k];
                }
                (slow(&ArModel::fit(&[&v[100..]], 2).unwrap()) / slow(&truth)).ln()
            })
            .collect();
        let rms = (estimates.iter().map(|e| e * e).sum::<f64>() / 300.0).sqrt();
        let theory = relative_error(&truth, 1000);
        assert!((rms / theory - 1.0).abs() < 0.15, "{rms} {theory}");
    }
}
