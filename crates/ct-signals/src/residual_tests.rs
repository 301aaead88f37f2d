//! Tests of a residual: whiteness, and correlation with the input.
//!
//! Both tests give a probability `p`: how often a residual that is pure noise would look at least
//! this far from it. Below 0.01, say, the residual is not noise.
//!
//! **Missing samples**: NaN. Means, sums and counts are then over the available samples and pairs of samples. In a
//! white Gaussian series of `n` samples with `n_k` pairs at lag k,
//! `E[(sum x[t] x[t+k])^2] = n_k (sum x^2)^2/(n (n+2))` whatever the pattern (to the mean's removal): `n_k` takes the place of
//! `n - k` in the sums below. Lags with fewer than 5 pairs do not count, nor as degrees of freedom.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::ar::check_not_infinite;
use crate::{ArModel, Error};

/// Highest order of the filters that whiten the input and the residual.
const MAX_PREWHITENING_ORDER: usize = 20;

/// With missing samples, lags with fewer pairs are not used: their products are far from Gaussian.
const FEWEST_PAIRS: usize = 5;

const LJUNG_BOX: &str = "Ljung-Box test";

/// Lags of an input count as distinct where the eigenvalues of their correlations are above this.
const DISTINCT: f64 = 1e-8;

/// Autocorrelation of `x`, mean removed, at lags `0..=max_lag`; 1 at lag 0.
///
/// 0 at lags that the record is too short for, and at all lags above 0 when `x` does not vary. Missing samples (NaN) as in
/// [`cross_correlation`].
pub fn autocorrelation(x: &[f64], max_lag: usize) -> Vec<f64> {
    let mut correlation = cross_correlation(x, x, max_lag);
    correlation[0] = 1.0;
    correlation
}

/// Correlation of `u[k]` with `e[k + lag]`, means removed, at lags `0..=max_lag`: `u` leads, so the effect of an input on a residual is
/// visible at lags above 0.
///
/// The sum at each lag is divided by the number of samples, as is usual, which keeps values within
/// -1..1. 0 at lags that the record is too short for, and at all when one of the two does not vary.
/// Of two series of different lengths the end of the longer is left out.
///
/// Where samples are missing (NaN) it is, at each lag, the correlation over the available pairs, times `(N - lag)/N` for the series'
/// length `N`, as for a complete series. Its standard deviation is then about `(N - lag)/N` over the root of the number of
/// [`pairs`], for white series.
pub fn cross_correlation(u: &[f64], e: &[f64], max_lag: usize) -> Vec<f64> {
    let n = u.len().min(e.len());
    let (u, e) = (centred(&u[..n]), centred(&e[..n]));
    if has_missing(&u) || has_missing(&e) {
        let at = |lag: usize| {
            let sums = Pairs::at(&u, &e, lag);
            let scale = (sums.of_u * sums.of_e).sqrt();
            if scale > 0.0 {
                sums.product / scale * (n - lag) as f64 / n as f64
            } else {
                0.0
            }
        };
        return (0..=max_lag).map(at).collect();
    }
    let scale = (sum_of_products(&u, &u) * sum_of_products(&e, &e)).sqrt();
    (0..=max_lag)
        .map(|lag| {
            if scale > 0.0 && lag < n {
                sum_of_products(&u, &e[lag..]) / scale
            } else {
                0.0
            }
        })
        .collect()
}

/// Number of pairs `u[k]`, `e[k + lag]` at lags `0..=max_lag`: `n - lag` if no sample is missing (NaN).
pub fn pairs(u: &[f64], e: &[f64], max_lag: usize) -> Vec<usize> {
    let n = u.len().min(e.len());
    let (u, e) = (&u[..n], &e[..n]);
    (0..=max_lag)
        .map(|lag| {
            let pairs = u.iter().zip(e.iter().skip(lag));
            pairs.filter(|(u, e)| !u.is_nan() && !e.is_nan()).count()
        })
        .collect()
}

