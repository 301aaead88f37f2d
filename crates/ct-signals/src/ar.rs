//! Autoregressive noise: its fit, and the exact whitening of residuals and sensitivities.
//!
//! **Model**: `v[k] = a_1 v[k-1] + ... + a_p v[k-p] + e[k]`, `e` Gaussian, white, of variance
//! `sigma^2`; `v` stationary, of mean 0 (none is removed), and independent between segments.
//!
//! **Fit**: Burg's recursion. With forward and backward errors `f_0 = b_0 = v`, for m = 1, 2, ...
//! ```text
//! k_m    = 2 sum f_{m-1}[t] b_{m-1}[t-1] / sum (f_{m-1}[t]^2 + b_{m-1}[t-1]^2)
//! f_m[t] = f_{m-1}[t]   - k_m b_{m-1}[t-1]
//! b_m[t] = b_{m-1}[t-1] - k_m f_{m-1}[t]
//! ```
//! the sums over all samples of all segments that have m predecessors. `|k_m| < 1` makes every
//! predictor stable. The order is the one with the smallest
//! `BIC = N log(sum w^2 / N) + log|R| + p log N`, in which `w` is the whitened series and `R` the
//! covariance over `sigma^2`: the exact likelihood, so that all orders are compared on all `N`
//! samples.
//!
//! **Whitening**: Levinson's recursion `a^(m)_i = a^(m-1)_i - k_m a^(m-1)_{m-i}`, `a^(m)_m = k_m`
//! gives the predictor of each order, and `sigma_m^2 = sigma_{m-1}^2 (1 - k_m^2)` its error. The
//! first samples of a record use the predictor of as many predecessors as there are:
//! `w[k] = (v[k] - sum_{i<=m} a^(m)_i v[k-i]) sigma/sigma_m`, `m = min(k, p)`. This is
//! `w = L^-1 v` for the covariance `sigma^2 L L'`, with no sample lost.
//!
//! **Missing samples** are NaN: the likelihood, the whitening and the log-determinant are then those of the samples that are
//! there, exactly ([`Whitener`]), and the fit maximises that likelihood from order to order, as Burg's recursion needs
//! unbroken stretches. At a correlation of 0.8 and 2000 samples the standard deviation of the estimate grows by 7 % where
//! 30 % are missing at random, and by 31 % where only every third is there.
//!
//! **Cost**: `p` multiplications per value whitened.
//!
//! **Reference**: J. P. Burg, *Maximum entropy spectral analysis*, thesis, Stanford 1975;
//! P. J. Brockwell, R. A. Davis, *Time Series: Theory and Methods*, 2nd ed., Springer 1991, ch. 5
//! and 8.

mod burg;

use serde::{Deserialize, Serialize};

use crate::{Error, Whitener};

/// Partial correlations keep this distance from -1 and 1, so that even a constant or a sine gives a stable predictor.
pub(crate) const MARGIN: f64 = 1e-9;
/// A smaller sum of squares counts as zero, because products would underflow.
pub(crate) const NEGLIGIBLE: f64 = 1e-200;

/// A stationary autoregressive process of mean 0.
///
/// Read again from coefficients and `sigma`, it is checked to be stationary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written")]
pub struct ArModel {
    /// Partial correlations `k_1..k_p`, each within -1..1.
    #[serde(skip)]
    reflections: Vec<f64>,
    /// `a_1..a_p`.
    coefficients: Vec<f64>,
    /// Standard deviation of the innovations, in the signal's unit.
    sigma: f64,
}

/// An [`ArModel`] as it is written.
#[derive(Deserialize)]
struct Written {
    coefficients: Vec<f64>,
    sigma: f64,
}

impl TryFrom<Written> for ArModel {
    type Error = Error;

    fn try_from(written: Written) -> Result<Self, Error> {
        Self::from_coefficients(&written.coefficients, written.sigma)
    }
}

impl ArModel {
    /// White noise of standard deviation `sigma` (the signal's unit): order 0.
    pub fn white(sigma: f64) -> Self {
        ArModel {
            reflections: Vec::new(),
            coefficients: Vec::new(),
            sigma,
        }
    }

