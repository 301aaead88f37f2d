//! Fits from many starts with a noise model as weighting, estimation of the noise model, and the uncertainty of the parameters.

mod end;
mod prewhitened;
mod starts;

use serde::{Deserialize, Serialize};

use self::end::End;
pub use self::prewhitened::{coloured, moved_by_weighting, noise_of, prewhitened};
pub use self::starts::Start;
use self::starts::{free_bounds, least_cost, minima};
use crate::{
    Error, Noise, Residuals, Stop, Stopping, Triangle, levenberg_marquardt::held,
    prior::free_priors,
};

/// Two results are the same minimum if twice the logarithm of their likelihood ratio is below this.
const SAME_MINIMUM: f64 = 0.1;
/// Largest relative distance of a converged fit from its minimum, in multiples of [`Stopping::cost`].
const UNFINISHED: f64 = 100.0;
/// Evaluations of each of many starts, after which only the best continue, ...
const FIRST_EVALUATIONS: usize = 30;
/// ... those whose cost is at most this multiple of the best one's: about twice its simulation error.
const WORSE: f64 = 4.0;

/// A fit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Fit {
    /// The fitted vector.
    pub x: Vec<f64>,
    /// Cost of the whitened residual: its sum of squares or, for several outputs, [`crate::Squares::cost`] \[output unit squared\].
    pub cost: f64,
    /// Root mean square of the residual at each output, not whitened \[output unit\].
    pub rmse: Vec<f64>,
    /// The noise model used as weighting in the fit. After [`coloured`] its innovations are those of the residual; otherwise those of the
    /// given model.
    pub noise: Noise,
    /// Weights of the rows of each output, in addition to whitening ([`crate::Squares::weights`]).
    pub weights: Vec<f64>,
    /// Minus twice the logarithm of the Gaussian likelihood, maximised over the innovations' variance of each output; priors are included
    /// up to a constant.
    pub deviance: f64,
    /// Number of fitted parameters, including those of the noise.
    pub parameters: usize,
    /// BIC penalty of the parameters, in [`Fit::bic`].
    pub penalty: f64,
    /// Samples of all outputs.
    pub samples: usize,
    /// Samples of each output.
    pub samples_per_output: Vec<usize>,
    /// Number of priors of fitted entries, each of which counts as a sample.
    pub priors: usize,
    /// Number of starts.
    pub starts: usize,
    /// Number of starts that ended in the best minimum.
    pub agree: usize,
    /// Reason why the best fit stopped.
    pub stop: Stop,
    /// The R factor at the minimum.
    pub triangle: Triangle,
    /// Positions (among the fitted entries) of the parameters that are not held at a bound and whose columns are independent.
    interior: Vec<usize>,
    /// Groups of positions of parameters that can be changed together without a change of the residual.
    undetermined: Vec<Vec<usize>>,
    free: Vec<usize>,
    /// Degrees of freedom of the variance of every interior entry.
    freedom: Vec<f64>,
    /// See [`Squares::prior_weight`].
    prior_weight: f64,
    /// See [`Squares::of_samples`].
    of_samples: f64,
}
impl Fit {
    /// Whether two fits of one model with the same weighting ended in the same minimum.
    #[must_use]
    pub fn same_minimum(&self, other: &Self) -> bool {
        self.samples as f64 * (self.cost / other.cost).ln().abs() <= SAME_MINIMUM
            || self.cost == other.cost
    }

    /// The better of this fit and another one of the same model with the same weighting from other starts. The numbers of starts are added;
    /// starts of both count as agreed if both ended in the same minimum.
    #[must_use]
    pub fn or_better(self, other: Self) -> Self {
        let starts = self.starts + other.starts;
        let agree = self
            .same_minimum(&other)
            .then_some(self.agree + other.agree);
        let mut best = if other.cost < self.cost { other } else { self };
        best.starts = starts;
        best.agree = agree.unwrap_or(best.agree);
        best
    }

    /// The same fit; its number of starts includes those of the fit that it continues.
    #[must_use]
    pub fn continuing(mut self, first: &Self) -> Self {
        self.starts = first.starts;
        self.agree = first.agree;
        self
    }

    /// [`Fit::rmse`] of a single output; for several their geometric mean, weighted by samples, which does not depend on units.
    #[must_use]
    pub fn mean_rmse(&self) -> f64 {
        if let [only] = self.rmse[..] {
            return only;
        }
        let outputs = self.rmse.iter().zip(&self.samples_per_output);
        let sum: f64 = outputs
            .map(|(rmse, &samples)| samples as f64 * rmse.max(f64::MIN_POSITIVE).ln())
            .sum();
        (sum / self.samples.max(1) as f64).exp()
    }

