//! Recursive least squares by QR factorisation: an upper triangle R that is updated with rows, in `O(p^2)` memory.

mod determined;
mod outputs;
mod signature;

use serde::{Deserialize, Serialize};

use self::outputs::{Outputs, ROUNDS, SAME_WEIGHTS};
pub use self::signature::Signature;
use crate::Squares;

/// Rows are collected in blocks and processed by Householder reflections.
const BLOCK: usize = 128;
/// Share of a step that has to be within the bounds of its parameter.
const ROOM: f64 = 0.01;

/// The triangular factor `R` of all rows pushed so far: `R'R = sum row row'`. Each row is `[j_1 .. j_p, r]`, so the
/// last column holds the residual's coordinates.
///
/// Unlike the normal equations it does not square the condition number. Folding costs about `2 (p+1)^2`
/// operations a row.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Triangle {
    columns: usize,
    /// Upper triangle, row by row.
    r: Vec<f64>,
    /// Rows that are not processed yet, column by column.
    block: Vec<f64>,
    filled: usize,
    /// Work memory: the product of each column of the block with the pivot's column.
    products: Vec<f64>,
    rows: usize,
    /// With several outputs, or with priors: the R factor of each, because their weights depend on the residuals.
    outputs: Option<Box<Outputs>>,
}

impl Triangle {
    /// `columns` includes the residual's column.
    #[must_use]
    pub fn new(columns: usize) -> Self {
        Self {
            columns,
            r: vec![0.0; columns * columns],
            block: vec![0.0; columns * BLOCK],
            filled: 0,
            products: vec![0.0; columns],
            rows: 0,
            outputs: None,
        }
    }

    /// Number of columns, the residual's included.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows pushed.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Adds one row; it has [`Triangle::columns`] entries.
    pub fn push(&mut self, row: &[f64]) {
        for (column, value) in self.block.chunks_exact_mut(BLOCK).zip(row) {
            column[self.filled] = *value;
        }
        self.filled += 1;
        self.rows += 1;
        if self.filled == BLOCK {
            self.fold();
        }
    }

    /// Adds rows that are given column by column: each of [`Triangle::columns`] slices, the residual's last, has one entry per row.
    pub fn push_columns(&mut self, columns: &[&[f64]]) {
        let rows = columns.first().map_or(0, |column| column.len());
        let mut from = 0;
        while from < rows {
            let take = (BLOCK - self.filled).min(rows - from);
            for (own, column) in self.block.chunks_exact_mut(BLOCK).zip(columns) {
                own[self.filled..][..take].copy_from_slice(&column[from..][..take]);
            }
            self.filled += take;
            from += take;
            if self.filled == BLOCK {
                self.fold();
            }
        }
        self.rows += rows;
    }

    fn fold(&mut self) {
        let n = self.columns;
        let filled = std::mem::take(&mut self.filled);
        let Some((mut pivot, mut rest)) = self.block.split_at_mut_checked(BLOCK) else {
            return;
        };
        // One pass over a column applies one reflection and computes the product for the next one.
        let products = &mut self.products;
        products[0] = dot(&pivot[..filled], &pivot[..filled]);
        for (product, column) in products[1..].iter_mut().zip(rest.chunks_exact(BLOCK)) {
            *product = dot(&pivot[..filled], &column[..filled]);
        }
        for j in 0..n {
            let r = &mut self.r[j * n..][..n];
            let (diagonal, below) = (r[j], products[j]);
            let norm = (diagonal * diagonal + below).sqrt();
            let (v0, scale) = if below == 0.0 {
                (0.0, 0.0)
            } else {
                r[j] = if diagonal > 0.0 { -norm } else { norm };
                (diagonal - r[j], 1.0 / (norm * (norm + diagonal.abs())))
            };
            let mut factor = |k: usize, product: f64| {
                let factor = (v0 * r[k] + product) * scale;
                r[k] -= factor * v0;
                factor
            };
            let Some((next, after)) = rest.split_at_mut_checked(BLOCK) else {
                break;
            };
            let (v, own) = (&pivot[..filled], &mut next[..filled]);
            subtract(own, factor(j + 1, products[j + 1]), v);
            products[j + 1] = dot(own, own);
            let others = products.iter_mut().enumerate().skip(j + 2);
            for ((k, product), column) in others.zip(after.chunks_exact_mut(BLOCK)) {
                *product = subtract_and_dot(&mut column[..filled], factor(k, *product), v, own);
            }
            (pivot, rest) = (next, after);
        }
    }

