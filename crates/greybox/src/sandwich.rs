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
    let sandwich = Sandwich::new(&rows, fit);
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

/// `C` and the rows `M J` of the entries that are not at a bound.
struct Sandwich {
    bread: Option<Vec<Vec<f64>>>,
    lanes: usize,
    records: Vec<Vec<f64>>,
}

impl Sandwich {
    fn new(rows: &Rows, fit: &Fit) -> Self {
        let lanes = fit.interior().len();
        let factor = Factor::new(&fit.noise);
        let records = rows
            .records()
            .map(|record| {
                let mut whitener = fit.noise.whitener(lanes);
                let mut own = Vec::with_capacity(record.len() / rows.columns * lanes);
                for row in record.chunks_exact(rows.columns) {
                    let from = own.len();
                    own.extend(fit.interior().iter().map(|&column| row[column]));
                    whitener.push(&mut own[from..]);
                }
                if lanes > 0 {
                    factor.whiten_transposed(&mut own, lanes);
                }
                own
            })
            .collect();
        Self {
            bread: fit.triangle.covariance(fit.interior()),
            lanes,
            records,
        }
    }

    fn variances(&self, noise: &ArModel, variance: f64) -> Option<Vec<f64>> {
        let bread = self.bread.as_ref()?;
        if self.lanes == 0 {
            return Some(Vec::new());
        }
        let factor = Factor::new(noise);
        let mut filling = Triangle::new(self.lanes);
        for record in &self.records {
            let mut rows = record.clone();
            factor.colour_transposed(&mut rows, self.lanes);
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
