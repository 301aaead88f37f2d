//! Sums over the autocovariance of stationary noise.
//!
//! Model: `x+ = A x + b e`, `v = c' x + d e`, e white of variance 1. Its autocovariance is
//! ```text
//! R(0) = c' Sigma c + d^2,   R(j) = c' A^{j-1} g,   g = A Sigma c + b d,   Sigma = A Sigma A' + b b'
//! ```
//! so that `sum_{k,l} R(k-l) s_k s_l'` is one filter of the rows, `f_k = sum_{l<k} R(k-l) s_l`, and the sum that of
//! `R(0) s s' + s f' + f s'`: no more memory for a longer record.
//!
//! Cost: `q nu^2` products a row, for q columns and nu states.

use crate::{ArModel, StationaryWhitener};

/// A stationary process, for sums over its autocovariance.
#[derive(Debug, Clone)]
pub struct StationaryNoise {
    nu: usize,
    /// Row by row.
    a: Vec<f64>,
    c: Vec<f64>,
    g: Vec<f64>,
    r0: f64,
}

impl StationaryNoise {
    /// From A (row by row), b, c and d, with innovations of variance 1; all eigenvalues of A within the unit circle.
    pub fn new(a: Vec<f64>, b: &[f64], c: Vec<f64>, d: f64) -> Self {
        let nu = b.len();
        let sigma = stationary(nu, &a, b);
        let of_c: Vec<f64> = (0..nu)
            .map(|i| dot(&sigma[i * nu..(i + 1) * nu], &c))
            .collect();
        let g = (0..nu).map(|i| dot(&a[i * nu..(i + 1) * nu], &of_c) + b[i] * d);
        Self {
            g: g.collect(),
            r0: dot(&c, &of_c) + d * d,
            nu,
            a,
            c,
        }
    }

    /// From an autoregression, with innovations of variance 1.
    pub fn of_ar(ar: &ArModel) -> Self {
        let ar = ar.coefficients();
        let o = ar.len();
        let mut a = vec![0.0; o * o];
        let mut b = vec![0.0; o];
        if o > 0 {
            a[..o].copy_from_slice(ar);
            b[0] = 1.0;
        }
        for i in 1..o {
            a[i * o + i - 1] = 1.0;
        }
        Self::new(a, &b, ar.to_vec(), 1.0)
    }

    /// A filter that whitens `lanes` signals at once, row by row, missing rows among them.
    pub fn whitener(&self, lanes: usize) -> StationaryWhitener<'_> {
        StationaryWhitener::new(self, lanes)
    }

    pub(crate) fn order(&self) -> usize {
        self.nu
    }

    pub(crate) fn a(&self) -> &[f64] {
        &self.a
    }

    pub(crate) fn c(&self) -> &[f64] {
        &self.c
    }

    pub(crate) fn g(&self) -> &[f64] {
        &self.g
    }

    /// `R(0)`, in the variance of the innovations.
    pub fn variance(&self) -> f64 {
        self.r0
    }

    /// An empty sum over rows of q numbers.
    pub fn sum(&self, q: usize) -> CovarianceSum<'_> {
        CovarianceSum {
            noise: self,
            q,
            states: vec![0.0; q * self.nu],
            next: vec![0.0; self.nu],
            past: vec![0.0; q],
            sum: vec![0.0; q * q],
        }
    }
}

/// `Sigma = A Sigma A' + b b'` by doubling.
fn stationary(n: usize, a: &[f64], b: &[f64]) -> Vec<f64> {
    let product = |x: &[f64], y: &[f64], transposed: bool| -> Vec<f64> {
        let at = |i: usize, j: usize| -> f64 {
            (0..n)
                .map(|k| {
                    x[i * n + k]
                        * if transposed {
                            y[j * n + k]
                        } else {
                            y[k * n + j]
                        }
                })
                .sum()
        };
        (0..n * n).map(|ij| at(ij / n, ij % n)).collect()
    };
    let mut sigma: Vec<f64> = (0..n * n).map(|ij| b[ij / n] * b[ij % n]).collect();
    let mut power = a.to_vec();
    // 2^50 steps: poles up to 1e-15 from the unit circle.
    for _ in 0..50 {
        let more = product(&product(&power, &sigma, false), &power, true);
        let size = |m: &[f64]| m.iter().map(|m| m.abs()).sum::<f64>();
        let small = size(&more) <= 1e-17 * size(&sigma);
        sigma.iter_mut().zip(&more).for_each(|(s, m)| *s += m);
        if small {
            break;
        }
        power = product(&power, &power, false);
    }
    sigma
}

/// `sum_{k,l} R(k-l) s_k s_l'`, row by row; see [`StationaryNoise::sum`].
#[derive(Debug, Clone)]
pub struct CovarianceSum<'a> {
    noise: &'a StationaryNoise,
    q: usize,
    /// The filter's states, column by column.
    states: Vec<f64>,
    next: Vec<f64>,
    past: Vec<f64>,
    /// `sum R(0)/2 s s' + s f'`, to be made symmetric.
    sum: Vec<f64>,
}

impl CovarianceSum<'_> {
    /// The next row of a record, q numbers.
    pub fn push(&mut self, row: &[f64]) {
        let StationaryNoise { nu, a, c, g, r0 } = self.noise;
        let nu = *nu;
        for ((past, s), state) in self
            .past
            .iter_mut()
            .zip(row)
            .zip(self.states.chunks_exact_mut(nu.max(1)))
        {
            *past = 0.5 * r0 * s + dot(c, state);
            for ((next, a), g) in self.next.iter_mut().zip(a.chunks_exact(nu.max(1))).zip(g) {
                *next = dot(a, state) + g * s;
            }
            state.copy_from_slice(&self.next);
        }
        if nu == 0 {
            for (past, s) in self.past.iter_mut().zip(row) {
                *past = 0.5 * r0 * s;
            }
        }
        for (sums, s) in self.sum.chunks_exact_mut(self.q.max(1)).zip(row) {
            for (sum, past) in sums.iter_mut().zip(&self.past) {
                *sum += s * past;
            }
        }
    }

    /// The matrix of the pushed values, symmetric, row by row.
    pub fn finish(self) -> Vec<f64> {
        let q = self.q;
        let at = |ij: usize| self.sum[ij] + self.sum[(ij % q) * q + ij / q];
        (0..q * q).map(at).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