    /// Processes the remaining rows; call it before reading the factor.
    pub fn finish(&mut self) {
        if self.filled > 0 {
            self.fold();
        }
    }

    /// `R[i][j]`; zero below the diagonal.
    #[must_use]
    pub fn at(&self, i: usize, j: usize) -> f64 {
        if j < i {
            0.0
        } else {
            self.r[i * self.columns + j]
        }
    }

    /// The Euclidean norm of column `j` of all rows.
    #[must_use]
    pub fn column_norm(&self, j: usize) -> f64 {
        (0..=j).map(|i| self.at(i, j).powi(2)).sum::<f64>().sqrt()
    }

    /// The cost: the sum of squares of the last column or, for several outputs, [`Squares::cost`].
    #[must_use]
    pub fn cost(&self) -> f64 {
        if let Some(outputs) = &self.outputs {
            return outputs.squares.cost();
        }
        self.column_norm(self.columns - 1).powi(2)
    }

    /// `(J' r)_j`: minus half the cost's gradient.
    #[must_use]
    pub fn descent(&self, j: usize) -> f64 {
        (0..=j)
            .map(|i| self.at(i, j) * self.at(i, self.columns - 1))
            .sum()
    }

    /// The R factor of the same rows with selected columns in this order; the residual may be among them.
    #[must_use]
    pub fn select(&self, order: &[usize]) -> Self {
        let mut chosen = Self::new(order.len());
        let mut row = vec![0.0; order.len()];
        for i in 0..self.columns {
            for (to, &j) in row.iter_mut().zip(order) {
                *to = self.at(i, j);
            }
            chosen.push(&row);
        }
        chosen.finish();
        chosen.rows = self.rows;
        chosen
    }

    /// Minimises `|J x - r|^2 + damping sum_j (scale_j x_j)^2` over the `free` parameters; the others stay zero.
    /// Directions without influence on any row stay zero too. The weights of the outputs come from
    /// their residuals there, not here (iteratively reweighted least squares).
    #[must_use]
    pub fn solve(&self, free: &[usize], scale: &[f64], damping: f64) -> Vec<f64> {
        let mut step = self.solve_weighted(free, scale, damping);
        let Some(outputs) = &self.outputs else {
            return step;
        };
        let all = |squares: &Squares| {
            let mut weights = squares.weights();
            weights.push(squares.prior_weight());
            weights
        };
        let mut weights = all(&outputs.squares);
        for _ in 0..ROUNDS {
            let left = outputs.left(&step);
            let next = all(&left);
            let moved = next.iter().zip(&weights).map(|(a, b)| (a / b - 1.0).abs());
            if moved.fold(0.0, f64::max) < SAME_WEIGHTS {
                break;
            }
            weights = next;
            let weighted = outputs.weighted(&weights, left.prior_weight());
            step = weighted.solve_weighted(free, scale, damping);
        }
        step
    }

    /// As [`Triangle::solve`], within bounds for the parameters that are at one: where less than a hundredth of a step is within its bound,
    /// the parameter stays as it is, and the others are solved for again, the longest such step first. Other steps are not shortened. `x`,
    /// `bounds`: of every parameter, at the point of linearisation.
    ///
    /// ```
    /// use estimation::Triangle;
    ///
    /// // Two collinear columns; the first parameter is at its lower bound.
    /// let mut triangle = Triangle::new(3);
    /// for row in [[1.0, 1.0, -2.0], [2.0, 2.0, -4.0]] {
    ///     triangle.push(&row);
    /// }
    /// triangle.finish();
    /// let bounds = [(0.0, 1.0), (-9.0, 9.0)];
    /// let step = triangle.solve_from_bounds((&[0.0, 0.0], &bounds), &[0, 1], &[1.0, 1.0], 1e-9);
    /// assert_eq!(step[0], 0.0);
    /// assert!((step[1] + 2.0).abs() < 1e-6);
    /// ```
    #[must_use]
    pub fn solve_from_bounds(
        &self,
        (x, bounds): (&[f64], &[(f64, f64)]),
        free: &[usize],
        scale: &[f64],
        damping: f64,
    ) -> Vec<f64> {
        let mut free = free.to_vec();
        loop {
            let step = self.solve(&free, scale, damping);
            let leaves = |&&j: &&usize| {
                let ((lower, upper), begun) = (bounds[j], x[j] + ROOM * step[j]);
                begun < lower && step[j] < 0.0 || begun > upper && step[j] > 0.0
            };
            let length = |j: usize| (scale[j] * step[j]).abs();
            let leaving = free.iter().filter(leaves).copied();
            match leaving.max_by(|&a, &b| length(a).total_cmp(&length(b))) {
                Some(leaving) => free.retain(|&j| j != leaving),
                None => return step,
            }
        }
    }

