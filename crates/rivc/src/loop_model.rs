//! The input of a loop, simulated from its reference: the first step of a two-step method that makes instruments without a known controller.
//!
//! Model: `u[k] = sum_i a_i u[k-i] + sum_i b_i r[k-i] + c + e[k]`, i to q, by least squares; the order q has the least `N log sum e^2 + k
//! log N` of those that are stable. Its simulation from r alone is free of noise, except for the share k/N of the noise power that k
//! coefficients fit.
//!
//! Assumptions: r is independent of the noise; the loop is linear. A nonlinear loop increases the variance, but causes no bias.
//!
//! Cost: O(N q^2).
//!
//! Reference: P. C. Young, H. Garnier, M. Gilson, Simple refined IV methods of closed-loop system identification, 15th IFAC Symposium on
//! System Identification, 2009.

use nalgebra::{DMatrix, DVector};

/// Orders that are tried.
const ORDERS: [usize; 5] = [2, 4, 8, 14, 20];
/// Samples for each coefficient that are needed.
const SAMPLES_PER_COEFFICIENT: usize = 10;
/// Weight on each coefficient, over the number of samples, for signals of size 1.
const RIDGE: f64 = 1e-10;
/// A simulation further from its mean than this many times the size of the measured input is unstable.
const FAR: f64 = 30.0;

#[derive(Debug, Clone)]
pub(crate) struct LoopModel {
    order: usize,
    /// Coefficients of u, of r from the present value on, and the constant, for signals that are centred and scaled to 1.
    coefficients: Vec<f64>,
    u: Scale,
    r: Scale,
}

/// Mean and root mean square about it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    mean: f64,
    pub(crate) size: f64,
}

impl Scale {
    pub(crate) fn of(values: &[f64]) -> Self {
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        Self {
            mean,
            size: square.sqrt().max(f64::MIN_POSITIVE),
        }
    }

    fn scaled(self, values: &[f64]) -> Vec<f64> {
        values.iter().map(|v| (v - self.mean) / self.size).collect()
    }
}

impl LoopModel {
    /// Samples that the smallest model needs.
    pub(crate) const NEEDED: usize = SAMPLES_PER_COEFFICIENT * (2 * ORDERS[0] + 2) + ORDERS[0];

    /// `None` if no model is stable, or if the record is too short.
    pub(crate) fn fit(r: &[f64], u: &[f64]) -> Option<Self> {
        let scales = (Scale::of(u), Scale::of(r));
        let scaled = (scales.0.scaled(u), scales.1.scaled(r));
        let fits =
            |order: &&usize| u.len() >= SAMPLES_PER_COEFFICIENT * (2 * **order + 2) + **order;
        let orders: Vec<usize> = ORDERS.iter().filter(fits).copied().collect();
        // All orders are compared on the same rows.
        let from = *orders.last()?;
        let mut best: Option<(f64, Self)> = None;
        for order in orders {
            let Some((model, squares)) = Self::of_order(order, from, &scaled, scales) else {
                continue;
            };
            let simulated = model.of_scaled(&scaled.1, scaled.0[0]);
            if !simulated.iter().all(|v| v.abs() <= FAR) {
                continue;
            }
            let rows = (u.len() - from) as f64;
            let variance = (squares / rows).max(f64::EPSILON.powi(2));
            let criterion = rows * variance.ln() + (2 * order + 2) as f64 * rows.ln();
            if best.as_ref().is_none_or(|(least, _)| criterion < *least) {
                best = Some((criterion, model));
            }
        }
        best.map(|(_, model)| model)
    }

    fn of_order(
        order: usize,
        from: usize,
        (u, r): &(Vec<f64>, Vec<f64>),
        (of_u, of_r): (Scale, Scale),
    ) -> Option<(Self, f64)> {
        let size = 2 * order + 2;
        let mut normal = DMatrix::zeros(size, size);
        let mut right = DVector::zeros(size);
        let mut power = 0.0;
        let mut row = vec![0.0; size];
        for k in from..u.len() {
            for i in 1..=order {
                row[i - 1] = u[k - i];
            }
            for i in 0..=order {
                row[order + i] = r[k - i];
            }
            row[size - 1] = 1.0;
            for (i, a) in row.iter().enumerate() {
                right[i] += a * u[k];
                for (j, b) in row.iter().enumerate().take(i + 1) {
                    normal[(i, j)] += a * b;
                }
            }
            power += u[k] * u[k];
        }
        // References of few steps leave some coefficients without effect: a small weight on all of them decides.
        let weight = RIDGE * u.len() as f64;
        for i in 0..size {
            normal[(i, i)] += weight;
        }
        let solution = normal.cholesky()?.solve(&right);
        let squares = power - solution.dot(&right);
        let model = Self {
            order,
            coefficients: solution.iter().copied().collect(),
            u: of_u,
            r: of_r,
        };
        Some((model, squares))
    }

    /// Simulation from the reference alone; before the record, reference and input are assumed to have their first values.
    pub(crate) fn simulate(&self, r: &[f64], first: f64) -> Vec<f64> {
        let first = (first - self.u.mean) / self.u.size;
        let mut simulated = self.of_scaled(&self.r.scaled(r), first);
        for value in &mut simulated {
            *value = self.u.mean + self.u.size * *value;
        }
        simulated
    }

    fn of_scaled(&self, r: &[f64], first: f64) -> Vec<f64> {
        let (of_u, of_r) = self.coefficients.split_at(self.order);
        let mut simulated: Vec<f64> = Vec::with_capacity(r.len());
        for k in 0..r.len() {
            let past = |values: &[f64], i: usize, before: f64| match k.checked_sub(i) {
                Some(at) => values[at],
                None => before,
            };
            let mut value = of_r[self.order + 1];
            for (i, a) in of_u.iter().enumerate() {
                value += a * past(&simulated, i + 1, first);
            }
            for (i, b) in of_r[..=self.order].iter().enumerate() {
                value += b * past(r, i, r[0]);
            }
            simulated.push(value);
        }
        simulated
    }
}
