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
}

/// Largest magnitude of the eigenvalues of a matrix.
#[must_use]
pub fn spectral_radius(matrix: &DMatrix<f64>) -> f64 {
    let eigenvalues = matrix.complex_eigenvalues();
    let sizes = eigenvalues.iter().map(|value| value.norm());
    sizes.fold(0.0, f64::max)
}

impl LinearResponse {
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
}

impl Response {
    pub(crate) fn new(plant: Arc<LinearResponse>, columns: usize) -> Self {
        let states = vec![0.0; columns * plant.a.len()];
        Self {
            next: states.clone(),
            plant,
            columns,
            states,
        }
    }

    /// A record begins: its initial states have separate columns.
    pub(crate) fn reset(&mut self) {
        self.states.fill(0.0);
    }

    /// Adds the effect of earlier commands to a row of an output.
    pub(crate) fn add_to(&self, output: usize, row: &mut [f64]) {
        for &(state, coefficient) in &self.plant.outputs[output] {
            let state = &self.states[state * self.columns..];
            for (value, state) in row.iter_mut().zip(state) {
                *value += coefficient * state;
            }
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
        }
        std::mem::swap(&mut self.states, &mut self.next);
    }
}
