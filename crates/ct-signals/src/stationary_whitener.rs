//! The filter that whitens signals of any stationary process row by row, with missing rows.
//!
//! Model: that of [`StationaryNoise`](crate::StationaryNoise), by its autocovariance alone, `R(0) = r`, `R(j) = c' A^{j-1} g`.
//!
//! Equations (Kalman's filter in its covariance form): with S the covariance of the state's estimate, 0 at the beginning,
//! ```text
//! r_e = r - c' S c             the variance of the row's prediction c' x^ from all rows before it
//! k = (g - A S c)/r_e          x^+ = A x^ + k (v - c' x^)     S+ = A S A' + r_e k k'
//! missing row                  x^+ = A x^                     S+ = A S A'
//! ```
//! Rows come out divided by the root of `r_e`: white, of the variance of the process's innovations. The sum of the logarithms of `r_e` is
//! `log|R|` of the available rows.
//!
//! Cost: the products of A's entries that are not 0 with S, twice, a row.
//!
//! Reference: T. Kailath, A. H. Sayed, B. Hassibi, Linear Estimation, Prentice Hall 2000, ch. 9; P. Faurre, Stochastic realization
//! algorithms, in R. K. Mehra, D. G. Lainiotis (eds.), System Identification, Academic Press 1976.

use crate::StationaryNoise;

/// The least ratio of `r_e` to `r`: smaller values are rounding errors.
const ROUNDING: f64 = 1e-14;

/// Whitens rows of several signals, without allocating; made by [`StationaryNoise::whitener`].
#[derive(Debug, Clone)]
pub struct StationaryWhitener<'a> {
    noise: &'a StationaryNoise,
    /// Row by row, the entries of A that are not 0.
    a: Vec<Vec<(usize, f64)>>,
    lanes: usize,
    /// x^, signal by signal.
    states: Vec<f64>,
    next: Vec<f64>,
    /// S, and `A S`.
    s: Vec<f64>,
    half: Vec<f64>,
    gain: Vec<f64>,
}

impl<'a> StationaryWhitener<'a> {
    pub(crate) fn new(noise: &'a StationaryNoise, lanes: usize) -> Self {
        let nu = noise.order();
        let of_row = |i: usize| {
            let row = noise.a()[i * nu..(i + 1) * nu].iter().copied();
            row.enumerate().filter(|(_, a)| *a != 0.0).collect()
        };
        Self {
            noise,
            a: (0..nu).map(of_row).collect(),
            lanes,
            states: vec![0.0; lanes * nu],
            next: vec![0.0; nu],
            s: vec![0.0; nu * nu],
            half: vec![0.0; nu * nu],
            gain: vec![0.0; nu],
        }
    }

    /// Replaces the row of samples at one instant, one value for each signal, by its whitened row, and gives the variance of its prediction
    /// from the rows before it, in that of the innovations.
    pub fn push(&mut self, row: &mut [f64]) -> f64 {
        let (nu, c) = (self.noise.order(), self.noise.c());
        let of_c = |s: &[f64]| s.iter().zip(c).map(|(s, c)| s * c).sum::<f64>();
        let known: f64 = (0..nu)
            .map(|i| c[i] * of_c(&self.s[i * nu..(i + 1) * nu]))
            .sum();
        let r0 = self.noise.variance();
        let variance = (r0 - known).max(ROUNDING * r0);
        self.multiply();
        for (i, gain) in self.gain.iter_mut().enumerate() {
            *gain = (self.noise.g()[i] - of_c(&self.half[i * nu..(i + 1) * nu])) / variance;
        }
        self.finish();
        for i in 0..nu {
            for j in 0..nu {
                self.s[i * nu + j] += variance * self.gain[i] * self.gain[j];
            }
        }
        let scale = 1.0 / variance.sqrt();
        for (lane, value) in row.iter_mut().enumerate() {
            let error = *value - of_c(&self.states[lane * nu..(lane + 1) * nu]);
            self.advance(lane, error);
            *value = error * scale;
        }
        variance
    }

    /// The row of the next instant is missing.
    pub fn skip(&mut self) {
        self.multiply();
        self.finish();
        self.gain.fill(0.0);
        for lane in 0..self.lanes {
            self.advance(lane, 0.0);
        }
    }

    /// `A S`.
    fn multiply(&mut self) {
        let nu = self.noise.order();
        for (row, half) in self.a.iter().zip(self.half.chunks_exact_mut(nu.max(1))) {
            half.fill(0.0);
            for (k, a) in row {
                let s = &self.s[k * nu..(k + 1) * nu];
                half.iter_mut().zip(s).for_each(|(half, s)| *half += a * s);
            }
        }
    }

    /// `A S A'` into S.
    fn finish(&mut self) {
        let nu = self.noise.order();
        for i in 0..nu {
            let half = &self.half[i * nu..(i + 1) * nu];
            for j in 0..=i {
                let entry: f64 = self.a[j].iter().map(|(k, a)| a * half[*k]).sum();
                self.s[i * nu + j] = entry;
                self.s[j * nu + i] = entry;
            }
        }
    }

    /// `x^+ = A x^ + k e` of a signal.
    fn advance(&mut self, lane: usize, error: f64) {
        let nu = self.noise.order();
        let state = &mut self.states[lane * nu..(lane + 1) * nu];
        for ((next, row), gain) in self.next.iter_mut().zip(&self.a).zip(&self.gain) {
            *next = row.iter().map(|(k, a)| a * state[*k]).sum::<f64>() + gain * error;
        }
        state.copy_from_slice(&self.next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ArModel;

    /// For an autoregression the result equals the exact whitening of [`ArModel`], whichever rows are missing.
    #[test]
    fn an_autoregression_is_whitened_as_by_its_own_filter() {
        let ar = ArModel::from_coefficients(&[1.2, -0.5, 0.1], 1.0).unwrap();
        let noise = StationaryNoise::of_ar(&ar);
        let values: Vec<f64> = (0..60)
            .map(|k| match k % 7 == 3 || (20..31).contains(&k) || k == 1 {
                true => f64::NAN,
                false => (0.7 * f64::from(k * k % 31)).sin(),
            })
            .collect();
        let mut whitener = noise.whitener(2);
        let mut log_det = 0.0;
        for (value, expected) in values.iter().zip(ar.whiten(&values)) {
            if value.is_nan() {
                whitener.skip();
                continue;
            }
            let mut row = [*value, 2.0 * value];
            log_det += whitener.push(&mut row).ln();
            assert!((row[0] - expected).abs() < 1e-12 && (row[1] - 2.0 * expected).abs() < 1e-12);
        }
        let expected = ar.log_det_of(values.iter().map(|v| !v.is_nan()));
        assert!((log_det - expected).abs() < 1e-10, "{log_det} {expected}");
    }
}