/// Whether `x` is white (Ljung and Box): the probability `p` under that hypothesis.
///
/// `Q = n (n+2) sum_{k=1}^{lags} rho_k^2/(n-k)` is chi-square with `lags - fitted` degrees of
/// freedom, `fitted` the number of coefficients of a noise model that made `x` white (0 for the
/// residual of a simulation). `lags`: about 20, and at most a quarter of the samples.
///
/// Reference: G. M. Ljung, G. E. P. Box, *On a measure of lack of fit in time series models*,
/// Biometrika 65 (1978) 297-303.
///
/// Missing samples are NaN: `n` counts the available samples, and `rho_k` is the sum over the available pairs over that of all
/// squares. Where `x` is a whitened series, its innovations after a gap count like any others.
///
/// # Errors
/// [`Error::InvalidSetting`] unless `fitted < lags`, [`Error::TooFewSamples`] unless there are more
/// samples than lags and more lags with pairs than `fitted`, [`Error::ValueNotFinite`] for an infinite value.
pub fn ljung_box(x: &[f64], lags: usize, fitted: usize) -> Result<f64, Error> {
    if fitted >= lags {
        return Err(Error::InvalidSetting {
            setting: "lags",
            value: lags.to_string(),
            range: format!("more than the {fitted} fitted noise coefficients"),
        });
    }
    check_length(LJUNG_BOX, present(x), lags)?;
    check_not_infinite(LJUNG_BOX, "x", x)?;
    if has_missing(x) {
        return ljung_box_of_pairs(&centred(x), lags, fitted);
    }
    portmanteau(x.len(), &autocorrelation(x, lags)[1..], lags - fitted)
}

/// Whether the residual `e` is independent of the input's past: the correlation at lags `0..=lags`
/// and the probability `p` of lags `1..=lags` under that hypothesis.
///
/// The correlation of two smooth signals is large by chance alone, so both are first made white, each by an autoregressive filter fitted to
/// it (Haugh's test). The order is at most 20, by BIC, and 0 for a residual that is white already. The share of `e` that its regression on
/// `u` at lags `1..=lags` explains, times `n`, is then chi-square with as many degrees of freedom as lags are distinct. Haugh's sum of
/// squared correlations is the same where `u` is white; a filter leaves the moves of an input that steps at regular times periodic, and its
/// correlations at lags a period apart are then one and the same.
///
/// Lag 0 is reported but does not count: `y[k]` is read before `u[k]` acts, so the input cannot
/// show there, while a controller that reads `y[k]` can.
///
/// Missing samples of either are NaN. The filters are then those of [`ArModel::fit`] and [`ArModel::whiten`] for such series; rows that `e`
/// lacks do not count, and a missing sample of `u` is its mean.
///
/// Reference: L. D. Haugh, *Checking the independence of two covariance-stationary time series*,
/// J. American Statistical Association 71 (1976) 378-385.
///
/// # Errors
/// [`Error::SeriesMismatch`], [`Error::TooFewSamples`] unless there are more samples than lags,
/// [`Error::InvalidSetting`] when `lags` is 0, [`Error::ValueNotFinite`] for an infinite value.
pub fn prewhitened_input_test(u: &[f64], e: &[f64], lags: usize) -> Result<(Vec<f64>, f64), Error> {
    const TASK: &str = "correlation with the input";
    if u.len() != e.len() {
        return Err(Error::SeriesMismatch {
            task: TASK,
            first: u.len(),
            second: e.len(),
        });
    }
    if lags == 0 {
        return Err(Error::InvalidSetting {
            setting: "lags",
            value: "0".into(),
            range: "at least 1".into(),
        });
    }
    check_length(TASK, present(u).min(present(e)), lags)?;
    check_not_infinite(TASK, "u", u)?;
    check_not_infinite(TASK, "e", e)?;
    let (u, e) = (whitened(u)?, whitened(e)?);
    let correlation = cross_correlation(&u, &e, lags);
    Ok((correlation, regression_on_lags(TASK, &u, &e, lags)?))
}

/// p-value of the regression of a white `e` on `u` at lags `1..=lags`. Missing samples of `u` are replaced by its mean; rows without `e`
/// are not used.
fn regression_on_lags(task: &'static str, u: &[f64], e: &[f64], lags: usize) -> Result<f64, Error> {
    let (u, e) = (centred(u), centred(e));
    let counted: Vec<usize> = (1..=lags)
        .filter(|&lag| Pairs::at(&u, &e, lag).count >= FEWEST_PAIRS)
        .collect();
    if counted.is_empty() {
        return Err(Error::TooFewSamples {
            task,
            found: present(&u).min(present(&e)),
            needed: 2 * FEWEST_PAIRS,
        });
    }
    let rows = (0..e.len()).filter(|&t| !e[t].is_nan());
    let regressors: Vec<Vec<f64>> = counted
        .iter()
        .map(|&lag| {
            let at = |t: usize| t.checked_sub(lag).map_or(0.0, |before| u[before]);
            let column: Vec<f64> = rows
                .clone()
                .map(|t| Some(at(t)).filter(|u| !u.is_nan()).unwrap_or(0.0))
                .collect();
            let size = sum_of_products(&column, &column).sqrt();
            let scale = if size > 0.0 { 1.0 / size } else { 0.0 };
            column.iter().map(|u| u * scale).collect()
        })
        .collect();
    let e: Vec<f64> = rows.clone().map(|t| e[t]).collect();
    let squares = sum_of_products(&e, &e);
    let n = counted.len();
    let gram = DMatrix::from_fn(n, n, |i, j| sum_of_products(&regressors[i], &regressors[j]));
    let moment = DVector::from_fn(n, |i, _| sum_of_products(&regressors[i], &e));
    let parts = gram.symmetric_eigen();
    let (mut explained, mut rank) = (0.0, 0);
    for (i, &size) in parts.eigenvalues.iter().enumerate() {
        if size > DISTINCT {
            explained += parts.eigenvectors.column(i).dot(&moment).powi(2) / size;
            rank += 1;
        }
    }
    if rank == 0 || squares <= 0.0 {
        // A constant series has no correlation with any series.
        return Ok(1.0);
    }
    exceedance(e.len() as f64 * explained / squares, rank)
}

