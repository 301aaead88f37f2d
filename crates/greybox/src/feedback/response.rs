//! `P0`, the plant linearised once, on the columns of rows.

use std::sync::Arc;

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
