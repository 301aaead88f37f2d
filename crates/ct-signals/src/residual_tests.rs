//! Is anything left in a residual? Whiteness, and correlation with the input.
//!
//! Both tests give a probability `p`: how often a residual that is pure noise would look at least
//! this far from it. Below 0.01, say, something remains.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::record::check_finite;
use crate::{ArModel, Error};

/// Highest order of the filters that whiten the input and the residual.
const MAX_PREWHITENING_ORDER: usize = 20;

/// Autocorrelation of `x`, mean removed, at lags `0..=max_lag`; 1 at lag 0.
///
/// 0 at lags that the record is too short for, and at all lags above 0 when `x` does not vary.
pub fn autocorrelation(x: &[f64], max_lag: usize) -> Vec<f64> {
    let mut correlation = cross_correlation(x, x, max_lag);
    correlation[0] = 1.0;
    correlation
}

/// Correlation of `u[k]` with `e[k + lag]`, means removed, at lags `0..=max_lag`: `u` leads, so a
/// residual that the input explains shows at lags above 0.
///
/// The sum at each lag is divided by the number of samples, as is usual, which keeps values within
/// -1..1. 0 at lags that the record is too short for, and at all when one of the two does not vary.
/// Of two series of different lengths the end of the longer is left out.
pub fn cross_correlation(u: &[f64], e: &[f64], max_lag: usize) -> Vec<f64> {
    let n = u.len().min(e.len());
    let (u, e) = (centred(&u[..n]), centred(&e[..n]));
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

/// Whether `x` is white (Ljung and Box): the probability `p` under that hypothesis.
///
/// `Q = n (n+2) sum_{k=1}^{lags} rho_k^2/(n-k)` is chi-square with `lags - fitted` degrees of
/// freedom, `fitted` the number of coefficients of a noise model that made `x` white (0 for the
/// residual of a simulation). `lags`: about 20, and at most a quarter of the samples.
///
/// Reference: G. M. Ljung, G. E. P. Box, *On a measure of lack of fit in time series models*,
/// Biometrika 65 (1978) 297-303.
///
/// # Errors
/// [`Error::InvalidSetting`] unless `fitted < lags`, [`Error::TooFewSamples`] unless there are more
/// samples than lags, [`Error::ValueNotFinite`].
pub fn ljung_box(x: &[f64], lags: usize, fitted: usize) -> Result<f64, Error> {
    const TASK: &str = "Ljung-Box test";
    if fitted >= lags {
        return Err(Error::InvalidSetting {
            setting: "lags",
            value: lags.to_string(),
            range: format!("more than the {fitted} fitted noise coefficients"),
        });
    }
    check_length(TASK, x.len(), lags)?;
    check_finite(TASK, "x", x)?;
    portmanteau(x.len(), &autocorrelation(x, lags)[1..], lags - fitted)
}

/// Whether the residual `e` is independent of the input's past: the correlation at lags `0..=lags`
/// and the probability `p` of lags `1..=lags` under that hypothesis.
///
/// The correlation of two smooth signals is large by chance alone, so both are first made white,
/// each by an autoregressive filter fitted to it (Haugh's test). The order is at most 20, by BIC,
/// and 0 for a residual that is white already. The sum
/// `n (n+2) sum_{k=1}^{lags} r_k^2/(n-k)` is then chi-square with `lags` degrees of freedom.
///
/// Lag 0 is reported but does not count: `y[k]` is read before `u[k]` acts, so the input cannot
/// show there, while a controller that reads `y[k]` can.
///
/// Reference: L. D. Haugh, *Checking the independence of two covariance-stationary time series*,
/// J. American Statistical Association 71 (1976) 378-385.
///
/// # Errors
/// [`Error::SeriesMismatch`], [`Error::TooFewSamples`] unless there are more samples than lags,
/// [`Error::InvalidSetting`] when `lags` is 0, [`Error::ValueNotFinite`].
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
    check_length(TASK, u.len(), lags)?;
    check_finite(TASK, "u", u)?;
    check_finite(TASK, "e", e)?;
    let correlation = cross_correlation(&whitened(u)?, &whitened(e)?, lags);
    let p = portmanteau(u.len(), &correlation[1..], lags)?;
    Ok((correlation, p))
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

fn centred(x: &[f64]) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    x.iter().map(|v| v - mean).collect()
}

fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