fn whitened(x: &[f64]) -> Result<Vec<f64>, Error> {
    let x = centred(x);
    Ok(ArModel::fit(&[&x], MAX_PREWHITENING_ORDER)?.whiten(&x))
}

/// The probability of correlations this large at lags 1, 2, ... between independent series of `n`.
fn portmanteau(n: usize, correlation: &[f64], freedom: usize) -> Result<f64, Error> {
    let n = n as f64;
    let q: f64 = correlation
        .iter()
        .enumerate()
        .map(|(k, r)| n * (n + 2.0) * r * r / (n - (k + 1) as f64))
        .sum();
    exceedance(q, freedom)
}

/// The test of a series whose mean is removed, from the available pairs at lags `1..=lags`.
fn ljung_box_of_pairs(x: &[f64], lags: usize, fitted: usize) -> Result<f64, Error> {
    let n = present(x) as f64;
    let squares: f64 = x.iter().filter(|x| !x.is_nan()).map(|x| x * x).sum();
    let term = |sums: Pairs| {
        let rho = sums.product / squares;
        let term = n * (n + 2.0) * rho * rho / sums.count as f64;
        // A series that does not vary is correlated with nothing.
        if term.is_finite() { term } else { 0.0 }
    };
    let counted: Vec<f64> = (1..=lags)
        .map(|lag| Pairs::at(x, x, lag))
        .filter(|sums| sums.count >= FEWEST_PAIRS)
        .map(term)
        .collect();
    if counted.len() <= fitted {
        return Err(Error::TooFewSamples {
            task: LJUNG_BOX,
            found: present(x),
            needed: 2 * FEWEST_PAIRS * (fitted + 1),
        });
    }
    exceedance(counted.iter().sum(), counted.len() - fitted)
}

/// The probability that a chi-square variable with `freedom` degrees of freedom is above `q`.
fn exceedance(q: f64, freedom: usize) -> Result<f64, Error> {
    ChiSquared::new(freedom as f64)
        .map(|chi_square| chi_square.sf(q))
        .map_err(|_| Error::InvalidSetting {
            setting: "degrees of freedom",
            value: freedom.to_string(),
            range: "at least 1".into(),
        })
}

fn check_length(task: &'static str, n: usize, lags: usize) -> Result<(), Error> {
    if n > lags {
        return Ok(());
    }
    Err(Error::TooFewSamples {
        task,
        found: n,
        needed: lags + 1,
    })
}

/// Sums over the present pairs `u[t]`, `e[t + lag]`.
struct Pairs {
    count: usize,
    product: f64,
    of_u: f64,
    of_e: f64,
}

impl Pairs {
    fn at(u: &[f64], e: &[f64], lag: usize) -> Self {
        let mut sums = Self {
            count: 0,
            product: 0.0,
            of_u: 0.0,
            of_e: 0.0,
        };
        for (u, e) in u.iter().zip(e.iter().skip(lag)) {
            if !u.is_nan() && !e.is_nan() {
                sums.count += 1;
                sums.product += u * e;
                sums.of_u += u * u;
                sums.of_e += e * e;
            }
        }
        sums
    }
}

fn has_missing(x: &[f64]) -> bool {
    x.iter().any(|x| x.is_nan())
}

/// Number of present samples.
fn present(x: &[f64]) -> usize {
    x.iter().filter(|x| !x.is_nan()).count()
}

fn centred(x: &[f64]) -> Vec<f64> {
    let mean = if has_missing(x) {
        x.iter().filter(|x| !x.is_nan()).sum::<f64>() / present(x) as f64
    } else {
        x.iter().sum::<f64>() / x.len() as f64
    };
    x.iter().map(|v| v - mean).collect()
}

fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
