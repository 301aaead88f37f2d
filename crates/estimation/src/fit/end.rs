//! One pass over the residuals at the end of a fit.

use crate::{Noise, Residuals, Squares};

/// Results of one pass over the residuals at the end of a fit.
pub(super) struct End {
    pub rmse: Vec<f64>,
    pub weights: Vec<f64>,
    pub prior_weight: f64,
    pub of_samples: f64,
    /// Logarithm of the determinant of the noise's covariance, for innovations of variance 1.
    pub log_det: f64,
}

impl End {
    pub(super) fn of(model: &impl Residuals, x: &[f64], noise: &Noise) -> Option<Self> {
        let samples = model.samples();
        let mut sums = vec![0.0; samples.len()];
        let mut whiteners = noise.whiteners(1);
        let mut squares = Squares::of(model, x);
        let mut log_det = 0.0;
        model.each_residual(x, |sample, row| {
            let whitener = &mut whiteners[sample.output];
            if sample.first {
                whitener.reset();
            }
            if sample.missing {
                whitener.skip();
                return true;
            }
            sums[sample.output] += row[0] * row[0];
            let variance = whitener.push_with_variance(row);
            // Late rows hardly change with the memory.
            if variance != 1.0 {
                log_det += variance.ln();
            }
            squares.sums[sample.output] += row[0] * row[0];
            true
        })?;
        let of_output = |(sum, &count): (&f64, &usize)| (sum / count.max(1) as f64).sqrt();
        Some(Self {
            rmse: sums.iter().zip(samples).map(of_output).collect(),
            weights: squares.weights(),
            prior_weight: squares.prior_weight(),
            of_samples: squares.of_samples(),
            log_det,
        })
    }
}
