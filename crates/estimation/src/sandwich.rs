//! Robust (sandwich) standard errors of a fit whose residual has another spectrum than the noise model in its weighting.
//!
//! **Model**: the fit solves `J' M r = 0`, `M = W^-1` the inverse covariance of the noise that it took for granted
//! (`M = I` for a fit by simulation error); the noise in truth has the covariance `sigma^2 V`. Then
//! ```text
//! cov(theta) = sigma^2 (J' M J)^-1 (J' M V M J) (J' M J)^-1 = sigma^2 C G'G C,   G = L' M J,   V = L L'
//! ```
//! and `G` is the transposed colouring filter run backwards over the rows of `M J`. Of several outputs `M` and `V` have a block for each. A
//! prior is a row more, whose variance is known.
//!
//! **Cost**: `O(N p (p + q))`, `O(N p)` memory.
//!
//! **Reference**: P. J. Huber, The behavior of maximum likelihood estimates under nonstandard conditions, Proc. 5th
//! Berkeley Symposium 1 (1967) 221-233; H. White, Econometrica 48 (1980) 817-838.

use crate::{Error, Fit, Noise, Residuals, Rows, Triangle, marginal, noise_factor::Factor, rows};

/// Robust uncertainty of a fit whose residual has another spectrum than its weighting.
#[derive(Debug, Clone)]
pub struct Robust {
    /// Standard error of every entry of the vector; `None` for one that is fixed, at a bound, or not determined.
    pub std_errors: Vec<Option<f64>>,
    /// Degrees of freedom of each of them.
    pub freedom: Vec<Option<f64>>,
    /// Covariance of the entries at [`Fit::interior`], row by row; `None` where they are not determined.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// The noise of the residual.
    pub noise: Noise,
}

impl Robust {
    /// Half the width of the interval that contains the true value with probability `level` (0.95, say).
    #[must_use]
    pub fn half_widths(&self, level: f64) -> Vec<Option<f64>> {
        self.std_errors
            .iter()
            .zip(&self.freedom)
            .map(|(error, freedom)| {
                Some((*error)? * ct_signals::student_half_width(level, (*freedom)?))
            })
            .collect()
    }
}

/// The uncertainty of a fit under the noise model of its own residual, an autoregressive model of order zero to `order` for each output.
///
/// # Errors
/// Where the model is not finite at the fit.
pub fn robust(model: &impl Residuals, fit: &Fit, order: usize) -> Result<Robust, Error> {
    robust_with_memory(model, fit, order, f64::INFINITY)
}

/// As [`robust`], with the memory of the noise model limited to this number of samples ([`ct_signals::ArModel::with_memory_at_most`]): if a
/// residual contains slow model error, the record does not determine the variance of an AR noise with a root near one.
///
/// # Errors
/// As [`robust`].
pub fn robust_with_memory(
    model: &impl Residuals,
    fit: &Fit,
    order: usize,
    memory: f64,
) -> Result<Robust, Error> {
    let rows = rows(model, &fit.x).ok_or(Error::NoFiniteStart { starts: 1 })?;
    let noise = marginal::noise(&rows, fit.interior(), order)?.with_memory_at_most(memory);
    let own = fit.triangle.clone().with_prior_weight(fit.prior_weight());
    let bread = own.covariance(fit.interior());
    let mut sandwich = Sandwich::new(&rows, fit.interior(), (&fit.noise, &fit.weights), bread);
    let weight = fit.prior_weight().powi(2);
    rows.each_prior(fit.interior(), weight, |row| {
        sandwich.priors.push(row.to_vec())
    });
    let variances =
        |noise: &Noise, variance: f64| Some(diagonal(&sandwich.covariance(noise, variance)?));
    let (relative, variance) = noise.relative();
    let covariance = sandwich.covariance(&relative, variance);
    let own = covariance.as_ref().map(|c| diagonal(c)).unwrap_or_default();
    let freedom = marginal::freedom(&rows, fit.interior(), &noise, variances)
        .unwrap_or_else(|| vec![fit.degrees_left(); own.len()]);
    Ok(Robust {
        std_errors: fit.spread(own.into_iter().map(f64::sqrt)),
        freedom: fit.spread(freedom.into_iter()),
        covariance,
        noise,
    })
}

fn diagonal(matrix: &[Vec<f64>]) -> Vec<f64> {
    matrix.iter().enumerate().map(|(i, row)| row[i]).collect()
}