    /// `|J x - r|^2`; for several outputs the cost of the residual of each ([`Squares::cost`]).
    #[must_use]
    pub fn predicted(&self, x: &[f64]) -> f64 {
        match &self.outputs {
            Some(outputs) => outputs.left(x).cost(),
            None => self.left(x),
        }
    }

    fn left(&self, x: &[f64]) -> f64 {
        let last = self.columns - 1;
        (0..self.columns)
            .map(|i| {
                let moved: f64 = (i..last).map(|j| self.at(i, j) * x[j]).sum();
                (self.at(i, last) - moved).powi(2)
            })
            .sum()
    }

    /// `|J x|^2`, x with an entry for each column but the residual's.
    #[must_use]
    pub fn squared_length(&self, x: &[f64]) -> f64 {
        let last = self.columns - 1;
        let row = |i: usize| -> f64 { (i..last).map(|j| self.at(i, j) * x[j]).sum() };
        (0..last).map(|i| row(i).powi(2)).sum()
    }

    /// `log |J'J|`.
    #[must_use]
    pub fn log_det(&self) -> f64 {
        let last = self.columns - 1;
        (0..last).map(|i| 2.0 * self.at(i, i).abs().ln()).sum()
    }

    /// Whether all entries are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.r.iter().all(|value| value.is_finite())
    }

    /// The R factor of the same rows plus damping: `J'J + damping diag(scale_j^2)` instead of `J'J`.
    #[must_use]
    pub fn damped(&self, scale: &[f64], damping: f64) -> Self {
        let mut damped = self.clone();
        damped.outputs = None;
        damped.damp(scale.iter().copied(), damping);
        damped
    }

    fn damp(&mut self, scale: impl Iterator<Item = f64>, damping: f64) {
        let mut row = vec![0.0; self.columns];
        for (j, scale) in scale.enumerate() {
            row[j] = damping.sqrt() * scale;
            self.push(&row);
            row[j] = 0.0;
        }
        self.finish();
    }

    /// Adds the rows of another finished R factor, with its column j as column `places[j]`; the other columns are zero.
    pub fn append(&mut self, other: &Self, places: &[usize]) {
        let rows = self.rows + other.rows;
        let mut row = vec![0.0; self.columns];
        for i in 0..other.columns {
            for (j, &place) in places.iter().enumerate() {
                row[place] = other.at(i, j);
            }
            self.push(&row);
        }
        self.rows = rows;
    }
}

/// Eight sums side by side, which the compiler turns into vectors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    for (a, b) in a8.iter().zip(b8) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    rest + (((a + c) + (e + g)) + ((b + d) + (f + h)))
}

/// `b - factor a`, eight entries at a time.
fn subtract(b: &mut [f64], factor: f64, a: &[f64]) {
    let (b8, b_rest) = b.as_chunks_mut::<8>();
    let (a8, a_rest) = a.as_chunks::<8>();
    for (b, a) in b8.iter_mut().zip(a8) {
        for (b, a) in b.iter_mut().zip(a) {
            *b -= factor * a;
        }
    }
    for (b, a) in b_rest.iter_mut().zip(a_rest) {
        *b -= factor * a;
    }
}

/// `b - factor a`, and its product with c.
fn subtract_and_dot(b: &mut [f64], factor: f64, a: &[f64], c: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (b8, b_rest) = b.as_chunks_mut::<8>();
    let (a8, a_rest) = a.as_chunks::<8>();
    let (c8, c_rest) = c.as_chunks::<8>();
    for ((b, a), c) in b8.iter_mut().zip(a8).zip(c8) {
        let new: [f64; 8] = std::array::from_fn(|i| b[i] - factor * a[i]);
        sums = std::array::from_fn(|i| sums[i] + new[i] * c[i]);
        *b = new;
    }
    subtract(b_rest, factor, a_rest);
    let rest: f64 = b_rest.iter().zip(c_rest).map(|(b, c)| b * c).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    rest + (((a + c) + (e + g)) + ((b + d) + (f + h)))
}

#[cfg(test)]
mod tests;
