//! The filter that whitens autoregressive signals row by row, lost rows among them.
//!
//! **State**: the last p rows and, for those of them that are lost, their estimates from all rows so far and the
//! covariance `C` of the estimates' errors. A row `v` is predicted as `sum a_i v_i`, with the variance
//! `s^2 = 1 + a' C a` in `sigma^2` (its predecessors' own predictor and variance at the start of a record), and corrects
//! the estimates by `C a (v - prediction)/s^2` (Kalman's filter; B. D. O. Anderson, J. B. Moore, Optimal Filtering, 1979,
//! ch. 5; R. H. Jones, Maximum likelihood fitting of ARMA models to time series with missing observations, Technometrics
//! 22 (1980) 389-395).
//!
//! **Cost**: `p` products per value, and `m^2` per row where `m` of the last p rows are lost.

use crate::ArModel;

/// Gaps of up to this number of rows per coefficient are passed row by row, which is cheaper.
const ONE_BY_ONE: usize = 16;
/// Powers of the state's matrix below this are treated as zero.
const FORGOTTEN: f64 = 1e-40;

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
    /// Slots of the missing rows among the last `p` rows, the oldest first.
    lost: Vec<usize>,
    /// Covariance of the lost rows' estimates by slots, `(p + 1) x (p + 1)`, in `sigma^2`; entries of other rows are not used.
    covariance: Vec<f64>,
    /// For each lost row: its covariance with the next row; after the next row, its gain.
    with_next: Vec<f64>,
    predicted: Vec<f64>,
}