    /// A process with known coefficients `a_1..a_p` and innovations of standard deviation `sigma`
    /// (the signal's unit, `>= 0`).
    ///
    /// # Errors
    /// [`Error::InvalidSetting`] when `sigma` is negative or not finite, or when the process is not
    /// stationary.
    pub fn from_coefficients(coefficients: &[f64], sigma: f64) -> Result<Self, Error> {
        if !(sigma.is_finite() && sigma >= 0.0) {
            return Err(Error::InvalidSetting {
                setting: "sigma",
                value: sigma.to_string(),
                range: "finite and at least 0".into(),
            });
        }
        // Levinson's recursion backward.
        let mut a = coefficients.to_vec();
        let mut reflections = vec![0.0; a.len()];
        for m in (1..=a.len()).rev() {
            let k = a[m - 1];
            if k.is_nan() || k.abs() >= 1.0 {
                return Err(Error::InvalidSetting {
                    setting: "coefficients",
                    value: format!("{coefficients:?}, with partial correlation {k} at lag {m}"),
                    range: "those of a stationary process, partial correlations within -1..1"
                        .into(),
                });
            }
            reflections[m - 1] = k;
            let previous: Vec<f64> = (0..m - 1)
                .map(|i| (a[i] + k * a[m - 2 - i]) / (1.0 - k * k))
                .collect();
            a[..m - 1].copy_from_slice(&previous);
        }
        Ok(ArModel {
            reflections,
            coefficients: coefficients.to_vec(),
            sigma,
        })
    }

    /// A process with known partial correlations `k_1..k_p`, within -1..1, and innovations of standard deviation
    /// `sigma` (the signal's unit, `>= 0`).
    ///
    /// # Errors
    /// As of [`ArModel::from_coefficients`].
    pub fn from_reflections(reflections: &[f64], sigma: f64) -> Result<Self, Error> {
        let coefficients = predictors(reflections).pop().unwrap_or_default();
        Self::from_coefficients(&coefficients, sigma)
    }

