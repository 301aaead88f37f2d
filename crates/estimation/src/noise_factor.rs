//! The transposes of whitening and colouring.

use ct_signals::ArModel;

/// A noise model's factor `L`, of unit innovations, of the covariance `L L'` of the available samples of one record.
///
/// With the predictors `a^(m)`, `m = min(k, q)`, of the sample `k` and `s_m` their error over the innovations', `v[k] = sum_i a^(m)_i
/// v[k-i] + s_m e[k]`: `L = A^-1 S`, `A` a unit lower band and `S` diagonal. Rows of `lanes` values run along the time.
///
/// Where rows are missing, the last q values are the filter's state, the missing ones by their estimates, and both
/// transposes run the adjoint of that filter ([`ct_signals::Whitener`]) backwards. Missing rows are zero then, whatever they were.
pub(crate) struct Factor {
    predictors: Vec<Vec<f64>>,
    scales: Vec<f64>,
    /// Gains row by row from the first present one; `None` if no row is missing.
    gains: Option<Gains>,
}

/// The filter of one record, row by row.
struct Gains {
    /// Number of missing rows before the first present one.
    before: usize,
    rows: Vec<Row>,
}

enum Row {
    Missing,
    There {
        /// Standard deviation of its prediction error over the innovations'.
        scale: f64,
        /// Distance to each missing row before this one, and the gain that corrects its estimate by the prediction error.
        gains: Vec<(usize, f64)>,
    },
}

impl Gains {
    fn new(noise: &ArModel, observed: &[bool]) -> Option<Self> {
        if observed.iter().all(|there| *there) {
            return None;
        }
        let before = observed.iter().take_while(|there| !**there).count();
        let mut whitener = noise.whitener(0);
        let row = |there: &bool| {
            if !there {
                whitener.skip();
                return Row::Missing;
            }
            let scale = whitener.push_with_variance(&mut []).sqrt();
            Row::There {
                scale,
                gains: whitener.gains().collect(),
            }
        };
        Some(Self {
            before,
            rows: observed[before..].iter().map(row).collect(),
        })
    }
}

impl Factor {
    /// For a record with one entry per row: false if the reading is missing.
    pub(crate) fn new(noise: &ArModel, observed: &[bool]) -> Self {
        let reflections = noise.reflections();
        let mut scales = vec![1.0; reflections.len() + 1];
        for (m, k) in reflections.iter().enumerate().rev() {
            scales[m] = scales[m + 1] / (1.0 - k * k).sqrt();
        }
        Self {
            predictors: noise.predictors(),
            scales,
            gains: Gains::new(noise, observed),
        }
    }

    fn order(&self) -> usize {
        self.scales.len() - 1
    }

    /// `L' x` in place, backwards in time: later rows are processed first.
    pub(crate) fn colour_transposed(&self, rows: &mut [f64], lanes: usize) {
        if let Some(gains) = &self.gains {
            self.adjoint(gains, rows, lanes, true);
            return;
        }
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
        if let Some(gains) = &self.gains {
            self.adjoint(gains, rows, lanes, false);
            return;
        }
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
    /// The adjoint of the colouring or the whitening filter: the sensitivity to each row of `sum x y`, with `y` the filtered rows.
    fn adjoint(&self, filter: &Gains, rows: &mut [f64], lanes: usize, colour: bool) {
        let q = self.order();
        let (before, rows) = rows.split_at_mut(filter.before * lanes);
        before.fill(0.0);
        let mut input = vec![0.0; lanes];
        // Sensitivity to each row as a part of the state.
        let mut state = vec![0.0; rows.len()];
        for (k, row) in filter.rows.iter().enumerate().rev() {
            let (past, own) = state[..(k + 1) * lanes].split_at_mut(k * lanes);
            let out = &mut rows[k * lanes..][..lanes];
            let predictor = &self.predictors[q.min(k)];
            input.copy_from_slice(own);
            // `own`: sensitivity to the prediction of this row, which the preceding state affects.
            match row {
                Row::Missing => out.fill(0.0),
                Row::There { scale, gains } => {
                    // Converts to the prediction error.
                    let error = &mut input;
                    for (error, x) in error.iter_mut().zip(&*out) {
                        *error = if colour { *error + x } else { x / scale };
                    }
                    if colour {
                        own.copy_from_slice(error);
                    }
                    for (lag, gain) in gains {
                        let past = &past[(k - lag) * lanes..][..lanes];
                        for (error, past) in error.iter_mut().zip(past) {
                            *error += gain * past;
                        }
                    }
                    for ((out, error), own) in out.iter_mut().zip(&*error).zip(&mut *own) {
                        if colour {
                            *out = scale * error;
                        } else {
                            *out = error + *own;
                            *own = -error;
                        }
                    }
                }
            }
            for (a, past) in predictor.iter().zip(past.chunks_exact_mut(lanes).rev()) {
                for (past, own) in past.iter_mut().zip(&*own) {
                    *past += a * own;
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
        for n in [1, 2, 3, 4, 12] {
            let factor = Factor::new(&noise, &vec![true; n]);
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

    #[test]
    fn transposes_agree_with_dense_algebra_where_rows_are_missing() {
        let n = 30;
        for coefficients in [
            &[][..],
            &[0.9],
            &[1.2, -0.6, 0.25],
            &[0.3, 0.1, 0.0, -0.4, 0.2],
        ] {
            let noise = ArModel::from_coefficients(coefficients, 1.0).unwrap();
            let full = dense(&noise, n);
            for missing in [
                vec![0, 1],
                vec![1],
                vec![3, 5, 6, 7, 29],
                (0..n).filter(|k| k % 3 != 1).collect(),
                (8..22).collect(),
            ] {
                let observed: Vec<bool> = (0..n).map(|k| !missing.contains(&k)).collect();
                let there: Vec<usize> = (0..n).filter(|&k| observed[k]).collect();
                // The covariance without the rows and columns of missing samples.
                let covariance = (&full * full.transpose())
                    .select_rows(&there)
                    .select_columns(&there);
                let l = covariance.cholesky().unwrap().l();
                let x = nalgebra::DMatrix::from_fn(there.len(), 2, |i, j| {
                    ((3 * i + 7 * j) as f64).sin()
                });
                let mut rows = vec![f64::NAN; 2 * n];
                for (i, k) in there.iter().enumerate() {
                    rows[2 * k] = x[(i, 0)];
                    rows[2 * k + 1] = x[(i, 1)];
                }
                let check = |rows: &[f64], expected: &nalgebra::DMatrix<f64>| {
                    for (i, k) in there.iter().enumerate() {
                        for j in 0..2 {
                            let (ours, dense) = (rows[2 * k + j], expected[(i, j)]);
                            assert_relative_eq!(ours, dense, max_relative = 1e-10, epsilon = 1e-11);
                        }
                    }
                    for k in &missing {
                        assert_eq!(rows[2 * k..2 * k + 2], [0.0, 0.0]);
                    }
                };
                let factor = Factor::new(&noise, &observed);
                let mut coloured = rows.clone();
                factor.colour_transposed(&mut coloured, 2);
                check(&coloured, &(l.transpose() * &x));
                let mut whitened = rows;
                factor.whiten_transposed(&mut whitened, 2);
                check(
                    &whitened,
                    &l.transpose().try_inverse().map(|i| i * &x).unwrap(),
                );
                factor.colour_transposed(&mut whitened, 2);
                check(&whitened, &x);
            }
        }
    }
}
