//! `P0`, the plant linearised once, on the columns of rows.

use std::sync::Arc;

use nalgebra::DMatrix;
use plants::controller::Controller;

/// A plant linearised over one sampling interval: `x+ = A x + sum_d b_d u_d`, with a column for each input that a controller drives.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LinearResponse {
    /// A, row by row.
    pub a: Vec<Vec<f64>>,
    /// b of each driven input.
    pub b: Vec<Vec<f64>>,
    /// For each output the states that it contains, and their coefficients.
    pub outputs: Vec<Vec<(usize, f64)>>,
    /// Gain from each output to each state, row by row, with which the response of an unstable plant follows the residual
    /// ([`LinearResponse::following`]); empty for others.
    pub gain: Vec<Vec<f64>>,
}

/// Growth of the states, as a power of e, over which the Riccati equation is followed: then the first covariance is forgotten.
const FORGOTTEN: f64 = 30.0;
/// Largest number of its steps.
const MOST_STEPS: f64 = 20_000.0;
/// Relative change of each state's gain in one step, below which it has converged; and what an eigenvalue may be above one.
const CONVERGED: f64 = 1e-7;

/// Largest magnitude of the eigenvalues of a matrix.
#[must_use]
pub fn spectral_radius(matrix: &DMatrix<f64>) -> f64 {
    let eigenvalues = matrix.complex_eigenvalues();
    let sizes = eigenvalues.iter().map(|value| value.norm());
    sizes.fold(0.0, f64::max)
}

impl LinearResponse {
    /// That of a model without any.
    pub(crate) fn none(outputs: usize) -> Self {
        Self {
            a: Vec::new(),
            b: Vec::new(),
            outputs: vec![Vec::new(); outputs],
            gain: Vec::new(),
        }
    }

    /// Growth of a deviation in one sampling interval, as a power of e: not above zero for a stable plant.
    pub(crate) fn growth(&self) -> f64 {
        let n = self.a.len();
        spectral_radius(&DMatrix::from_fn(n, n, |i, j| self.a[i][j])).ln()
    }

    /// The response of an unstable plant with a gain that makes it stable: that of a Kalman filter for noise of these standard deviations at
    /// the driven inputs and the outputs. Without noise at the inputs it moves the unstable eigenvalues to their inverses and leaves all
    /// others. `None` if no such gain is found: no output shows what grows.
    ///
    /// **Reference**: B. D. O. Anderson, J. B. Moore, Optimal Filtering (1979), section 4.4.
    pub(crate) fn following(&self, inputs: &[f64], outputs: &[f64]) -> Option<Self> {
        let n = self.a.len();
        if n == 0 {
            return None;
        }
        let a = DMatrix::from_fn(n, n, |i, j| self.a[i][j]);
        let b = DMatrix::from_fn(n, self.b.len(), |i, d| self.b[d][i] * inputs[d]);
        let mut c = DMatrix::<f64>::zeros(outputs.len(), n);
        for (o, of) in self.outputs.iter().enumerate() {
            for &(state, coefficient) in of {
                // In standard deviations of the output's noise.
                c[(o, state)] = coefficient / outputs[o];
            }
        }
        let of_states = &b * b.transpose();
        let one = DMatrix::identity(n, n);
        let mut p = DMatrix::<f64>::identity(n, n);
        let mut gain = DMatrix::zeros(n, outputs.len());
        // What grows forgets the first covariance, in whatever units.
        let steps = (FORGOTTEN / self.growth()).ceil().clamp(1.0, MOST_STEPS) as usize;
        for _ in 0..steps {
            let innovation =
                &c * &p * c.transpose() + DMatrix::identity(outputs.len(), outputs.len());
            let filter = innovation.cholesky()?.solve(&(&c * &p)).transpose();
            // Joseph's form: the covariance of the corrected states stays positive.
            let rest = &one - &filter * &c;
            let corrected = &rest * &p * rest.transpose() + &filter * filter.transpose();
            p = &a * corrected * a.transpose() + &of_states;
            let next = &a * filter;
            let is_settled = next
                .row_iter()
                .zip(gain.row_iter())
                .all(|(next, gain): (_, _)| (next - gain).amax() <= CONVERGED * next.amax());
            gain = next;
            if is_settled {
                break;
            }
        }
        let radius = spectral_radius(&(&a - &gain * &c));
        if !gain.iter().all(|value| value.is_finite()) || radius > 1.0 + CONVERGED {
            return None;
        }
        let gain = gain.row_iter().map(|row| {
            let of_outputs = row.iter().zip(outputs);
            of_outputs
                .map(|(gain, deviation)| gain / deviation)
                .collect()
        });
        Some(Self {
            gain: gain.collect(),
            ..self.clone()
        })
    }

