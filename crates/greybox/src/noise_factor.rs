//! The transposes of whitening and colouring.

use ct_signals::ArModel;

/// A noise model's factor `L`, of unit innovations, of the covariance `L L'` of one record, seen from its end.
///
/// With the predictors `a^(m)`, `m = min(k, q)`, of the sample `k` and `s_m` their error over the innovations',
/// `v[k] = sum_i a^(m)_i v[k-i] + s_m e[k]`: `L = A^-1 S`, `A` a unit lower band and `S` diagonal. Rows of `lanes`
/// values run along the time.
pub(crate) struct Factor {
    predictors: Vec<Vec<f64>>,
    scales: Vec<f64>,
}

impl Factor {
    pub(crate) fn new(noise: &ArModel) -> Self {
        let reflections = noise.reflections();
        let mut scales = vec![1.0; reflections.len() + 1];
        for (m, k) in reflections.iter().enumerate().rev() {
            scales[m] = scales[m + 1] / (1.0 - k * k).sqrt();
        }
        Self {
            predictors: noise.predictors(),
            scales,
        }
    }

    fn order(&self) -> usize {
        self.scales.len() - 1
    }

    /// `L' x` in place: the rows that follow are known when a row's turn comes, backwards in time.
    pub(crate) fn colour_transposed(&self, rows: &mut [f64], lanes: usize) {
        let (n, q) = (rows.len() / lanes, self.order());
        for k in (0..n).rev() {
            let (upto, later) = rows.split_at_mut((k + 1) * lanes);
            let own = &mut upto[k * lanes..];
            for (lag, row) in (1..=q).zip(later.chunks_exact(lanes)) {
                if let Some(a) = self.predictors[q.min(k + lag)].get(lag - 1) {
                    for (x, z) in own.iter_mut().zip(row) {
                        *x += a * z;
                    }
                }
            }
        }
        for (row, scale) in rows.chunks_exact_mut(lanes).zip(&self.scales[..q]) {
            for x in row {
                *x *= scale;
            }
        }
    }

    /// `L^-T x` in place.
    pub(crate) fn whiten_transposed(&self, rows: &mut [f64], lanes: usize) {
        let (n, q) = (rows.len() / lanes, self.order());
        for (row, scale) in rows.chunks_exact_mut(lanes).zip(&self.scales[..q]) {
            for x in row {
                *x /= scale;
            }
        }
        for k in 0..n {
            let (upto, later) = rows.split_at_mut((k + 1) * lanes);
            let own = &mut upto[k * lanes..];
            for (lag, row) in (1..=q).zip(later.chunks_exact(lanes)) {
                if let Some(a) = self.predictors[q.min(k + lag)].get(lag - 1) {
                    for (x, y) in own.iter_mut().zip(row) {
                        *x -= a * y;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// `L` column by column: the whitener inverted on the unit vectors.
    fn dense(noise: &ArModel, n: usize) -> nalgebra::DMatrix<f64> {
        let mut inverse = nalgebra::DMatrix::zeros(n, n);
        for j in 0..n {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            inverse.set_column(j, &nalgebra::DVector::from_vec(noise.whiten(&unit)));
        }
        inverse.try_inverse().unwrap()
    }

    #[test]
    fn transposes_agree_with_dense_algebra() {
        let noise = ArModel::from_coefficients(&[1.2, -0.6, 0.25], 1.0).unwrap();
        let factor = Factor::new(&noise);
        for n in [1, 2, 3, 4, 12] {
            let l = dense(&noise, n);
            let x = nalgebra::DMatrix::from_fn(n, 2, |i, j| ((3 * i + 7 * j) as f64).sin());
            let mut rows: Vec<f64> = x.transpose().iter().copied().collect();
            factor.colour_transposed(&mut rows, 2);
            let expected = (l.transpose() * &x).transpose();
            for (a, b) in rows.iter().zip(expected.iter()) {
                assert_relative_eq!(a, b, max_relative = 1e-12, epsilon = 1e-13);
            }
            factor.whiten_transposed(&mut rows, 2);
            for (a, b) in rows.iter().zip(x.transpose().iter()) {
                assert_relative_eq!(a, b, max_relative = 1e-12, epsilon = 1e-13);
            }
        }
    }
}
