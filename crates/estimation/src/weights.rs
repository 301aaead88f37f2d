//! Weights of outputs with unknown noise variances.
//!
//! **Model**: the whitened residuals of output `o`, `N_o` of them, have the unknown variance `s_o^2`. At its best for a sum of squares
//! `C_o` it is `C_o/N_o`, and minus twice the logarithm of the likelihood is, except for constants,
//! ```text
//! sum_o N_o log(C_o/N_o) = N log(C/N),   C = N prod_o (C_o/N_o)^(N_o/N),   N = sum_o N_o
//! ```
//! So `C`, N times the weighted geometric mean of the variances, is to several outputs what the sum of squares is to one: the smaller the
//! more likely, and `N log(C_a/C_b)` compares two models. Of one output it is the sum of squares.
//!
//! **Weights**: `dC = sum_o w_o^2 dC_o` with `w_o^2 = (C/N)/(C_o/N_o)`, so rows of output `o` times `w_o` have the gradient of `C`; and
//! since a geometric mean is at most the arithmetic one, a step that lowers the weighted sum of squares lowers `C` by at least as much. The
//! weights are those of iteratively reweighted least squares.
//!
//! **Known variances** leave the plain weighted sum of squares, in units of that of the first output.
//!
//! **Priors** ([`crate::Prior`]) are readings of known variance, one each: with `Q` the sum of their squares, in standard errors,
//! ```text
//! N log(C/N) = sum_o N_o log(C_o/N_o) + Q,     C = G exp(Q/N),     G = N prod_o (C_o/N_o)^(N_o/N)
//! ```
//! so `dC = exp(Q/N) (sum_o w_o^2 dC_o + (G/N) dQ)`: with the factor that all rows share left out, samples keep the weights that they have
//! without priors, and a prior's row counts by the root of `G/N`, the standard deviation of the noise. A step that lowers the weighted sum
//! of squares enough lowers `C`; the fit looks at `C`.
//!
//! **Reference**: G. A. F. Seber, C. J. Wild, Nonlinear Regression, 1989, ch. 11 (multiresponse models), for independent responses.

use serde::{Deserialize, Serialize};

use crate::{Residuals, prior::free_priors};

/// Sums of squares of each output, and the number of their samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Squares {
    /// Sum of squares of each output's whitened residual \[its unit squared\].
    pub sums: Vec<f64>,
    /// Samples of each output.
    pub samples: Vec<usize>,
    /// Lower bound of each output's noise standard deviation: it prevents an output that is fitted exactly from dominating.
    floors: Vec<f64>,
    /// Standard deviation of each output where it is known.
    known: Option<Vec<f64>>,
    /// Sum of squares of the priors, in standard errors.
    prior: f64,
}

impl Squares {
    /// Sums that start at zero. `samples`: number of samples of each output; `floor`: lower bound of its noise standard deviation.
    #[must_use]
    pub(crate) fn new(samples: &[usize], floor: impl Fn(usize) -> f64) -> Self {
        Self {
            sums: vec![0.0; samples.len()],
            samples: samples.to_vec(),
            floors: (0..samples.len()).map(floor).collect(),
            known: None,
            prior: 0.0,
        }
    }

    /// Zero sums for a model's outputs; its priors at `x`.
    pub(crate) fn of(model: &impl Residuals, x: &[f64]) -> Self {
        let prior = free_priors(model).map(|(_, prior)| prior.residual(x).powi(2));
        Self {
            known: model.known_scales().map(<[f64]>::to_vec),
            prior: prior.sum(),
            ..Self::new(model.samples(), |output| model.floor(output))
        }
    }

    /// The sums with the priors' part replaced.
    pub(crate) fn with_prior(mut self, squares: f64) -> Self {
        self.prior = squares;
        self
    }

    /// Variance of an output.
    fn variance(&self, output: usize) -> f64 {
        let variance = self.sums[output] / self.samples[output].max(1) as f64;
        variance
            .max(self.floors[output].powi(2))
            .max(f64::MIN_POSITIVE)
    }

    /// Number of all samples.
    fn count(&self) -> f64 {
        self.samples.iter().sum::<usize>() as f64
    }

