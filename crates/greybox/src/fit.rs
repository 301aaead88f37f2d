//! Fits from many starts, the noise's colour, and the uncertainty of what was fitted.

use ct_signals::ArModel;
use rayon::prelude::*;

use crate::{
    Error, Setup, Stop, Stopping, Triangle,
    levenberg_marquardt::{held, minimise, within},
    marginal, random_starts,
    starts::extend_levels,
};

/// Two ends are one minimum where twice the logarithm of their likelihood ratio is below this.
const SAME_MINIMUM: f64 = 0.1;

/// How to fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// How many random starts.
    pub starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// Largest order of the noise model that is tried; zero takes the noise for white.
    pub noise_order: usize,
    /// When to stop.
    pub stopping: Stopping,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            starts: 12,
            seed: 1,
            noise_order: 6,
            stopping: Stopping {
                evaluations: 120,
                cost: 1e-9,
            },
        }
    }
}

/// A fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The fitted vector: parameters, then initial levels.
    pub x: Vec<f64>,
    /// Sum of squares of the whitened residual \[output unit squared\].
    pub cost: f64,
    /// Root mean square of the simulation error \[output unit\].
    pub rmse: f64,
    /// The noise in whose metric it was fitted. After [`coloured`] its innovations are those of the residual; in a
    /// metric that was given they are as they were given.
    pub noise: ArModel,
    /// Minus twice the logarithm of the Gaussian likelihood, the innovations' variance at its best.
    pub deviance: f64,
    /// Fitted numbers, those of the noise included.
    pub parameters: usize,
    /// What they cost in [`Fit::bic`].
    pub price: f64,
    /// Samples.
    pub samples: usize,
    /// How many starts were tried.
    pub starts: usize,
    /// How many of them ended in the best minimum.
    pub agree: usize,
    /// Why the best one stopped.
    pub stop: Stop,
    /// The folded rows at the minimum.
    pub triangle: Triangle,
    /// Positions (among the fitted entries) that the gradient does not hold at a bound.
    interior: Vec<usize>,
    free: Vec<usize>,
    /// Degrees of freedom of the variance of every interior entry.
    freedom: Vec<f64>,
}

impl Fit {
    /// Whether two fits of one setup in one metric ended in the same minimum.
    #[must_use]
    pub fn same_minimum(&self, other: &Self) -> bool {
        self.samples as f64 * (self.cost / other.cost).ln().abs() <= SAME_MINIMUM
            || self.cost == other.cost
    }

    /// The better of this fit and one of the same setup in the same metric from other starts. Starts are counted
    /// together; those of both count as agreed where both ended in the same minimum.
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

    /// The same fit, with the starts counted of the one it continues.
    #[must_use]
    pub fn continuing(mut self, first: &Self) -> Self {
        self.starts = first.starts;
        self.agree = first.agree;
        self
    }

    /// Bayesian information criterion: smaller is better.
    #[must_use]
    pub fn bic(&self) -> f64 {
        self.deviance + self.price
    }

    /// Variance of the innovations, with the degrees of freedom that are left.
    #[must_use]
    pub fn variance(&self) -> f64 {
        self.cost / (self.samples.saturating_sub(self.free.len())).max(1) as f64
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

    /// Values of the entries that are not at a bound, in their places of the vector.
    pub(crate) fn spread(&self, values: impl Iterator<Item = f64>) -> Vec<Option<f64>> {
        let mut all = vec![None; self.x.len()];
        for (&column, value) in self.interior.iter().zip(values) {
            all[self.free[column]] = Some(value);
        }
        all
    }

    /// Columns of the triangle whose entries are not at a bound.
    pub(crate) fn interior(&self) -> &[usize] {
        &self.interior
    }

    /// Degrees of freedom of every standard error: the quantile of Student's distribution with as many makes an
    /// interval of it. A noise model that was estimated with the fit leaves fewer than the samples do.
    #[must_use]
    pub fn freedom(&self) -> Vec<Option<f64>> {
        self.spread(self.freedom.iter().copied())
    }

    /// Half the width of the interval that holds the truth with probability `level` (0.95, say), for every entry that
    /// has a standard error.
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
        let matrix = covariance
            .iter()
            .enumerate()
            .map(|(i, row)| {
                row.iter()
                    .enumerate()
                    .map(|(j, c)| c / (covariance[i][i] * covariance[j][j]).sqrt())
                    .collect()
            })
            .collect();
        Some((
            self.interior
                .iter()
                .map(|&column| self.free[column])
                .collect(),
            matrix,
        ))
    }
}

/// Fits from random starts, with the noise's colour estimated.
///
/// # Errors
/// Where no start gives a finite simulation.
pub fn fit(setup: &Setup, options: &FitOptions) -> Result<Fit, Error> {
    let starts = random_starts(setup, options.starts.max(1), options.seed);
    let white = fit_from(setup, &starts, &ArModel::white(1.0), options.stopping)?;
    coloured(setup, white, options.noise_order, options.stopping)
}