    /// Bayesian information criterion: smaller is better.
    #[must_use]
    pub fn bic(&self) -> f64 {
        self.deviance + self.penalty
    }

    /// Variance of the innovations, with the degrees of freedom of the residual.
    #[must_use]
    pub fn variance(&self) -> f64 {
        self.of_samples / self.degrees_left()
    }

    /// Samples and priors, less the fitted entries.
    pub(crate) fn degrees_left(&self) -> f64 {
        let rows = self.samples + self.priors;
        rows.saturating_sub(self.free.len()).max(1) as f64
    }

    /// Weight of the rows of priors in the fit ([`crate::Squares::prior_weight`]).
    #[must_use]
    pub fn prior_weight(&self) -> f64 {
        self.prior_weight
    }

    /// Standard deviation of the innovations at each output, by [`Fit::variance`].
    #[must_use]
    pub fn scales(&self) -> Vec<f64> {
        let sigma = self.variance().sqrt();
        self.weights.iter().map(|weight| sigma / weight).collect()
    }

    /// Standard error of every entry of the vector; `None` for one that is fixed, held at a bound, or not determined.
    #[must_use]
    pub fn std_errors(&self) -> Vec<Option<f64>> {
        let Some(covariance) = self.triangle.covariance(&self.interior) else {
            return vec![None; self.x.len()];
        };
        let variance = self.variance();
        self.spread((0..self.interior.len()).map(|i| (covariance[i][i] * variance).sqrt()))
    }

    /// Values of the columns of [`Self::interior`] in the places of their entries of the vector; `None` for the entries that are fixed, held at
    /// a bound, or not determined.
    #[must_use]
    pub fn spread(&self, values: impl Iterator<Item = f64>) -> Vec<Option<f64>> {
        let mut all = vec![None; self.x.len()];
        let values: Vec<f64> = values.collect();
        for i in self.determined() {
            all[self.free[self.interior[i]]] = values.get(i).copied();
        }
        all
    }

    /// Whether the rows determine every parameter that is not held at a bound and has an influence on them. If not, some parameters may be
    /// changed together without a change of the residual, and a prediction outside the fitted rows has no standard error.
    #[must_use]
    pub fn is_determined(&self) -> bool {
        self.undetermined.is_empty()
    }

    /// Groups of entries of the vector that can be changed together without a change of the residual.
    #[must_use]
    pub fn undetermined(&self) -> Vec<Vec<usize>> {
        let entries = |group: &Vec<usize>| group.iter().map(|&column| self.free[column]).collect();
        self.undetermined.iter().map(entries).collect()
    }

    /// Positions in [`Self::interior`] of the parameters that the rows determine.
    #[must_use]
    pub fn determined(&self) -> Vec<usize> {
        (0..self.interior.len())
            .filter(|&i| {
                !self
                    .undetermined
                    .iter()
                    .flatten()
                    .any(|&column| column == self.interior[i])
            })
            .collect()
    }

    /// Columns of the R factor that are independent and whose parameters are not at a bound.
    #[must_use]
    pub fn interior(&self) -> &[usize] {
        &self.interior
    }

    /// Degrees of freedom of every standard error, for the quantile of Student's distribution. An estimated noise model reduces them.
    #[must_use]
    pub fn freedom(&self) -> Vec<Option<f64>> {
        self.spread(self.freedom.iter().copied())
    }

    /// Half the width of the interval that contains the true value with probability `level` (0.95, say), for every entry that has a
    /// standard error.
    #[must_use]
    pub fn half_widths(&self, level: f64) -> Vec<Option<f64>> {
        self.std_errors()
            .into_iter()
            .zip(self.freedom())
            .map(|(error, freedom)| Some(error? * ct_signals::student_half_width(level, freedom?)))
            .collect()
    }

    /// Correlations between the entries that have a standard error: their positions and the matrix.
    #[must_use]
    pub fn correlations(&self) -> Option<(Vec<usize>, Vec<Vec<f64>>)> {
        let covariance = self.triangle.covariance(&self.interior)?;
        let determined = self.determined();
        let correlation =
            |i: usize, j: usize| covariance[i][j] / (covariance[i][i] * covariance[j][j]).sqrt();
        let of_row = |&i: &usize| determined.iter().map(|&j| correlation(i, j)).collect();
        let entry = |&i: &usize| self.free[self.interior[i]];
        Some((
            determined.iter().map(entry).collect(),
            determined.iter().map(of_row).collect(),
        ))
    }
}

