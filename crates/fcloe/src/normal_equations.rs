//! `J'J`, `J'e` and `e'e`, summed on the fly: O(q^2) memory for q columns, whatever the length of the record.
//!
//! Systems are solved by Cholesky's factors after a scaling to a diagonal of 1, which takes the units of the parameters
//! out of the condition: for `n = 2, m = 1` it falls from 1e8 to 1e2.

/// A column whose part outside the columns before it has less than this share of its square is their combination.
const DEPENDENT: f64 = 1e-13;

/// Sums over the rows `[sigma_1 .. sigma_q, e]`.
#[derive(Debug, Clone)]
pub(crate) struct NormalEquations {
    q: usize,
    /// Lower triangle of J'J, row by row.
    jj: Vec<f64>,
    je: Vec<f64>,
    ee: f64,
}

impl NormalEquations {
    pub(crate) fn new(q: usize) -> Self {
        Self {
            q,
            jj: vec![0.0; q * (q + 1) / 2],
            je: vec![0.0; q],
            ee: 0.0,
        }
    }

    /// Adds rows, given column by column, each with its index, ascending; columns that are not given are 0.
    pub(crate) fn add(&mut self, columns: &[(usize, &[f64])], e: &[f64]) {
        for (n, &(i, a)) in columns.iter().enumerate() {
            let row = i * (i + 1) / 2;
            for &(j, b) in &columns[..=n] {
                self.jj[row + j] += dot(a, b);
            }
            self.je[i] += dot(a, e);
        }
        self.ee += dot(e, e);
    }

    /// `(J'J)_ij`.
    pub(crate) fn jj(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        self.jj[i * (i + 1) / 2 + j]
    }

    /// `(J'e)_i`.
    pub(crate) fn je(&self, i: usize) -> f64 {
        self.je[i]
    }

    /// `e'e`.
    pub(crate) fn cost(&self) -> f64 {
        self.ee
    }

    pub(crate) fn is_finite(&self) -> bool {
        let all = self.jj.iter().chain(&self.je);
        self.ee.is_finite() && all.into_iter().all(|v| v.is_finite())
    }

    /// `x' J'J x`.
    pub(crate) fn length_squared(&self, x: &[f64]) -> f64 {
        let row = |i: usize| -> f64 { (0..self.q).map(|j| self.jj(i, j) * x[j]).sum() };
        (0..self.q).map(|i| x[i] * row(i)).sum()
    }

    /// Factors of `J'J + diag(added)`; none where it is singular to rounding.
    pub(crate) fn factor(&self, added: impl Fn(usize) -> f64) -> Option<Factor> {
        let q = self.q;
        let scale: Vec<f64> = (0..q)
            .map(|i| 1.0 / (self.jj(i, i) + added(i)).sqrt())
            .collect();
        if scale.iter().any(|s| !s.is_finite()) {
            return None;
        }
        let mut l = vec![0.0; q * q];
        for i in 0..q {
            for j in 0..=i {
                let own = if i == j {
                    1.0
                } else {
                    self.jj(i, j) * scale[i] * scale[j]
                };
                let known: f64 = (0..j).map(|k| l[i * q + k] * l[j * q + k]).sum();
                let rest = own - known;
                l[i * q + j] = if i > j {
                    rest / l[j * q + j]
                } else if rest > DEPENDENT {
                    rest.sqrt()
                } else {
                    return None;
                };
            }
        }
        Some(Factor { l, scale })
    }
}

/// `M = D L L' D`, L a lower triangle and D diagonal.
pub(crate) struct Factor {
    l: Vec<f64>,
    /// `1/D`.
    scale: Vec<f64>,
}

impl Factor {
    /// `M^-1 b`.
    pub(crate) fn solve(&self, b: impl Fn(usize) -> f64) -> Vec<f64> {
        let q = self.scale.len();
        let mut x: Vec<f64> = (0..q).map(|i| b(i) * self.scale[i]).collect();
        for i in 0..q {
            let known: f64 = (0..i).map(|j| self.l[i * q + j] * x[j]).sum();
            x[i] = (x[i] - known) / self.l[i * q + i];
        }
        for i in (0..q).rev() {
            let known: f64 = (i + 1..q).map(|j| self.l[j * q + i] * x[j]).sum();
            x[i] = (x[i] - known) / self.l[i * q + i];
        }
        x.iter().zip(&self.scale).map(|(x, s)| x * s).collect()
    }

    /// `log |M|`.
    pub(crate) fn log_det(&self) -> f64 {
        let q = self.scale.len();
        let pivot = |i: usize| 2.0 * (self.l[i * q + i] / self.scale[i]).ln();
        (0..q).map(pivot).sum()
    }

    /// `M^-1`, row by row.
    pub(crate) fn inverse(&self) -> Vec<Vec<f64>> {
        let q = self.scale.len();
        (0..q)
            .map(|j| self.solve(|i| if i == j { 1.0 } else { 0.0 }))
            .collect()
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
    rest + sums.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let (a, b, e) = ([1.0, 2.0, 2.0], [1e6, 0.0, 1e6], [3.0, 0.0, 3.0]);
        let mut sums = NormalEquations::new(2);
        sums.add(&[(0, &a), (1, &b)], &e);
        assert_eq!(
            (sums.jj(0, 0), sums.jj(0, 1), sums.jj(1, 1)),
            (9.0, 3e6, 2e12)
        );
        assert_eq!((sums.je(0), sums.je(1), sums.cost()), (9.0, 6e6, 18.0));
        let factor = sums.factor(|_| 0.0).unwrap();
        // e = 3e-6 b.
        let x = factor.solve(|i| sums.je(i));
        assert!(x[0].abs() < 1e-14 && (x[1] - 3e-6).abs() < 1e-20);
        assert!((sums.length_squared(&x) - 18.0).abs() < 1e-13);
        // |M| = 18e12 - 9e12.
        assert!((factor.log_det() - 9e12_f64.ln()).abs() < 1e-13);
        assert!((factor.inverse()[0][0] - 2.0 / 9.0).abs() < 1e-14);
    }

    #[test]
    fn dependent_columns_have_no_factors() {
        let (a, b) = ([1.0, 2.0, 3.0], [2.0, 4.0, 6.0]);
        let mut sums = NormalEquations::new(2);
        sums.add(&[(0, &a), (1, &b)], &a);
        assert!(sums.factor(|_| 0.0).is_none());
        assert!(sums.factor(|_| 1.0).is_some());
        assert!(NormalEquations::new(1).factor(|_| 0.0).is_none());
    }
}