/// Fits from the given starts in the metric of a given noise; white noise is `ArModel::white(1.0)`.
///
/// # Errors
/// Where no start gives a finite simulation.
pub fn fit_from(
    setup: &Setup,
    starts: &[Vec<f64>],
    noise: &ArModel,
    stopping: Stopping,
) -> Result<Fit, Error> {
    let starts = starts.iter().cloned().map(Start::from).collect();
    fit_onward(setup, starts, noise, stopping)
}

/// Where a fit begins.
#[derive(Debug, Clone)]
pub struct Start {
    /// The vector.
    pub x: Vec<f64>,
    /// What [`Setup::linearise`] gives there in the metric of the fit, where it is known: it is not simulated again.
    pub triangle: Option<Triangle>,
}

impl From<Vec<f64>> for Start {
    fn from(x: Vec<f64>) -> Self {
        Self { x, triangle: None }
    }
}

impl Start {
    /// Where a fit of the same setup ended, for one in the metric of a given noise.
    #[must_use]
    pub fn at_end(fit: &Fit, noise: &ArModel) -> Self {
        // White noise leaves the rows as they are, whatever its size.
        let same_metric = fit.noise == *noise || fit.noise.order() + noise.order() == 0;
        Self {
            x: fit.x.clone(),
            triangle: same_metric.then(|| fit.triangle.clone()),
        }
    }
}

/// As [`fit_from`], from starts of which more may be known.
///
/// # Errors
/// As [`fit_from`].
pub fn fit_onward(
    setup: &Setup,
    starts: Vec<Start>,
    noise: &ArModel,
    stopping: Stopping,
) -> Result<Fit, Error> {
    let free = setup.free();
    let bounds: Vec<(f64, f64)> = free.iter().map(|&i| setup.bounds()[i]).collect();
    let count = starts.len();
    let minima: Vec<_> = starts
        .into_par_iter()
        .enumerate()
        .filter_map(|(k, Start { x: given, triangle })| {
            // Out of time a fit still needs one start.
            if k > 0 && setup.out_of_time() {
                return None;
            }
            let mut start = given.clone();
            setup.impose_fixed(&mut start);
            for (&i, bounds) in free.iter().zip(&bounds) {
                start[i] = within(start[i], *bounds);
            }
            let known = triangle.filter(|_| start == given);
            let full = |x: &[f64]| {
                let mut full = start.clone();
                for (&i, value) in free.iter().zip(x) {
                    full[i] = *value;
                }
                full
            };
            let x: Vec<f64> = free.iter().map(|&i| start[i]).collect();
            let minimum = minimise(
                x,
                known,
                &bounds,
                stopping,
                |x, limit| setup.linearise_below(&full(x), noise, limit),
                |x, limit| setup.costs_more(&full(x), noise, limit),
                || setup.out_of_time(),
            );
            Some((full(&minimum.x), minimum))
        })
        .filter(|(_, minimum)| minimum.stop != Stop::NotFinite)
        .collect();
    if setup.stopped() {
        return Err(Error::Stopped);
    }
    let best = minima
        .iter()
        .map(|(_, minimum)| minimum.triangle.cost())
        .fold(f64::INFINITY, f64::min);
    // Ends that the likelihood can hardly tell apart are one minimum.
    let same = best * (SAME_MINIMUM / setup.samples() as f64).exp();
    let agree = minima
        .iter()
        .filter(|(_, minimum)| minimum.triangle.cost() <= same)
        .count();
    let (x, minimum) = minima
        .into_iter()
        .find(|(_, minimum)| minimum.triangle.cost() <= best)
        .ok_or(Error::NoFiniteStart { starts: count })?;
    let interior: Vec<usize> = (0..free.len())
        .filter(|&j| {
            // What no sample speaks of has no error: the state behind a lag that is zero.
            minimum.triangle.column_norm(j) > 0.0
                && !held(minimum.x[j], bounds[j], minimum.triangle.descent(j))
        })
        .collect();
    let samples = setup.samples();
    let cost = minimum.triangle.cost();
    let n = samples as f64;
    let log_det: f64 = setup
        .records
        .iter()
        .map(|record| noise.log_det_of(record.outputs[0].values.iter().map(|y| !y.is_nan())))
        .sum();
    let residuals = setup.residuals(&x)?;
    let observed = residuals.iter().flatten().filter(|r| !r.is_nan());
    let squares: f64 = observed.map(|r| r * r).sum();
    Ok(Fit {
        x,
        cost,
        rmse: (squares / n).sqrt(),
        noise: noise.clone(),
        deviance: n * (1.0 + (std::f64::consts::TAU * (cost / n).max(f64::MIN_POSITIVE)).ln())
            + log_det,
        parameters: free.len() + 1 + noise.order(),
        price: setup.price(noise.order()),
        samples,
        starts: count,
        agree,
        stop: minimum.stop,
        triangle: minimum.triangle,
        freedom: vec![samples.saturating_sub(free.len()).max(1) as f64; interior.len()],
        interior,
        free: free.to_vec(),
    })
}

