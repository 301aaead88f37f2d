//! R factor of each output, and weights from the outputs' residuals.

use serde::{Deserialize, Serialize};

use super::Triangle;
use crate::Squares;

/// The rows of each output, not weighted.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Outputs {
    triangles: Vec<Triangle>,
    /// The rows of priors, in standard errors.
    priors: Triangle,
    /// Weights of the outputs, from the sums of squared residuals.
    pub(super) squares: Squares,
}

/// The weights are updated at most this number of times in a step, or until they change by less than this share.
pub(super) const ROUNDS: usize = 20;

pub(super) const SAME_WEIGHTS: f64 = 1e-3;

impl Triangle {
    /// The R factor of the rows of all outputs and of the priors, each times its weight by `squares`: for a single output without priors,
    /// its own R factor.
    #[must_use]
    pub(crate) fn of_outputs(
        mut triangles: Vec<Self>,
        prior_rows: &[Vec<f64>],
        squares: Squares,
    ) -> Self {
        if triangles.len() == 1 && prior_rows.is_empty() {
            return triangles.remove(0);
        }
        let mut priors = Self::new(triangles.first().map_or(0, Self::columns));
        for row in prior_rows {
            priors.push(row);
        }
        priors.finish();
        let outputs = Outputs {
            triangles,
            priors,
            squares,
        };
        let squares = &outputs.squares;
        let mut all = outputs.weighted(&squares.weights(), squares.prior_weight());
        all.outputs = Some(Box::new(outputs));
        all
    }

    /// The same rows with another weight of the priors' rows.
    #[must_use]
    pub(crate) fn with_prior_weight(self, weight: f64) -> Self {
        match self.outputs {
            Some(outputs) if outputs.priors.rows() > 0 => {
                let mut all = outputs.weighted(&outputs.squares.weights(), weight);
                all.outputs = Some(outputs);
                all
            }
            _ => self,
        }
    }

    pub(super) fn solve_weighted(&self, free: &[usize], scale: &[f64], damping: f64) -> Vec<f64> {
        let p = free.len();
        let mut order = free.to_vec();
        order.push(self.columns - 1);
        let mut system = self.select(&order);
        if damping > 0.0 {
            system.damp(free.iter().map(|&j| scale[j]), damping);
        }
        let mut x = vec![0.0; p];
        for i in (0..p).rev() {
            let diagonal = system.at(i, i);
            let rest: f64 = (i + 1..p).map(|j| system.at(i, j) * x[j]).sum();
            if diagonal.abs() > 1e-14 * system.column_norm(i) {
                x[i] = (system.at(i, p) - rest) / diagonal;
            }
        }
        let mut all = vec![0.0; self.columns - 1];
        for (value, &j) in x.iter().zip(free) {
            all[j] = *value;
        }
        all
    }
}

impl Outputs {
    /// Predicted sums of squares of each output and of the priors after a step.
    pub(super) fn left(&self, x: &[f64]) -> Squares {
        let mut squares = self.squares.clone().with_prior(self.priors.left(x));
        for (sum, triangle) in squares.sums.iter_mut().zip(&self.triangles) {
            *sum = triangle.left(x);
        }
        squares
    }

    /// The R factor of all rows, with those of each output and those of the priors times their weight.
    pub(super) fn weighted(&self, weights: &[f64], of_priors: f64) -> Triangle {
        let columns = self.priors.columns();
        let mut all = Triangle::new(columns);
        let mut row = vec![0.0; columns];
        let mut add = |triangle: &Triangle, weight: f64| {
            for i in 0..columns {
                for (j, to) in row.iter_mut().enumerate() {
                    *to = weight * triangle.at(i, j);
                }
                all.push(&row);
            }
        };
        for (triangle, weight) in self.triangles.iter().zip(weights) {
            add(triangle, *weight);
        }
        let mut rows = self.triangles.iter().map(Triangle::rows).sum();
        if self.priors.rows() > 0 {
            add(&self.priors, of_priors);
            rows += self.priors.rows();
        }
        all.finish();
        all.rows = rows;
        all
    }
}
