//! Least squares on the fly: an upper triangle that rows are folded into, in `O(p^2)` memory.

use serde::{Deserialize, Serialize};

use crate::Squares;

/// Rows are collected in blocks and folded in by Householder reflections.
const BLOCK: usize = 128;

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
    /// Rows not yet folded in, column by column.
    block: Vec<f64>,
    filled: usize,
    /// For folding: the product of each column of the block with the pivot's.
    products: Vec<f64>,
    rows: usize,
    /// Of several outputs, or with priors, the triangle of each: their weights follow from the residuals.
    outputs: Option<Box<Outputs>>,
}

/// The rows of each output, not weighted.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Outputs {
    triangles: Vec<Triangle>,
    /// The rows of priors, in standard errors.
    priors: Triangle,
    /// What outputs count by; its sums are those of the residuals.
    squares: Squares,
}

/// Weights are found again so often in a step, and until they change by less than this part.
const ROUNDS: usize = 20;
const SAME_WEIGHTS: f64 = 1e-3;

impl Triangle {
    /// `columns` counts the residual's column too.
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

    /// Folds one row in; it has [`Triangle::columns`] entries.
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

    /// Folds in rows that are given column by column: each of [`Triangle::columns`] slices, the residual's last, holds one entry for every row.
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
        // A pass over a column applies one reflection and takes the product for the next.
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

    /// Folds in what is left; call it before reading.
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

    /// The cost: the sum of squares of the last column or, of several outputs, [`Squares::cost`].
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

    /// The triangle of the same rows with columns chosen and put in this order; the residual may be among them.
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

    /// The triangle of the rows of all outputs and of the priors, each times its weight by `squares`, those of the residuals: of an only
    /// output without priors its own.
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

    /// The same rows, those of priors with another weight.
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

    /// Minimises `|J x - r|^2 + damping sum_j (scale_j x_j)^2` over the `free` parameters; the others stay zero.
    /// Directions that no row speaks of stay zero too. Outputs count by what is left of their residuals there, not here
    /// (iteratively reweighted least squares).
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

    fn solve_weighted(&self, free: &[usize], scale: &[f64], damping: f64) -> Vec<f64> {
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

    /// `|J x - r|^2`; of several outputs the cost of what is left of each ([`Squares::cost`]).
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

    /// No entry is infinite or NaN.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.r.iter().all(|value| value.is_finite())
    }

    /// No column of J is a combination of those before it to within `1e-10` of its length: the rows determine all parameters.
    #[must_use]
    pub fn determined(&self) -> bool {
        (0..self.columns - 1).all(|j| self.independent(j))
    }

    fn independent(&self, j: usize) -> bool {
        let own = self.at(j, j);
        own.abs() > 1e-10 * self.column_norm(j) && own.is_finite()
    }

    /// The triangle of the same rows and those of a damping: `J'J + damping diag(scale_j^2)` in place of `J'J`.
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

    /// Folds in the rows of a finished triangle, its column j to column `places[j]`; the others count as zero.
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

