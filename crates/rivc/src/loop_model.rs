//! The input of a loop as its reference explains it: the first of two steps, which makes instruments without knowing the controller.
//!
//! Model: `u[k] = sum_i a_i u[k-i] + sum_i b_i r[k-i] + c + e[k]`, i to q, by least squares; the order q has the least
//! `N log sum e^2 + k log N` of those that are stable. Its simulation from r alone is free of the noise, but for what k coefficients can fit
//! of it, k/N of its power.
//!
//! Assumptions: r owes nothing to the noise; the loop is linear. A loop that is not, or noise that is, costs efficiency, and no bias.
//!
//! Cost: O(N q^2).
//!
//! Reference: P. C. Young, H. Garnier, M. Gilson, Simple refined IV methods of closed-loop system identification, 15th IFAC Symposium on
//! System Identification, 2009.

use nalgebra::{DMatrix, DVector};

use crate::Error;

/// Orders that are tried.
const ORDERS: [usize; 5] = [2, 4, 8, 14, 20];
/// Samples for each coefficient that are needed.
const SAMPLES_PER_COEFFICIENT: usize = 10;
/// A simulation further from its mean than so many times the measured input is not stable.
const FAR: f64 = 10.0;

#[derive(Debug, Clone)]
pub(crate) struct LoopModel {
    order: usize,
    /// Of u, of r from the present value on, and the constant.
    coefficients: Vec<f64>,
}

impl LoopModel {
    pub(crate) fn fit(references: &[&[f64]], inputs: &[&[f64]]) -> Result<Self, Error> {
        let samples: usize = inputs.iter().map(|u| u.len()).sum();
        let mut best: Option<(f64, Self)> = None;
        for order in ORDERS {
            let size = 2 * order + 2;
            if samples < SAMPLES_PER_COEFFICIENT * size {
                break;
            }
            let Some((model, squares, rows)) = Self::of_order(order, references, inputs) else {
                continue;
            };
            let pairs = references.iter().zip(inputs);
            if !pairs.into_iter().all(|(r, u)| model.stays(r, u)) {
                continue;
            }
            let rows = rows as f64;
            let variance = (squares / rows).max(f64::MIN_POSITIVE);
            let criterion = rows * variance.ln() + size as f64 * rows.ln();
            if best.as_ref().is_none_or(|(least, _)| criterion < *least) {
                best = Some((criterion, model));
            }
        }
        best.map(|(_, model)| model).ok_or(Error::NoLoopModel)
    }

    fn of_order(
        order: usize,
        references: &[&[f64]],
        inputs: &[&[f64]],
    ) -> Option<(Self, f64, usize)> {
        let size = 2 * order + 2;
        let mut normal = DMatrix::zeros(size, size);
        let mut right = DVector::zeros(size);
        let (mut power, mut rows) = (0.0, 0);
        let mut row = vec![0.0; size];
        for (r, u) in references.iter().zip(inputs) {
            // About their means, so that the equations are well conditioned.
            let (r_mean, u_mean) = (mean(r), mean(u));
            for k in order..u.len() {
                for i in 1..=order {
                    row[i - 1] = u[k - i] - u_mean;
                }
                for i in 0..=order {
                    row[order + i] = r[k - i] - r_mean;
                }
                row[size - 1] = 1.0;
                let target = u[k] - u_mean;
                for (i, a) in row.iter().enumerate() {
                    right[i] += a * target;
                    for (j, b) in row.iter().enumerate().take(i + 1) {
                        normal[(i, j)] += a * b;
                    }
                }
                power += target * target;
                rows += 1;
            }
        }
        // References of few steps leave some coefficients without effect: a small weight on all of them decides.
        let ridge = 1e-10 * normal.diagonal().max();
        for i in 0..size {
            normal[(i, i)] += ridge;
        }
        let solution = normal.cholesky()?.solve(&right);
        let squares = power - solution.dot(&right);
        let model = Self {
            order,
            coefficients: solution.iter().copied().collect(),
        };
        Some((model, squares, rows))
    }

    /// From the reference alone; before the record reference and input stand at their first values.
    pub(crate) fn simulate(&self, r: &[f64], u: &[f64]) -> Vec<f64> {
        let (r_mean, u_mean) = (mean(r), mean(u));
        let first = |values: &[f64], mean: f64| values.first().map_or(0.0, |v| v - mean);
        let (of_u, of_r) = self.coefficients.split_at(self.order);
        let mut simulated: Vec<f64> = Vec::with_capacity(r.len());
        for k in 0..r.len() {
            let past = |values: &[f64], i: usize, before: f64| match k.checked_sub(i) {
                Some(at) => values[at],
                None => before,
            };
            let mut value = of_r[self.order + 1];
            for (i, a) in of_u.iter().enumerate() {
                value += a * past(&simulated, i + 1, first(u, u_mean));
            }
            for (i, b) in of_r[..=self.order].iter().enumerate() {
                value += b * (past(r, i, r[0]) - r_mean);
            }
            simulated.push(value);
        }
        for value in &mut simulated {
            *value += u_mean;
        }
        simulated
    }

    fn stays(&self, r: &[f64], u: &[f64]) -> bool {
        let u_mean = mean(u);
        let size = u.iter().map(|u| (u - u_mean).abs()).fold(0.0, f64::max);
        let simulated = self.simulate(r, u);
        simulated.iter().all(|v| (v - u_mean).abs() <= FAR * size)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