/// Estimates the noise's colour from a fit's residual and refits in that metric, until the two agree.
///
/// # Errors
/// As [`fit_from`].
pub fn coloured(setup: &Setup, fit: Fit, order: usize, stopping: Stopping) -> Result<Fit, Error> {
    let (starts, agree) = (fit.starts, fit.agree);
    let mut fit = prewhitened(setup, fit, order, None, stopping)?;
    // The likelihood, by which models are compared, is at its best now; the errors follow from the colour that
    // the fit has not bent.
    if fit.noise.order() > 0 {
        let (deviance, parameters, price) = (fit.deviance, fit.parameters, fit.price);
        let noise = noise_of(setup, &fit, order)?;
        fit = fit_from(setup, std::slice::from_ref(&fit.x), &noise, stopping)?;
        // A likelihood is paid for with the coefficients that it had.
        (fit.deviance, fit.parameters, fit.price) = (deviance, parameters, price);
        if let Some(rows) = setup.rows(&fit.x) {
            let own: Vec<usize> = (0..fit.interior.len()).collect();
            let mut order = fit.interior.clone();
            order.push(rows.columns - 1);
            let variances = |noise: &ArModel, variance: f64| {
                let covariance = rows.fold(&order, noise).covariance(&own)?;
                Some(own.iter().map(|&i| covariance[i][i] * variance).collect())
            };
            if let Some(freedom) = marginal::freedom(&rows, &fit.interior, &fit.noise, variances) {
                fit.freedom = freedom;
            }
        }
    } else {
        // A white metric's scale plays no part in a fit, and may stand for any: here it becomes the noise's own.
        fit.noise = ArModel::white(fit.variance().sqrt());
    }
    fit.starts = starts;
    fit.agree = agree;
    Ok(fit)
}

/// The prewhitened fit (iterated GLS): an autoregressive noise model of order zero to `order` from the residual, a fit in its
/// weighting, until the two agree. `memory`: the noise model's memory is at most so many samples, so that no root near one takes
/// slow physics for noise ([`ArModel::with_memory_at_most`]).
///
/// # Errors
/// As [`fit_from`].
pub fn prewhitened(
    setup: &Setup,
    fit: Fit,
    order: usize,
    memory: Option<f64>,
    stopping: Stopping,
) -> Result<Fit, Error> {
    let mut fit = fit;
    for _ in 0..8 {
        let residuals = setup.disturbance(&fit.x)?;
        let segments: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        let mut noise = ArModel::fit(&segments, order)?;
        if let Some(memory) = memory {
            noise = noise.with_memory_at_most(memory);
        }
        let same = noise.order() == fit.noise.order()
            && noise
                .coefficients()
                .iter()
                .zip(fit.noise.coefficients())
                .all(|(a, b)| (a - b).abs() < 1e-4);
        if same {
            break;
        }
        let next = fit_from(setup, std::slice::from_ref(&fit.x), &noise, stopping)?;
        let settled = fit.noise.order() > 0 && (next.deviance - fit.deviance).abs() < 1e-3;
        fit = next;
        if settled {
            break;
        }
    }
    Ok(fit)
}

/// The noise model of a fit's residual, of order zero to `order`, without the bias that fitting leaves in it.
///
/// # Errors
/// Where the simulation is not finite.
pub fn noise_of(setup: &Setup, fit: &Fit, order: usize) -> Result<ArModel, Error> {
    let rows = setup
        .rows(&fit.x)
        .ok_or(Error::NoFiniteStart { starts: 1 })?;
    marginal::noise(&rows, &fit.interior, order)
}

/// The initial levels that fit best with every parameter frozen; `parameters` are the vector's entries before the levels.
///
/// # Errors
/// As [`fit_from`].
pub fn fit_initial_levels(
    setup: &Setup,
    parameters: &[f64],
    stopping: Stopping,
) -> Result<Vec<f64>, Error> {
    let mut frozen = setup.clone();
    frozen.freeze_parameters();
    let mut x = parameters.to_vec();
    extend_levels(setup, &mut x);
    // The upper level may be far from rest: a few starts around it.
    let starts: Vec<Vec<f64>> = [1.0, 0.25, 4.0]
        .into_iter()
        .map(|factor| {
            let mut start = x.clone();
            if setup.structure.plant.vessels() > 1 {
                for level in start[parameters.len()..].iter_mut().step_by(setup.states()) {
                    *level *= factor;
                }
            }
            start
        })
        .collect();
    Ok(fit_from(&frozen, &starts, &ArModel::white(1.0), stopping)?.x)
}