    /// The inverse of `J'J` over the `free` parameters, row by row; `None` where a column is a combination of the
    /// others to within `1e-10` of its length.
    #[must_use]
    pub fn covariance(&self, free: &[usize]) -> Option<Vec<Vec<f64>>> {
        let p = free.len();
        let system = self.select(free);
        let mut inverse = vec![vec![0.0; p]; p];
        for i in (0..p).rev() {
            if !system.independent(i) {
                return None;
            }
            let diagonal = system.at(i, i);
            inverse[i][i] = 1.0 / diagonal;
            let (above, below) = inverse.split_at_mut(i + 1);
            for (j, entry) in above[i].iter_mut().enumerate().skip(i + 1) {
                let sum: f64 = below
                    .iter()
                    .zip(i + 1..=j)
                    .map(|(row, k)| system.at(i, k) * row[j])
                    .sum();
                *entry = -sum / diagonal;
            }
        }
        Some(
            (0..p)
                .map(|i| {
                    (0..p)
                        .map(|j| (i.max(j)..p).map(|k| inverse[i][k] * inverse[j][k]).sum())
                        .collect()
                })
                .collect(),
        )
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

impl Outputs {
    /// What a step leaves of each output, and of the priors.
    fn left(&self, x: &[f64]) -> Squares {
        let mut squares = self.squares.clone().with_prior(self.priors.left(x));
        for (sum, triangle) in squares.sums.iter_mut().zip(&self.triangles) {
            *sum = triangle.left(x);
        }
        squares
    }

    /// The triangle of all rows, those of each output and those of the priors times their weight.
    fn weighted(&self, weights: &[f64], of_priors: f64) -> Triangle {
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

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};

    fn rows(n: usize, p: usize) -> Vec<Vec<f64>> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        (0..n)
            .map(|_| (0..=p).map(|_| rng.random_range(-1.0..1.0)).collect())
            .collect()
    }

    #[test]
    fn agrees_with_a_dense_solution() {
        for n in [9, 32, 33, 200, 300] {
            let p = 5;
            let rows = rows(n, p);
            let mut triangle = Triangle::new(p + 1);
            for row in &rows {
                triangle.push(row);
            }
            triangle.finish();
            let j = DMatrix::from_fn(n, p, |i, k| rows[i][k]);
            let r = DVector::from_fn(n, |i, _| rows[i][p]);
            let dense = j.clone().svd(true, true).solve(&r, 1e-14).unwrap();
            let free: Vec<usize> = (0..p).collect();
            let x = triangle.solve(&free, &[1.0; 5], 0.0);
            for (a, b) in x.iter().zip(dense.iter()) {
                assert_relative_eq!(a, b, max_relative = 1e-10);
            }
            assert_relative_eq!(
                triangle.predicted(&x),
                (&j * &dense - &r).norm_squared(),
                max_relative = 1e-10
            );
            assert_relative_eq!(triangle.cost(), r.norm_squared(), max_relative = 1e-12);
            let inverse = (j.transpose() * &j).try_inverse().unwrap();
            let ours = triangle.covariance(&free).unwrap();
            for a in 0..p {
                for b in 0..p {
                    assert_relative_eq!(
                        ours[a][b],
                        inverse[(a, b)],
                        max_relative = 1e-9,
                        epsilon = 1e-12
                    );
                }
            }
            // Damped, with two parameters held.
            let damped = triangle.solve(&[0, 2, 4], &[1.0, 1.0, 2.0, 1.0, 0.5], 0.7);
            let sub = DMatrix::from_fn(n, 3, |i, k| rows[i][[0, 2, 4][k]]);
            let weight = DMatrix::from_diagonal(&DVector::from_vec(vec![0.7, 2.8, 0.175]));
            let reference = (sub.transpose() * &sub + weight)
                .lu()
                .solve(&(sub.transpose() * &r))
                .unwrap();
            for (k, i) in [0, 2, 4].into_iter().enumerate() {
                assert_relative_eq!(damped[i], reference[k], max_relative = 1e-10);
            }
        }
    }

    #[test]
    fn a_step_of_two_outputs_is_that_of_the_likelihood() {
        // One output is explained by the columns but for a little, the other is noise.
        let (n, p) = (120, 3);
        let rows = rows(2 * n, p);
        let mut triangles = vec![Triangle::new(p + 1), Triangle::new(p + 1)];
        let mut squares = Squares::new(&[n, n], |_| 0.0);
        for (k, row) in rows.iter().enumerate() {
            let mut row = row.clone();
            if k % 2 == 0 {
                row[p] = 3.0 * row[0] - row[1] + 0.1 * row[p];
            }
            triangles[k % 2].push(&row);
            squares.sums[k % 2] += row[p] * row[p];
        }
        for triangle in &mut triangles {
            triangle.finish();
        }
        let all = Triangle::of_outputs(triangles, &[], squares.clone());
        assert_relative_eq!(all.cost(), squares.cost(), max_relative = 1e-12);
        assert_relative_eq!(
            all.predicted(&[0.0; 3]),
            squares.cost(),
            max_relative = 1e-12
        );
        let x = all.solve(&[0, 1, 2], &[], 0.0);
        let best = all.predicted(&x);
        assert!(best < all.cost());
        for i in 0..p {
            for by in [-0.03, 0.03] {
                let mut moved = x.clone();
                moved[i] += by;
                assert!(all.predicted(&moved) > best);
            }
        }
    }

    #[test]
    fn rows_given_by_columns_are_the_same_rows() {
        let p = 3;
        for n in [1, 127, 128, 129, 400] {
            let rows = rows(n, p);
            let mut by_rows = Triangle::new(p + 1);
            rows.iter().for_each(|row| by_rows.push(row));
            by_rows.finish();
            let columns: Vec<Vec<f64>> = (0..=p)
                .map(|j| rows.iter().map(|row| row[j]).collect())
                .collect();
            let mut by_columns = Triangle::new(p + 1);
            let (first, second): (Vec<_>, Vec<_>) =
                columns.iter().map(|column| column.split_at(n / 3)).unzip();
            by_columns.push_columns(&first);
            by_columns.push_columns(&second);
            by_columns.finish();
            assert_eq!((by_columns.rows(), &by_columns.r), (n, &by_rows.r));
        }
    }

    #[test]
    fn lengths_determinant_and_damping_by_hand() {
        let mut triangle = Triangle::new(3);
        triangle.push_columns(&[&[1.0, 2.0, 2.0], &[1e6, 0.0, 1e6], &[3.0, 0.0, 3.0]]);
        triangle.finish();
        assert!(triangle.determined() && triangle.is_finite());
        assert_relative_eq!(
            triangle.squared_length(&[1.0, 1e-6]),
            17.0,
            max_relative = 1e-14
        );
        // |J'J| = 9 2e12 - (3e6)^2.
        assert_relative_eq!(triangle.log_det(), 9e12_f64.ln(), max_relative = 1e-14);
        let damped = triangle.damped(&[2.0, 1e6], 0.5);
        // |J'J| = 11 2.5e12 - (3e6)^2.
        assert_relative_eq!(damped.log_det(), 18.5e12_f64.ln(), max_relative = 1e-14);
        let at_once = triangle.solve(&[0, 1], &[2.0, 1e6], 0.5);
        for (own, at_once) in damped.solve(&[0, 1], &[], 0.0).iter().zip(at_once) {
            assert_relative_eq!(*own, at_once, max_relative = 1e-12);
        }
        triangle.push(&[f64::INFINITY, 0.0, 0.0]);
        triangle.finish();
        assert!(!triangle.is_finite());
    }

    #[test]
    fn appended_rows_take_their_places() {
        let rows = rows(40, 2);
        let (mut all, mut expected) = (Triangle::new(4), Triangle::new(4));
        for (part, places) in rows.chunks(20).zip([[0, 1, 3], [0, 2, 3]]) {
            let mut own = Triangle::new(3);
            for row in part {
                own.push(row);
                let mut whole = [0.0; 4];
                places
                    .iter()
                    .zip(row)
                    .for_each(|(&place, value)| whole[place] = *value);
                expected.push(&whole);
            }
            own.finish();
            all.append(&own, &places);
        }
        all.finish();
        expected.finish();
        assert_eq!(all.rows(), 40);
        for i in 0..4 {
            for j in i..4 {
                assert_relative_eq!(all.at(i, j).abs(), expected.at(i, j).abs(), epsilon = 1e-13);
            }
        }
    }

    #[test]
    fn a_combination_of_columns_has_no_covariance() {
        let mut triangle = Triangle::new(4);
        for row in rows(50, 1) {
            triangle.push(&[row[0], row[1], row[0] + row[1], 1.0]);
        }
        triangle.finish();
        assert!(triangle.covariance(&[0, 1, 2]).is_none() && !triangle.determined());
        assert!(triangle.covariance(&[0, 1]).is_some());
    }
}