    /// The process with its memory limited to `samples`: poles that decay more slowly than `exp(-1/samples)` a sample are
    /// moved inwards until none does. The innovations' standard deviation is kept.
    ///
    /// A model with a pole near one describes any slow model error as noise. All poles are scaled by one factor, `a_i gamma^i`, which hardly
    /// moves those that decay fast (bandwidth expansion; R. Viswanathan, J. Makhoul, IEEE Trans. ASSP 23 (1975) 309-321).
    ///
    /// `samples`: above 0; a model within the limit is returned as it is.
    #[must_use]
    pub fn with_memory_at_most(&self, samples: f64) -> Self {
        let radius = (-1.0 / samples.max(f64::MIN_POSITIVE)).exp();
        let scaled = |factor: f64| -> Vec<f64> {
            let powers = std::iter::successors(Some(factor), |power| Some(power * factor));
            let terms = self.coefficients.iter().zip(powers);
            terms.map(|(a, power)| a * power).collect()
        };
        // All poles are inside a radius if the process with its poles divided by the radius is stationary.
        let within = |factor: f64| {
            Self::from_coefficients(&scaled(factor / radius.max(f64::MIN_POSITIVE)), 1.0).is_ok()
        };
        if self.coefficients.is_empty() || within(1.0) {
            return self.clone();
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if within(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Self::from_coefficients(&scaled(low), self.sigma)
            .unwrap_or_else(|_| ArModel::white(self.sigma))
    }

    /// The same autoregression with innovations of another standard deviation, `>= 0`.
    #[must_use]
    pub fn with_sigma(&self, sigma: f64) -> Self {
        ArModel {
            sigma,
            ..self.clone()
        }
    }

    /// Autoregression with these partial correlations, all within -1..1.
    pub(crate) fn of_stationary(reflections: &[f64], sigma: f64) -> Self {
        ArModel {
            reflections: reflections.to_vec(),
            coefficients: predictors(reflections).pop().unwrap_or_default(),
            sigma,
        }
    }

    /// Partial correlations `k_1..k_p`, each within -1..1.
    pub fn reflections(&self) -> &[f64] {
        &self.reflections
    }

    /// The predictors `a^(0)..a^(p)` of every order up to `p`.
    pub fn predictors(&self) -> Vec<Vec<f64>> {
        predictors(&self.reflections)
    }

    /// The number of coefficients `p`; 0 is white noise.
    pub fn order(&self) -> usize {
        self.coefficients.len()
    }

    /// `a_1..a_p` of `v[k] = sum a_i v[k-i] + e[k]`.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Standard deviation of the innovations `e`, in the signal's unit. After a fit to `N` samples:
    /// the whitened sum of squares over `N - p`, and its root.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Standard deviation of the process `v` itself, in the signal's unit:
    /// `sigma / sqrt(prod (1 - k_i^2))`.
    pub fn stationary_std(&self) -> f64 {
        self.reflections
            .iter()
            .fold(self.sigma, |std, k| std / (1.0 - k * k).sqrt())
    }

    /// Gain of the whitening filter for a slow change of the signal: size of the change in the whitened signal over the innovations'
    /// standard deviation, for a change as large as the standard deviation of the process. `(1 - sum a_i) / sqrt(prod (1 - k_i^2))`. White
    /// noise: 1; noise with a long memory: less.
    pub fn slow_gain(&self) -> f64 {
        let at_zero = 1.0 - self.coefficients.iter().sum::<f64>();
        self.reflections
            .iter()
            .fold(at_zero, |gain, k| gain / (1.0 - k * k).sqrt())
    }

    /// A filter that whitens `lanes` signals at once, one row of samples at a time: a residual and the columns of its Jacobian, say.
    pub fn whitener(&self, lanes: usize) -> Whitener {
        Whitener::new(self, lanes)
    }

    /// Whitens one record, in which NaN stands for a sample that is missing. White innovations of variance `sigma^2` come
    /// back, not of variance 1, and NaN for the missing ones.
    ///
    /// Each sample is predicted from all earlier available samples, and its error scaled to `sigma`: `w = L^-1 v` over
    /// the available samples, for their covariance `sigma^2 L L'`.
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        let mut whitener = self.whitener(1);
        let mut whitened = values.to_vec();
        let mut lost = 0;
        for value in &mut whitened {
            if value.is_nan() {
                lost += 1;
                continue;
            }
            whitener.skip_many(std::mem::take(&mut lost));
            whitener.push(std::slice::from_mut(value));
        }
        whitened
    }

    /// `log|R|` of a record of `n` samples whose covariance is `sigma^2 R`.
    ///
    /// `sigma` does not enter: order 0 has `R = I` and gives 0, any other order a value that is
    /// `>= 0` and no longer changes from `n = p` on. With `w` the whitened record,
    /// `-2 log likelihood = n log(2 pi sigma^2) + log_det(n) + sum(w^2)/sigma^2`; over several
    /// records each of the three is summed.
    pub fn log_det(&self, n: usize) -> f64 {
        // R[k | past] = prod_{i>k} 1/(1 - k_i^2), for the samples k = 0.. with fewer than p predecessors.
        self.reflections
            .iter()
            .enumerate()
            .map(|(i, k)| -((i + 1).min(n) as f64) * (1.0 - k * k).ln())
            .sum()
    }

    /// `log|R|` of a record in which samples are missing, over the available samples: one entry for each instant, false
    /// where the sample is missing.
    ///
    /// The sum of the logarithms of their prediction variances over `sigma^2`, `>= 0`; [`ArModel::log_det`] of `n`, bit for
    /// bit, if all `n` of them are available. The likelihood is that of [`ArModel::log_det`], with `n` the available samples
    /// and `w` the values of [`ArModel::whiten`] that are not NaN.
    ///
    /// Of a series: `model.log_det_of(series.iter().map(|v| !v.is_nan()))`.
    pub fn log_det_of(&self, observed: impl IntoIterator<Item = bool>) -> f64 {
        let mut observed = observed.into_iter().skip_while(|there| !there);
        let Some(_) = observed.next() else {
            return 0.0;
        };
        // Up to the first that is missing.
        let whole = 1 + observed.by_ref().take_while(|there| *there).count();
        let mut sum = LogProduct::default();
        let mut whitener = self.whitener(0);
        for _ in 0..whole.min(self.order()) {
            whitener.push(&mut []);
        }
        let mut lost = 1;
        for there in observed {
            if !there {
                lost += 1;
                continue;
            }
            whitener.skip_many(std::mem::take(&mut lost));
            sum.push(whitener.push_with_variance(&mut []));
        }
        self.log_det(whole) + sum.log()
    }
}

/// NaN stands for a missing sample; no value may be infinite.
pub(crate) fn check_not_infinite(task: &str, signal: &str, values: &[f64]) -> Result<(), Error> {
    match values.iter().position(|v| v.is_infinite()) {
        None => Ok(()),
        Some(index) => Err(Error::ValueNotFinite {
            record: task.into(),
            signal: signal.into(),
            index,
            value: values[index],
        }),
    }
}

/// `a^(0), ..., a^(p)` by Levinson's recursion.
fn predictors(reflections: &[f64]) -> Vec<Vec<f64>> {
    let mut ladder = vec![Vec::new()];
    let mut a: Vec<f64> = Vec::new();
    for &k in reflections {
        let reversed: Vec<f64> = a.iter().rev().copied().collect();
        for (a, back) in a.iter_mut().zip(reversed) {
            *a -= k * back;
        }
        a.push(k);
        ladder.push(a.clone());
    }
    ladder
}

/// The logarithm of a product of many positive numbers, for the cost of a product.
#[derive(Debug)]
pub(crate) struct LogProduct {
    product: f64,
    logarithm: f64,
}

impl Default for LogProduct {
    fn default() -> Self {
        Self {
            product: 1.0,
            logarithm: 0.0,
        }
    }
}

impl LogProduct {
    pub(crate) fn push(&mut self, factor: f64) {
        self.product *= factor;
        if !(1e-100..1e100).contains(&self.product) {
            self.logarithm += self.product.ln();
            self.product = 1.0;
        }
    }

    pub(crate) fn log(&self) -> f64 {
        self.logarithm + self.product.ln()
    }
}