    /// The matrix of the linear loop over one sampling interval, without limits and dead times: of the plant and a controller for each driven
    /// input, in their order, or of the plant alone.
    pub(crate) fn in_loop<'c>(
        &self,
        controllers: impl IntoIterator<Item = &'c Controller>,
        interval: f64,
    ) -> DMatrix<f64> {
        let linear = controllers.into_iter();
        let linear: Vec<_> = linear
            .map(|of| (of.output(), of.linear(interval)))
            .collect();
        let n = self.a.len();
        let all = n + linear.iter().map(|(_, own)| own.b.len()).sum::<usize>();
        let mut matrix = DMatrix::<f64>::zeros(all, all);
        for (i, row) in self.a.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                matrix[(i, j)] = *value;
            }
        }
        // States x of the plant, then z of each controller: e = -(C x), u = c z + d e.
        let mut at = n;
        for ((output, own), b) in linear.iter().zip(&self.b) {
            let m = own.b.len();
            for &(j, c) in &self.outputs[*output] {
                for i in 0..n {
                    matrix[(i, j)] -= b[i] * own.d * c;
                }
                for i in 0..m {
                    matrix[(at + i, j)] -= own.b[i] * c;
                }
            }
            for i in 0..n {
                for j in 0..m {
                    matrix[(i, at + j)] = b[i] * own.c[j];
                }
            }
            for i in 0..m {
                // A constant for an operating point is not a part of the loop.
                let row = &own.a[i];
                let constant = own.b[i] == 0.0 && (0..m).all(|j| row[j] == f64::from(i == j));
                for j in 0..m {
                    matrix[(at + i, at + j)] = if constant { 0.0 } else { row[j] };
                }
            }
            at += m;
        }
        matrix
    }
}

/// `P0` on the columns of rows. States are kept row by row, a column beside the other, so that all columns take a step at once.
pub(crate) struct Response {
    plant: Arc<LinearResponse>,
    columns: usize,
    states: Vec<f64>,
    next: Vec<f64>,
    /// The present rows of the outputs, those that the states follow; empty without a gain.
    followed: Vec<f64>,
}

impl Response {
    pub(crate) fn new(plant: Arc<LinearResponse>, columns: usize) -> Self {
        let states = vec![0.0; columns * plant.a.len()];
        let followed = match plant.gain.is_empty() {
            true => Vec::new(),
            false => vec![0.0; columns * plant.outputs.len()],
        };
        Self {
            next: states.clone(),
            followed,
            plant,
            columns,
            states,
        }
    }

    /// A record begins: its initial states have separate columns.
    pub(crate) fn reset(&mut self) {
        self.states.fill(0.0);
    }

    /// Adds the effect of earlier commands to a row of an output; `missing`: it has no reading, and the states do not follow it.
    pub(crate) fn add_to(&mut self, output: usize, row: &mut [f64], missing: bool) {
        for &(state, coefficient) in &self.plant.outputs[output] {
            let state = &self.states[state * self.columns..];
            for (value, state) in row.iter_mut().zip(state) {
                *value += coefficient * state;
            }
        }
        let mut followed = self.followed.chunks_exact_mut(self.columns);
        match followed.nth(output) {
            Some(followed) if missing => followed.fill(0.0),
            Some(followed) => followed.copy_from_slice(row),
            None => {}
        }
    }