/// `C` and the rows `M J` of the parameters that are not at a bound. Rows with a missing reading are not used.
struct Sandwich {
    bread: Option<Vec<Vec<f64>>>,
    lanes: usize,
    /// For each series its output, its rows (zero if missing), and whether each row is present.
    series: Vec<(usize, Vec<f64>, Vec<bool>)>,
    /// The rows `M J` of the priors, of variance one.
    priors: Vec<Vec<f64>>,
}

impl Sandwich {
    /// From the Jacobian's columns of these parameters, the weighting of the fit, `W` (noise and weights), and `C` over them.
    fn new(
        rows: &Rows,
        columns: &[usize],
        (metric, weights): (&Noise, &[f64]),
        bread: Option<Vec<Vec<f64>>>,
    ) -> Self {
        let lanes = columns.len();
        let series = rows
            .series()
            .zip(rows.present())
            .map(|((output, series), (_, present))| {
                let mut whitener = metric.output(output).whitener(lanes);
                let mut own = Vec::with_capacity(present.len() * lanes);
                for (row, there) in series.chunks_exact(rows.columns).zip(&present) {
                    let from = own.len();
                    own.extend(columns.iter().map(|&column| row[column]));
                    if *there {
                        whitener.push(&mut own[from..]);
                    } else {
                        whitener.skip();
                    }
                }
                if lanes > 0 {
                    let factor = Factor::new(metric.output(output), &present);
                    factor.whiten_transposed(&mut own, lanes);
                }
                let weight = weights[output].powi(2);
                if weight != 1.0 {
                    own.iter_mut().for_each(|value| *value *= weight);
                }
                (output, own, present)
            })
            .collect();
        Self {
            bread,
            lanes,
            series,
            priors: Vec::new(),
        }
    }

    /// For noise with scales relative to that of the first output, and the variance of the first one.
    fn covariance(&self, noise: &Noise, variance: f64) -> Option<Vec<Vec<f64>>> {
        let bread = self.bread.as_ref()?;
        if self.lanes == 0 {
            return Some(Vec::new());
        }
        let mut filling = Triangle::new(self.lanes);
        for (output, series, present) in &self.series {
            let model = noise.output(*output);
            let mut rows = series.clone();
            Factor::new(model, present).colour_transposed(&mut rows, self.lanes);
            for row in rows.chunks_exact_mut(self.lanes) {
                row.iter_mut().for_each(|value| *value *= model.sigma());
                filling.push(row);
            }
        }
        // In units of the variance, like the other terms.
        let scale = 1.0 / variance.sqrt();
        for row in &self.priors {
            filling.push(&row.iter().map(|value| scale * value).collect::<Vec<f64>>());
        }
        filling.finish();
        // G C, a row for each entry: the covariance is the product of two of them.
        let sums: Vec<Vec<f64>> = bread
            .iter()
            .map(|row| {
                let sum = |i: usize| (i..self.lanes).map(|j| filling.at(i, j) * row[j]).sum();
                (0..self.lanes).map(sum).collect()
            })
            .collect();
        let product = |a: &Vec<f64>, b: &Vec<f64>| {
            let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            sum * variance
        };
        let rows = sums.iter();
        Some(
            rows.map(|a| sums.iter().map(|b| product(a, b)).collect())
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::marginal::tests::{covariance, rows_with_missing, some_noise};
    use approx::assert_relative_eq;

    #[test]
    fn agrees_with_dense_algebra_where_rows_are_missing() {
        for outputs in [1, 2] {
            let (rows, j, _, there) = rows_with_missing(outputs);
            let noise = some_noise(outputs).remove(2);
            for metric in some_noise(outputs) {
                let weights = metric.inverse_scales();
                let bread = rows.fold(&[0, 1, 2], &metric, &weights).covariance(&[0, 1]);
                let ours = Sandwich::new(&rows, &[0, 1], (&metric, &weights), bread)
                    .covariance(&noise, 0.5)
                    .unwrap();
                let weighted = covariance(&metric, &rows.lengths, &there)
                    .try_inverse()
                    .unwrap()
                    * &j;
                let bread = (j.transpose() * &weighted).try_inverse().unwrap();
                let filling =
                    weighted.transpose() * covariance(&noise, &rows.lengths, &there) * &weighted;
                let dense = &bread * filling * &bread * 0.5;
                let size = dense.amax();
                for (i, ours) in ours.iter().enumerate() {
                    for (j, ours) in ours.iter().enumerate() {
                        assert_relative_eq!(*ours, dense[(i, j)], epsilon = 1e-9 * size);
                    }
                    assert_relative_eq!(ours[i], dense[(i, i)], max_relative = 1e-9);
                }
            }
        }
    }
}