/// [`fit_from`], but after 30 evaluations only the starts whose cost is at most four times the best continue: a start far from any minimum
/// would use all evaluations, and seldom end in the best one.
///
/// # Errors
/// As [`fit_from`].
pub fn fit_from_best(
    model: &impl Residuals,
    starts: Vec<Start>,
    noise: &Noise,
    stopping: Stopping,
) -> Result<Fit, Error> {
    let count = starts.len();
    if count < 2 || stopping.evaluations <= FIRST_EVALUATIONS {
        return fit_from(model, starts, noise, stopping);
    }
    let first = Stopping {
        evaluations: FIRST_EVALUATIONS,
        ..stopping
    };
    let mut ends = minima(model, starts, noise, first);
    // After the time limit a fit uses only its first start, which has to be the best.
    ends.sort_by(|a, b| a.1.triangle.cost().total_cmp(&b.1.triangle.cost()));
    let most = WORSE * least_cost(&ends);
    let near = ends.into_iter().filter_map(|(x, minimum)| {
        let triangle = minimum.triangle;
        (triangle.cost() <= most).then_some(Start {
            x,
            triangle: Some(triangle),
        })
    });
    let near: Vec<Start> = near.collect();
    if near.is_empty() {
        return Err(Error::NoFiniteStart { starts: count });
    }
    let rest = Stopping {
        evaluations: stopping.evaluations - FIRST_EVALUATIONS,
        ..stopping
    };
    let mut fit = fit_from(model, near, noise, rest)?;
    fit.starts = count;
    Ok(fit)
}

/// Fits from the given starts, in parallel, with the AR coefficients of a given noise model as weighting. Returns the best fit, and the
/// number of starts that agree with it.
///
/// # Errors
/// Where the model is not finite at any start.
pub fn fit_from(
    model: &impl Residuals,
    starts: Vec<Start>,
    noise: &Noise,
    stopping: Stopping,
) -> Result<Fit, Error> {
    let count = starts.len();
    let minima = minima(model, starts, noise, stopping);
    let best = least_cost(&minima);
    // Results with nearly equal likelihood, or that more evaluations would make equal, count as one minimum.
    let samples: usize = model.samples().iter().sum();
    let same = best
        * (SAME_MINIMUM / samples as f64)
            .max(UNFINISHED * stopping.cost)
            .exp();
    let agree = minima
        .iter()
        .filter(|(_, minimum)| minimum.triangle.cost() <= same)
        .count();
    let (x, minimum) = minima
        .into_iter()
        .find(|(_, minimum)| minimum.triangle.cost() <= best)
        .ok_or(Error::NoFiniteStart { starts: count })?;
    let free = model.free();
    let bounds = free_bounds(model);
    let inside: Vec<usize> = (0..free.len())
        .filter(|&j| {
            // A parameter without influence on any sample has no standard error, such as the initial state of a lag with time constant
            // zero.
            minimum.triangle.column_norm(j) > 0.0
                && !held(minimum.x[j], bounds[j], minimum.triangle.descent(j))
        })
        .collect();
    let cost = minimum.triangle.cost();
    let n = samples as f64;
    let end = End::of(model, &x, noise).ok_or(Error::NoFiniteStart { starts: count })?;
    let mut fit = Fit {
        x,
        cost,
        rmse: end.rmse,
        noise: noise.clone(),
        weights: end.weights,
        deviance: n * (1.0 + (std::f64::consts::TAU * (cost / n).max(f64::MIN_POSITIVE)).ln())
            + end.log_det,
        parameters: free.len() + model.samples().len() + noise.order(),
        penalty: model.bic_penalty(noise.order()),
        samples,
        samples_per_output: model.samples().to_vec(),
        priors: free_priors(model).count(),
        prior_weight: end.prior_weight,
        of_samples: end.of_samples,
        starts: count,
        agree,
        stop: minimum.stop,
        triangle: minimum.triangle,
        freedom: Vec::new(),
        undetermined: Vec::new(),
        interior: Vec::new(),
        free: free.to_vec(),
    };
    // Covariances are multiplied by this variance: weighting the priors by its root preserves their standard errors.
    let sigma = fit.variance().sqrt();
    fit.triangle = fit.triangle.with_prior_weight(sigma);
    (fit.interior, fit.undetermined) = fit.triangle.independent_among(&inside);
    fit.freedom = vec![fit.degrees_left(); fit.interior.len()];
    Ok(fit)
}
