//! The rows of a least-squares problem, series by series.

use crate::{Noise, Triangle};

/// The derivatives and the residual of every sample. A series is one output's samples in one record; series follow each other by record
/// and, within one, by output.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Entries of a row: the derivatives with respect to the free entries, then the residual, NaN if the sample is missing.
    pub columns: usize,
    /// Number of outputs.
    pub outputs: usize,
    /// Samples of each series.
    pub lengths: Vec<usize>,
    /// Row by row.
    pub values: Vec<f64>,
    /// The rows of the priors, in standard errors.
    pub priors: Vec<Vec<f64>>,
}

impl Rows {
    /// The rows of one series after the other with their output, each a slice of `length x columns` values.
    pub fn series(&self) -> impl Iterator<Item = (usize, &[f64])> {
        let mut rest = self.values.as_slice();
        let lengths = self.lengths.iter().enumerate();
        lengths.map(move |(i, &length)| {
            let (series, after) = rest.split_at(length * self.columns);
            rest = after;
            (i % self.outputs, series)
        })
    }

    /// The residuals, series by series.
    #[must_use]
    pub fn residuals(&self) -> Vec<Vec<f64>> {
        let last = |row: &[f64]| row[self.columns - 1];
        self.series()
            .map(|(_, series)| series.chunks_exact(self.columns).map(last).collect())
            .collect()
    }

    /// Whether each row's sample is present, series by series.
    pub(crate) fn present(&self) -> impl Iterator<Item = (usize, Vec<bool>)> {
        let columns = self.columns;
        let there = move |row: &[f64]| !row[columns - 1].is_nan();
        self.series().map(move |(output, series)| {
            (output, series.chunks_exact(columns).map(there).collect())
        })
    }

    /// The present rows, record by record in the order of time, times the weight of their output.
    #[must_use]
    pub fn in_time(&self, weights: &[f64]) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.values.len());
        let series: Vec<(usize, &[f64])> = self.series().collect();
        for record in series.chunks(self.outputs) {
            let length = record.first().map_or(0, |(_, rows)| rows.len());
            for at in (0..length).step_by(self.columns) {
                for (output, rows) in record {
                    let row = &rows[at..at + self.columns];
                    if !row[self.columns - 1].is_nan() {
                        all.extend(row.iter().map(|value| weights[*output] * value));
                    }
                }
            }
        }
        all
    }

    /// Every present row, whitened by the noise model of its output and times the output's weight, with selected columns in this order. The
    /// noise model accounts for missing samples.
    pub fn each_whitened(
        &self,
        order: &[usize],
        noise: &Noise,
        weights: &[f64],
        mut each: impl FnMut(&[f64]),
    ) {
        let mut whiteners = noise.whiteners(order.len());
        let mut chosen = vec![0.0; order.len()];
        for (output, series) in self.series() {
            let (whitener, weight) = (&mut whiteners[output], weights[output]);
            whitener.reset();
            let mut missing = 0;
            for row in series.chunks_exact(self.columns) {
                if row[self.columns - 1].is_nan() {
                    missing += 1;
                    continue;
                }
                whitener.skip_many(std::mem::take(&mut missing));
                for (to, &column) in chosen.iter_mut().zip(order) {
                    *to = row[column];
                }
                whitener.push(&mut chosen);
                if weight != 1.0 {
                    chosen.iter_mut().for_each(|value| *value *= weight);
                }
                each(&chosen);
            }
        }
    }

    /// Rows of the priors with selected columns in this order, scaled by the standard deviation `sigma` of the data rows.
    pub fn each_prior(&self, order: &[usize], sigma: f64, mut each: impl FnMut(&[f64])) {
        let mut chosen = vec![0.0; order.len()];
        for row in &self.priors {
            for (to, &column) in chosen.iter_mut().zip(order) {
                *to = sigma * row[column];
            }
            each(&chosen);
        }
    }

    /// The R factor of the samples, whitened and weighted, with selected columns in this order.
    #[must_use]
    pub fn fold(&self, order: &[usize], noise: &Noise, weights: &[f64]) -> Triangle {
        let mut triangle = Triangle::new(order.len());
        self.each_whitened(order, noise, weights, |row| triangle.push(row));
        triangle.finish();
        triangle
    }
}