    /// `C`.
    #[must_use]
    pub fn cost(&self) -> f64 {
        if let Some(scales) = &self.known {
            return self.of_samples() + scales[0].powi(2) * self.prior;
        }
        let samples = self.of_samples();
        if self.prior == 0.0 {
            return samples;
        }
        samples * (self.prior / self.count()).exp()
    }

    /// `G`: the cost without priors.
    #[must_use]
    pub fn of_samples(&self) -> f64 {
        if let Some(scales) = &self.known {
            let outputs = self.sums.iter().zip(scales);
            return outputs
                .map(|(sum, scale)| (relative(scales[0], *scale)).powi(2) * sum)
                .sum();
        }
        if let [sum] = self.sums[..] {
            return sum;
        }
        let n = self.count();
        let outputs = 0..self.sums.len();
        let mean: f64 = outputs
            .map(|o| self.samples[o] as f64 / n * self.variance(o).ln())
            .sum();
        n * mean.exp()
    }

    /// Weight of the rows of priors, which are in standard errors: the standard deviation of the noise.
    #[must_use]
    pub fn prior_weight(&self) -> f64 {
        match &self.known {
            Some(scales) => scales[0],
            None => (self.of_samples() / self.count().max(1.0)).sqrt(),
        }
    }

    /// `w_o`.
    #[must_use]
    pub fn weights(&self) -> Vec<f64> {
        if let Some(scales) = &self.known {
            return scales
                .iter()
                .map(|scale| relative(scales[0], *scale))
                .collect();
        }
        if self.sums.len() == 1 {
            return vec![1.0];
        }
        let mean = self.of_samples() / self.count();
        (0..self.sums.len())
            .map(|o| (mean / self.variance(o)).sqrt())
            .collect()
    }
}

/// Ratio of two scales, both above zero.
fn relative(first: f64, scale: f64) -> f64 {
    first.max(f64::MIN_POSITIVE) / scale.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn squares(sums: &[f64], samples: &[usize]) -> Squares {
        let mut squares = Squares::new(samples, |_| 0.0);
        squares.sums = sums.to_vec();
        squares
    }

    #[test]
    fn one_output_is_its_sum_of_squares() {
        let one = squares(&[7.3], &[40]);
        assert_eq!((one.cost(), one.weights()), (7.3, vec![1.0]));
    }

    #[test]
    fn cost_is_that_of_the_likelihood_and_weights_are_its_slopes() {
        let (sums, samples) = ([3.0, 500.0, 0.02], [100, 70, 30]);
        let at = |sums: &[f64]| squares(sums, &samples).cost();
        let likelihood: f64 = sums
            .iter()
            .zip(samples)
            .map(|(sum, n)| n as f64 * (sum / n as f64).ln())
            .sum();
        assert_relative_eq!(
            200.0 * (at(&sums) / 200.0).ln(),
            likelihood,
            max_relative = 1e-12
        );
        let weights = squares(&sums, &samples).weights();
        let mut weighted = 0.0;
        for o in 0..3 {
            let moved = |by: f64| {
                let mut moved = sums;
                moved[o] *= 1.0 + by;
                at(&moved)
            };
            let slope = (moved(1e-5) - moved(-1e-5)) / (2e-5 * sums[o]);
            assert_relative_eq!(weights[o].powi(2), slope, max_relative = 1e-8);
            weighted += weights[o].powi(2) * sums[o];
        }
        // The weighted sum of squares equals the cost here, and is never smaller.
        assert_relative_eq!(weighted, at(&sums), max_relative = 1e-12);
        for other in [[1.0, 900.0, 0.02], [30.0, 1.0, 5.0], [0.1, 0.1, 0.1]] {
            let sum: f64 = weights.iter().zip(other).map(|(w, c)| w * w * c).sum();
            assert!(at(&other) <= sum);
        }
    }

    #[test]
    fn an_output_that_is_met_exactly_counts_no_more_than_its_floor_says() {
        let mut met = Squares::new(&[50, 50], |_| 1e-3);
        met.sums = vec![0.0, 50.0];
        assert_relative_eq!(met.cost(), 100.0 * 1e-3, max_relative = 1e-12);
        assert_relative_eq!(
            met.weights()[0] / met.weights()[1],
            1e3,
            max_relative = 1e-9
        );
    }
}
