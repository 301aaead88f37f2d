//! Residuals as a series together with the regressors: the autoregression, and the whitened result.

use ct_signals::{ArModel, StationaryNoise};
use estimation::Triangle;

use crate::Error;

/// A series, and the deterministic signals in it.
pub(super) struct Series {
    pub(super) values: Vec<f64>,
    pub(super) beside: Vec<Vec<f64>>,
}

/// The autoregression of the residuals of all series, and minus twice the logarithm of its marginal likelihood, with the penalty of Bayes'
/// information criterion for its coefficients.
pub(super) fn autoregression(
    mut all: Vec<Series>,
    max_order: usize,
) -> Result<(f64, ArModel), Error> {
    all = all.into_iter().map(Series::without_others).collect();
    let segments: Vec<&[f64]> = all.iter().map(|s| &s.values[..]).collect();
    let ar = ArModel::fit(&segments, max_order)?;
    let n: usize = segments.iter().map(|s| s.len()).sum();
    let (mut squares, mut volume, mut left) = (0.0, 0.0, n as f64);
    for series in &all {
        volume += ar.log_det(series.values.len());
        let whitened = Series {
            values: ar.whiten(&series.values),
            beside: series.beside.iter().map(|b| ar.whiten(b)).collect(),
        };
        let (triangle, x) = whitened.regression();
        squares += triangle.predicted(&x);
        if triangle.determined() {
            volume += triangle.log_det();
            left -= x.len() as f64;
        }
    }
    let variance = (squares / left).max(f64::MIN_POSITIVE);
    let penalty = ar.order() as f64 * (n as f64).ln();
    Ok((left * variance.ln() + volume + penalty, ar))
}

impl Series {
    /// The values after subtraction of the estimated deterministic signals.
    pub(super) fn without_others(mut self) -> Self {
        let (triangle, x) = match self.values.iter().any(|v| v.is_nan()) {
            true => self.there().regression(),
            false => self.regression(),
        };
        if triangle.cost() > 0.0 {
            for (x, beside) in x.iter().zip(&self.beside) {
                for (v, b) in self.values.iter_mut().zip(beside) {
                    *v -= x * b;
                }
            }
        }
        self
    }

    /// The present rows.
    fn there(&self) -> Self {
        let only = |signal: &Vec<f64>| {
            let rows = signal.iter().zip(&self.values);
            let there = rows.filter(|(_, value)| !value.is_nan());
            there.map(|(signal, _)| *signal).collect()
        };
        Self {
            values: only(&self.values),
            beside: self.beside.iter().map(only).collect(),
        }
    }

    /// Whitens the present rows with the process, and returns their `log|R|`.
    pub(super) fn whitened(&self, process: &StationaryNoise) -> (Self, f64) {
        let mut whitener = process.whitener(1 + self.beside.len());
        let mut whitened = self.there();
        let (mut log_det, mut k) = (0.0, 0);
        let mut row = vec![0.0; 1 + self.beside.len()];
        for value in &self.values {
            if value.is_nan() {
                whitener.skip();
                continue;
            }
            let signals = std::iter::once(&mut whitened.values).chain(&mut whitened.beside);
            let mut columns: Vec<&mut f64> = signals.map(|signal| &mut signal[k]).collect();
            for (row, column) in row.iter_mut().zip(&columns) {
                *row = **column;
            }
            log_det += whitener.push(&mut row).ln();
            for (row, column) in row.iter().zip(&mut columns) {
                **column = *row;
            }
            k += 1;
        }
        (whitened, log_det)
    }

    /// Least squares of the values on the deterministic signals; 0 if not determined.
    pub(super) fn regression(&self) -> (Triangle, Vec<f64>) {
        let q = self.beside.len();
        let mut columns: Vec<&[f64]> = self.beside.iter().map(Vec::as_slice).collect();
        columns.push(&self.values);
        let mut triangle = Triangle::new(q + 1);
        triangle.push_columns(&columns);
        triangle.finish();
        let x = if triangle.determined() {
            triangle.solve(&(0..q).collect::<Vec<_>>(), &[], 0.0)
        } else {
            vec![0.0; q]
        };
        (triangle, x)
    }
}