    /// A step under the commands of a row: the columns of the first driven input, then those of the next one.
    pub(crate) fn advance(&mut self, commands: &[f64]) {
        let n = self.columns;
        for (i, next) in self.next.chunks_exact_mut(n).enumerate() {
            next.fill(0.0);
            let states = self.states.chunks_exact(n).zip(&self.plant.a[i]);
            let driven = self.plant.b.iter().map(|b| &b[i]);
            let commands = commands.chunks_exact(n).zip(driven);
            for (column, &coefficient) in states.chain(commands) {
                for (next, value) in next.iter_mut().zip(column) {
                    *next += coefficient * value;
                }
            }
            let gains = self.plant.gain.get(i).into_iter().flatten();
            for (row, &gain) in self.followed.chunks_exact(n).zip(gains) {
                for (next, value) in next.iter_mut().zip(row) {
                    *next -= gain * value;
                }
            }
        }
        std::mem::swap(&mut self.states, &mut self.next);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A pendulum, its speed and a state that nothing reads or moves; the position in another unit.
    fn pendulum(unit: f64) -> LinearResponse {
        LinearResponse {
            a: vec![
                vec![1.001, 0.01 / unit, 0.0],
                vec![0.4 * unit, 0.994, 0.0],
                vec![0.0, 0.0, 1.0],
            ],
            b: vec![vec![0.0007 / unit, 0.13, 0.0]],
            outputs: vec![vec![(0, 1.0)]],
            gain: Vec::new(),
        }
    }

    fn eigenvalues(of: &LinearResponse) -> Vec<f64> {
        let n = of.a.len();
        let closed = DMatrix::from_fn(n, n, |i, j| {
            of.a[i][j] - if j == 0 { of.gain[i][0] } else { 0.0 }
        });
        let mut found: Vec<f64> = closed.complex_eigenvalues().iter().map(|e| e.re).collect();
        found.sort_by(f64::total_cmp);
        found
    }

    /// Without noise at the inputs the unstable eigenvalue becomes its inverse, whatever the units are.
    #[test]
    fn the_gain_mirrors_the_unstable_eigenvalue() {
        let unstable = pendulum(1.0).growth().exp();
        // The product of the two is the determinant.
        let stable = (1.001 * 0.994 - 0.01 * 0.4) / unstable;
        for unit in [1.0, 1e-3, 1e-6, 1e4] {
            let found = pendulum(unit).following(&[0.0], &[0.1 / unit]).unwrap();
            let mut expected = [1.0 / unstable, stable, 1.0];
            expected.sort_by(f64::total_cmp);
            for (found, expected) in eigenvalues(&found).iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-4,
                    "{unit}: {found} {expected}"
                );
            }
        }
    }

    /// With noise at the inputs too.
    #[test]
    fn the_gain_does_not_depend_on_units() {
        let of = |unit: f64| {
            let found = pendulum(unit).following(&[2.0], &[0.1 / unit]).unwrap();
            [found.gain[0][0], found.gain[1][0] / unit]
        };
        let expected = of(1.0);
        for unit in [1e-6, 1e4] {
            for (found, expected) in of(unit).iter().zip(expected) {
                assert!(
                    (found / expected - 1.0).abs() < 1e-4,
                    "{unit}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn what_no_output_shows_has_no_gain() {
        let mut hidden = pendulum(1.0);
        hidden.outputs = vec![vec![(2, 1.0)]];
        assert!(hidden.following(&[0.0], &[0.1]).is_none());
        assert!(LinearResponse::none(1).following(&[0.0], &[0.1]).is_none());
    }
}