impl Whitener {
    /// For `lanes` signals at once.
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
            lost: Vec::with_capacity(p + 1),
            covariance: vec![0.0; (p + 1) * (p + 1)],
            with_next: Vec::with_capacity(p + 1),
            predicted: vec![0.0; lanes],
        }
    }

    /// Replaces the row of samples at one instant, one value for each signal, by its whitened row, in the same unit: innovations of the
    /// process come out with variance `sigma^2`. Order 0 leaves the row as it is, bit for bit.
    pub fn push(&mut self, row: &mut [f64]) {
        debug_assert_eq!(row.len(), self.lanes, "one value for each lane");
        let p = self.scales.len();
        if p == 0 {
            return;
        }
        if !self.lost.is_empty() {
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

    /// As [`Whitener::push`]; gives the variance of the row's prediction from all earlier rows, in `sigma^2`: 1 from the
    /// p-th row on where none is lost, otherwise at least 1. The sum of their logarithms is [`ArModel::log_det_of`].
    pub fn push_with_variance(&mut self, row: &mut [f64]) -> f64 {
        if !self.lost.is_empty() {
            return self.push_behind_lost(row);
        }
        let scale = self.scales.get(self.seen).copied().unwrap_or(1.0);
        self.push(row);
        1.0 / (scale * scale)
    }

    /// The row of the next instant is lost. Later rows are whitened too, with variance `sigma^2` and independent of each other: until `p` of them have come, the lost ones are estimated from their neighbours.
    ///
    /// Lost rows before the first of a record change nothing.
    pub fn skip(&mut self) {
        let p = self.scales.len();
        if p == 0 || self.seen == 0 {
            return;
        }
        let variance = self.predict();
        let slot = self.slot;
        for (&other, &with_next) in self.lost.iter().zip(&self.with_next) {
            self.covariance[slot * (p + 1) + other] = with_next;
            self.covariance[other * (p + 1) + slot] = with_next;
        }
        self.covariance[slot * (p + 1) + slot] = variance;
        self.history[slot * self.lanes..][..self.lanes].copy_from_slice(&self.predicted);
        self.lost.push(slot);
        self.with_next.push(0.0);
        self.step_behind_lost();
    }

    /// Same as `rows` calls of [`Whitener::skip`], to rounding, at a cost that grows with the logarithm of `rows` where they are
    /// many: `x[k+n] = A^n x[k]`, and the covariance with it, by repeated squaring of the state's matrix `A`. Where `A^n`
    /// vanishes, the whitener is as at the start of a record.
    pub fn skip_many(&mut self, rows: usize) {
        let p = self.scales.len();
        if p == 0 || self.seen == 0 {
            return;
        }
        let one_by_one = if rows > ONE_BY_ONE * p { p } else { rows };
        for _ in 0..one_by_one {
            self.skip();
        }
        if rows > one_by_one {
            self.skip_squaring(rows - one_by_one);
        }
    }

    /// As `rows` calls of [`Whitener::skip`] if all of the last `p` rows are lost.
    fn skip_squaring(&mut self, mut rows: usize) {
        let (p, lanes) = (self.scales.len(), self.lanes);
        let slots: Vec<usize> = (1..=p)
            .map(|lag| (self.slot + p + 1 - lag) % (p + 1))
            .collect();
        // The state, the newest row first.
        let mut state = Vec::with_capacity(p * lanes);
        for slot in &slots {
            state.extend_from_slice(&self.history[slot * lanes..][..lanes]);
        }
        let at = |ij: usize| self.covariance[slots[ij / p] * (p + 1) + slots[ij % p]];
        let mut covariance: Vec<f64> = (0..p * p).map(at).collect();
        // For 1, 2, 4, ... steps: the transition matrix, and the covariance of the noise over these steps.
        let mut power = vec![0.0; p * p];
        power[..p].copy_from_slice(&self.coefficients);
        for i in 1..p {
            power[i * p + i - 1] = 1.0;
        }
        let mut noise = vec![0.0; p * p];
        noise[0] = 1.0;
        let moved = |power: &[f64], covariance: &[f64], noise: &[f64]| -> Vec<f64> {
            let half = product(power, covariance, p);
            let entry = |ij: usize| {
                let (row, column) = (&half[ij / p * p..][..p], &power[ij % p * p..][..p]);
                noise[ij] + row.iter().zip(column).map(|(a, b)| a * b).sum::<f64>()
            };
            (0..p * p).map(entry).collect()
        };
        while rows > 0 {
            if power.iter().all(|a| a.abs() < FORGOTTEN) {
                // The earlier rows have no influence any more.
                self.reset();
                return;
            }
            if rows & 1 == 1 {
                state = product(&power, &state, lanes);
                covariance = moved(&power, &covariance, &noise);
            }
            rows >>= 1;
            noise = moved(&power, &noise, &noise);
            power = product(&power, &power, p);
        }
        for (i, slot) in slots.iter().enumerate() {
            self.history[slot * lanes..][..lanes].copy_from_slice(&state[i * lanes..][..lanes]);
            for (j, other) in slots.iter().enumerate() {
                self.covariance[slot * (p + 1) + other] = covariance[i * p + j];
            }
        }
    }

    /// As [`Whitener::push_with_variance`], if one of the last `p` rows is lost.
    fn push_behind_lost(&mut self, row: &mut [f64]) -> f64 {
        let (p, lanes) = (self.scales.len(), self.lanes);
        let variance = self.predict();
        // Update of the lost rows from this row.
        for (i, &slot) in self.lost.iter().enumerate() {
            let gain = self.with_next[i] / variance;
            let past = &mut self.history[slot * lanes..][..lanes];
            for ((past, value), predicted) in past.iter_mut().zip(&*row).zip(&self.predicted) {
                *past += gain * (value - predicted);
            }
            let covariance = &mut self.covariance[slot * (p + 1)..][..p + 1];
            for (&other, with_next) in self.lost.iter().zip(&self.with_next) {
                covariance[other] -= gain * with_next;
            }
        }
        for with_next in &mut self.with_next {
            *with_next /= variance;
        }
        self.history[self.slot * lanes..][..lanes].copy_from_slice(row);
        let scale = 1.0 / variance.sqrt();
        for (value, predicted) in row.iter_mut().zip(&self.predicted) {
            *value = (*value - predicted) * scale;
        }
        self.step_behind_lost();
        variance
    }

    /// By how much the row that was pushed last corrected the estimates of the lost rows before it, for each unit of its
    /// prediction error: how many rows before it (1 to p), and the gain. Empty where none of them is lost.
    pub fn gains(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let lags = self.lost.iter().map(|&slot| self.lag(slot) - 1);
        lags.zip(self.with_next.iter().copied())
    }

    /// Distance to the next row, 1 to `p`.
    fn lag(&self, slot: usize) -> usize {
        if self.slot > slot {
            self.slot - slot
        } else {
            self.slot + self.scales.len() + 1 - slot
        }
    }

    /// Predicts the next row, its covariance with the lost ones, and returns its variance, in `sigma^2`.
    fn predict(&mut self) -> f64 {
        let (p, lanes) = (self.scales.len(), self.lanes);
        let predictor = self.predictors.get(self.seen).unwrap_or(&self.coefficients);
        self.predicted.fill(0.0);
        if let [value] = self.predicted.as_mut_slice() {
            // The ring from its newest row back, in its two parts.
            let (newer, older) = self.history.split_at(self.slot);
            let past = newer.iter().rev().chain(older.iter().rev());
            *value = predictor.iter().zip(past).map(|(a, past)| a * past).sum();
        } else {
            let mut slot = self.slot;
            for a in predictor {
                slot = if slot == 0 { p } else { slot - 1 };
                let past = &self.history[slot * lanes..][..lanes];
                for (value, past) in self.predicted.iter_mut().zip(past) {
                    *value += a * past;
                }
            }
        }
        let mut variance = self.scales.get(self.seen).map_or(1.0, |s| 1.0 / (s * s));
        self.with_next.clear();
        self.with_next.resize(self.lost.len(), 0.0);
        for &other in &self.lost {
            let a = predictor[self.lag(other) - 1];
            let covariance = &self.covariance[other * (p + 1)..][..p + 1];
            for (with_next, &slot) in self.with_next.iter_mut().zip(&self.lost) {
                *with_next += a * covariance[slot];
            }
        }
        for (&slot, with_next) in self.lost.iter().zip(&self.with_next) {
            variance += predictor[self.lag(slot) - 1] * with_next;
        }
        variance
    }

    /// On to the next row; one that is no longer among the last `p` needs no estimate.
    fn step_behind_lost(&mut self) {
        self.step();
        if self.lost.first() == Some(&self.slot) {
            self.lost.remove(0);
            self.with_next.remove(0);
        }
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
        self.lost.clear();
        self.with_next.clear();
    }

    /// The number of signals in a row.
    pub fn lanes(&self) -> usize {
        self.lanes
    }
}

/// `A B` for a square matrix of `p` rows and one of as many rows and `columns` columns, both row by row.
fn product(a: &[f64], b: &[f64], columns: usize) -> Vec<f64> {
    let p = a.len().isqrt();
    let mut ab = vec![0.0; p * columns];
    if columns > 0 {
        for (row, sums) in a.chunks_exact(p).zip(ab.chunks_exact_mut(columns)) {
            for (a, b) in row.iter().zip(b.chunks_exact(columns)) {
                for (sum, b) in sums.iter_mut().zip(b) {
                    *sum += a * b;
                }
            }
        }
    }
    ab
}
