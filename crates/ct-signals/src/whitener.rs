//! The filter that whitens autoregressive signals row by row.

use crate::ArModel;

/// Whitens a row of several signals at a time, without allocating; made by [`ArModel::whitener`].
#[derive(Debug, Clone)]
pub struct Whitener {
    /// `a^(m)` for m = 0..=p.
    predictors: Vec<Vec<f64>>,
    /// `a^(p)`.
    coefficients: Vec<f64>,
    /// `sigma/sigma_m` for m = 0..p.
    scales: Vec<f64>,
    lanes: usize,
    /// The last `p + 1` rows, as a ring.
    history: Vec<f64>,
    /// Rows since the record began, at most `p`.
    seen: usize,
    /// The ring's next slot.
    slot: usize,
    /// So many further rows are needed until no lost row is among the last `p`.
    unsure: usize,
    /// Covariance of the last `p` rows, the newest first, given all samples so far, in `sigma^2`: zero where none is lost.
    covariance: Vec<f64>,
    /// Of it, with the next row.
    with_next: Vec<f64>,
    predicted: Vec<f64>,
}

impl Whitener {
    /// Of `lanes` signals at once.
    pub(crate) fn new(model: &ArModel, lanes: usize) -> Self {
        let p = model.order();
        let reflections = model.reflections();
        // sigma/sigma_m = sqrt(prod_{i>m} (1 - k_i^2)).
        let mut scales = vec![1.0; p];
        let mut scale = 1.0;
        for m in (0..p).rev() {
            scale *= (1.0 - reflections[m] * reflections[m]).sqrt();
            scales[m] = scale;
        }
        Self {
            predictors: model.predictors(),
            coefficients: model.coefficients().to_vec(),
            scales,
            lanes,
            history: vec![0.0; (p + 1) * lanes],
            seen: 0,
            slot: 0,
            unsure: 0,
            covariance: vec![0.0; p * p],
            with_next: vec![0.0; p],
            predicted: vec![0.0; lanes],
        }
    }

    /// Replaces the row of samples at one instant, one value for each lane, by its whitened row, in
    /// the same unit: innovations of the process come out with variance `sigma^2`. Order 0 leaves
    /// the row as it is, bit for bit.
    pub fn push(&mut self, row: &mut [f64]) {
        debug_assert_eq!(row.len(), self.lanes, "one value for each lane");
        let p = self.scales.len();
        if p == 0 {
            return;
        }
        if self.unsure > 0 {
            self.push_behind_lost(row);
            return;
        }
        let lanes = self.lanes;
        for (kept, value) in self.history[self.slot * lanes..][..lanes]
            .iter_mut()
            .zip(&*row)
        {
            *kept = *value;
        }
        let full = self.seen == p;
        let predictor = if full {
            &self.coefficients
        } else {
            &self.predictors[self.seen]
        };
        let mut slot = self.slot;
        for a in predictor {
            // A division would cost more than the row.
            slot = if slot == 0 { p } else { slot - 1 };
            let past = &self.history[slot * lanes..][..lanes];
            for (value, past) in row.iter_mut().zip(past) {
                *value -= a * past;
            }
        }
        if !full {
            for value in row.iter_mut() {
                *value *= self.scales[self.seen];
            }
        }
        self.step();
    }

    /// The row of the next instant is lost. The rows behind it come out whitened all the same, with variance `sigma^2` and
    /// independent of each other: until `p` of them have come, the lost ones are estimated from their neighbours (Kalman's filter; B. D. O.
    /// Anderson, J. B. Moore, Optimal Filtering, 1979, ch. 5).
    pub fn skip(&mut self) {
        let p = self.scales.len();
        if p == 0 {
            return;
        }
        let variance = self.predict();
        for i in (0..p * (p - 1)).rev() {
            let (row, column) = (i / p, i % p);
            if column + 1 < p {
                self.covariance[(row + 1) * p + column + 1] = self.covariance[i];
            }
        }
        self.covariance[0] = variance;
        for i in 1..p {
            self.covariance[i] = self.with_next[i - 1];
            self.covariance[i * p] = self.with_next[i - 1];
        }
        self.history[self.slot * self.lanes..][..self.lanes].copy_from_slice(&self.predicted);
        self.unsure = p;
        self.step();
    }

    /// As [`Whitener::push`], where one of the last `p` rows is lost.
    fn push_behind_lost(&mut self, row: &mut [f64]) {
        let p = self.scales.len();
        let variance = self.predict();
        // What this row says of the lost ones.
        let mut slot = self.slot;
        for with_next in &self.with_next {
            slot = if slot == 0 { p } else { slot - 1 };
            let past = &mut self.history[slot * self.lanes..][..self.lanes];
            for ((past, value), predicted) in past.iter_mut().zip(&*row).zip(&self.predicted) {
                *past += with_next / variance * (value - predicted);
            }
        }
        for i in (0..p * (p - 1)).rev() {
            let (row, column) = (i / p, i % p);
            if column + 1 < p {
                self.covariance[(row + 1) * p + column + 1] =
                    self.covariance[i] - self.with_next[row] * self.with_next[column] / variance;
            }
        }
        for i in 0..p {
            self.covariance[i] = 0.0;
            self.covariance[i * p] = 0.0;
        }
        self.history[self.slot * self.lanes..][..self.lanes].copy_from_slice(row);
        for (value, predicted) in row.iter_mut().zip(&self.predicted) {
            *value = (*value - predicted) / variance.sqrt();
        }
        self.unsure -= 1;
        self.step();
    }

    /// Predicts the next row, its covariance with the last `p`, and returns its variance, in `sigma^2`.
    fn predict(&mut self) -> f64 {
        let (p, lanes) = (self.scales.len(), self.lanes);
        let predictor = self.predictors.get(self.seen).unwrap_or(&self.coefficients);
        self.predicted.fill(0.0);
        let mut slot = self.slot;
        for a in predictor {
            slot = if slot == 0 { p } else { slot - 1 };
            let past = &self.history[slot * lanes..][..lanes];
            for (value, past) in self.predicted.iter_mut().zip(past) {
                *value += a * past;
            }
        }
        let of_noise = self.scales.get(self.seen).map_or(1.0, |s| 1.0 / (s * s));
        let rows = self.covariance.chunks_exact(p);
        for (with_next, row) in self.with_next.iter_mut().zip(rows) {
            *with_next = predictor.iter().zip(row).map(|(a, c)| a * c).sum();
        }
        let known = predictor.iter().zip(&self.with_next);
        of_noise + known.map(|(a, c)| a * c).sum::<f64>()
    }

    /// On to the next row.
    fn step(&mut self) {
        let p = self.scales.len();
        self.seen = (self.seen + 1).min(p);
        self.slot = if self.slot == p { 0 } else { self.slot + 1 };
    }

    /// Starts the next record, which is independent of the last.
    pub fn reset(&mut self) {
        self.seen = 0;
        self.unsure = 0;
        self.covariance.fill(0.0);
    }

    /// The number of signals in a row.
    pub fn lanes(&self) -> usize {
        self.lanes
    }
}
