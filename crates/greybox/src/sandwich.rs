//! Standard errors of a fit whose residual has another colour than the metric it was fitted in.
//!
//! **Model**: the fit solves `J' M r = 0`, `M = W^-1` the inverse covariance of the noise that it took for granted
//! (`M = I` for a fit by simulation error); the noise in truth has the covariance `sigma^2 V`. Then
//! ```text
//! cov(theta) = sigma^2 (J' M J)^-1 (J' M V M J) (J' M J)^-1 = sigma^2 C G'G C,   G = L' M J,   V = L L'
//! ```
//! and `G` is the transposed colouring filter run backwards over the rows of `M J`.
//!
//! **Cost**: `O(N p (p + q))`, `O(N p)` memory.
//!
//! **Reference**: P. J. Huber, The behavior of maximum likelihood estimates under nonstandard conditions, Proc. 5th
//! Berkeley Symposium 1 (1967) 221-233; H. White, Econometrica 48 (1980) 817-838.

use ct_signals::ArModel;

use crate::{Error, Fit, Rows, Setup, Triangle, marginal, noise_factor::Factor};

/// The uncertainty of a fit whose residual has another colour than its metric.
#[derive(Debug, Clone)]
pub struct Robust {
    /// Standard error of every entry of the vector; `None` for one that is fixed, at a bound, or not determined.
    pub std_errors: Vec<Option<f64>>,
    /// Degrees of freedom of each of them.
    pub freedom: Vec<Option<f64>>,
    /// The noise model of the residual.
    pub noise: ArModel,
}

impl Robust {
    /// Half the width of the interval that holds the truth with probability `level` (0.95, say).
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

/// The uncertainty of a fit under the colour of its own residual, an autoregressive model of order zero to `order`.
///
/// # Errors
/// Where the simulation is not finite at the fit.
pub fn robust(setup: &Setup, fit: &Fit, order: usize) -> Result<Robust, Error> {
    let rows = setup
        .rows(&fit.x)
        .ok_or(Error::NoFiniteStart { starts: 1 })?;
    let noise = marginal::noise(&rows, fit.interior(), order)?;
    let bread = fit.triangle.covariance(fit.interior());
    let sandwich = Sandwich::new(&rows, fit.interior(), &fit.noise, bread);
    let variances = |noise: &ArModel, variance: f64| sandwich.variances(noise, variance);
    let own = variances(&noise, noise.sigma().powi(2)).unwrap_or_default();
    let freedom =
        marginal::freedom(&rows, fit.interior(), &noise, variances).unwrap_or_else(|| {
            vec![fit.samples.saturating_sub(fit.interior().len()).max(1) as f64; own.len()]
        });
    Ok(Robust {
        std_errors: fit.spread(own.into_iter().map(f64::sqrt)),
        freedom: fit.spread(freedom.into_iter()),
        noise,
    })
}

/// `C` and the rows `M J` of the entries that are not at a bound. Rows whose reading is missing have no part in either.
struct Sandwich {
    bread: Option<Vec<Vec<f64>>>,
    lanes: usize,
    /// For each record its rows, zero where missing, and whether each is there.
    records: Vec<(Vec<f64>, Vec<bool>)>,
}

impl Sandwich {
    /// From the rows' columns of these entries and the noise model of the fit, `W`, and `C` over them.
    fn new(rows: &Rows, columns: &[usize], metric: &ArModel, bread: Option<Vec<Vec<f64>>>) -> Self {
        let lanes = columns.len();
        let records = rows
            .records()
            .zip(marginal::observed(rows))
            .map(|(record, observed)| {
                let mut whitener = metric.whitener(lanes);
                let mut own = Vec::with_capacity(observed.len() * lanes);
                for (row, there) in record.chunks_exact(rows.columns).zip(&observed) {
                    let from = own.len();
                    own.extend(columns.iter().map(|&column| row[column]));
                    if *there {
                        whitener.push(&mut own[from..]);
                    } else {
                        whitener.skip();
                    }
                }
                if lanes > 0 {
                    Factor::new(metric, &observed).whiten_transposed(&mut own, lanes);
                }
                (own, observed)
            })
            .collect();
        Self {
            bread,
            lanes,
            records,
        }
    }

    fn variances(&self, noise: &ArModel, variance: f64) -> Option<Vec<f64>> {
        let bread = self.bread.as_ref()?;
        if self.lanes == 0 {
            return Some(Vec::new());
        }
        let mut filling = Triangle::new(self.lanes);
        for (record, observed) in &self.records {
            let mut rows = record.clone();
            Factor::new(noise, observed).colour_transposed(&mut rows, self.lanes);
            for row in rows.chunks_exact(self.lanes) {
                filling.push(row);
            }
        }
        filling.finish();
        Some(
            bread
                .iter()
                .map(|row| {
                    (0..self.lanes)
                        .map(|i| {
                            let sum: f64 = (i..self.lanes).map(|j| filling.at(i, j) * row[j]).sum();
                            sum * sum
                        })
                        .sum::<f64>()
                        * variance
                })
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::marginal::tests::{covariance, rows_with_missing};
    use approx::assert_relative_eq;

    #[test]
    fn agrees_with_dense_algebra_where_rows_are_missing() {
        let (rows, j, _, there) = rows_with_missing();
        let noise = ArModel::from_coefficients(&[0.7, -0.3, 0.2], 1.0).unwrap();
        for metric in [
            ArModel::white(1.0),
            ArModel::from_coefficients(&[0.6, 0.2], 1.0).unwrap(),
        ] {
            let bread = rows.fold(&[0, 1, 2], &metric).covariance(&[0, 1]);
            let ours = Sandwich::new(&rows, &[0, 1], &metric, bread)
                .variances(&noise, 0.5)
                .unwrap();
            let weighted = covariance(&metric, &rows.lengths, &there)
                .try_inverse()
                .unwrap()
                * &j;
            let bread = (j.transpose() * &weighted).try_inverse().unwrap();
            let filling =
                weighted.transpose() * covariance(&noise, &rows.lengths, &there) * &weighted;
            let dense = &bread * filling * &bread * 0.5;
            for (i, ours) in ours.iter().enumerate() {
                assert_relative_eq!(*ours, dense[(i, i)], max_relative = 1e-9);
            }
        }
    }
}
