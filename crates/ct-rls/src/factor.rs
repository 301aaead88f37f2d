//! The factors `P = U D U'`, `U` unit upper triangular and `D` diagonal, and what is done to them.
//!
//! A change of `P` by a row of data multiplies every entry of `D` by a positive number, whatever is rounded:
//! the product stays symmetric and positive definite by construction.
//!
//! Equations (Bierman's update), for `P+ = growth (P - a P phi phi' P / (1 + a phi' P phi))`:
//! ```text
//! f = U' phi,   g = D f,   alpha_0 = 1,   alpha_j = alpha_{j-1} + a f_j g_j
//! D_j+ = growth D_j alpha_{j-1}/alpha_j,    U_ij+ = U_ij - (a f_j/alpha_{j-1}) k_i,   k_i += U_ij g_j
//! ```
//! Cost: about `1.5 p^2` multiplications and `p` divisions, no square root.
//!
//! Reference: G. J. Bierman, *Factorization Methods for Discrete Sequential Estimation*, Academic Press, 1977, chapter V.

use nalgebra::{SMatrix, SVector};

use crate::Error;
use crate::settings::{MAX_EPSILON, MAX_TRACE, Weights, gain};

/// Entries of `P(0)` that should be equal may differ by this, relative to the diagonal.
const SYMMETRY: f64 = 1e-9;

/// Factorises the `p` by `p` matrix in `u`, by columns: the pivots go to `d`, the rest stays in `u` above the diagonal.
pub(crate) fn factorise(u: &mut [f64], d: &mut [f64]) -> Result<(), Error> {
    let p = d.len();
    for j in 0..p {
        for i in 0..j {
            let (above, below) = (u[j * p + i], u[i * p + j]);
            let size = libm::sqrt((u[i * p + i] * u[j * p + j]).abs());
            let differ = (above - below).abs();
            if differ.is_nan() || differ > SYMMETRY * size.max(f64::MIN_POSITIVE) {
                return Err(Error::NotSymmetric {
                    row: i,
                    column: j,
                    above,
                    below,
                });
            }
        }
        d[j] = u[j * p + j];
    }
    for j in (0..p).rev() {
        let (diagonal, pivot) = (d[j], u[j * p + j]);
        if !(pivot > f64::EPSILON * diagonal && pivot > 1.0 / MAX_TRACE && pivot.is_finite()) {
            return Err(Error::NotPositiveDefinite {
                index: j,
                pivot,
                diagonal,
            });
        }
        for k in 0..j {
            let ratio = u[j * p + k] / pivot;
            for i in 0..=k {
                u[k * p + i] -= u[j * p + i] * ratio;
            }
        }
        for i in 0..j {
            u[j * p + i] /= pivot;
        }
        d[j] = pivot;
    }
    Ok(())
}

/// Entry (i, j) of `U D U'`.
pub(crate) fn entry(u: &[f64], d: &[f64], i: usize, j: usize) -> f64 {
    let p = d.len();
    let (i, j) = (i.min(j), i.max(j));
    let mut sum = d[j] * if i == j { 1.0 } else { u[j * p + i] };
    for k in j + 1..p {
        sum += u[k * p + i] * d[k] * u[k * p + j];
    }
    sum
}

pub(crate) fn trace(u: &[f64], d: &[f64]) -> f64 {
    let p = d.len();
    (0..p)
        .map(|j| d[j] * (1.0 + u[j * p..j * p + j].iter().map(|x| x * x).sum::<f64>()))
        .sum()
}

/// `x' (U D U')^-1 x`; spoils `x`.
pub(crate) fn information_norm(u: &[f64], d: &[f64], x: &mut [f64]) -> f64 {
    let p = d.len();
    let mut sum = 0.0;
    for j in (0..p).rev() {
        for i in 0..j {
            x[i] -= u[j * p + i] * x[j];
        }
        sum += x[j] * x[j] / d[j];
    }
    sum
}

/// `a' b`, in one order of summation whether the length is known when the program is built or not.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((fours_a, rest_a), (fours_b, rest_b)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    // the addition does not change the result, not even the sign of 0, so the loop for groups of four can be skipped
    let mut sums = [-0.0; 4];
    for (a, b) in fours_a.iter().zip(fours_b) {
        for i in 0..4 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// `f = U' phi` and `s = phi' P phi`.
#[inline(always)]
pub(crate) fn project(u: &[f64], d: &[f64], phi: &[f64], f: &mut [f64]) -> f64 {
    let p = d.len();
    let mut s = 0.0;
    for j in 0..p {
        let column = &u[j * p..j * p + j];
        let mut sum = phi[j];
        for i in 0..j {
            sum += column[i] * phi[i];
        }
        f[j] = sum;
        s += d[j] * sum * sum;
    }
    s
}

/// Bierman's update from `f = U' phi`; `k` becomes `P phi` with `P` from before.
#[inline(always)]
pub(crate) fn absorb(u: &mut [f64], d: &mut [f64], f: &[f64], a: f64, growth: f64, k: &mut [f64]) {
    let p = d.len();
    let (mut alpha, mut inverse) = (1.0, 1.0);
    for j in 0..p {
        let g = d[j] * f[j];
        let lambda = -a * f[j] * inverse;
        let next = alpha + a * f[j] * g;
        inverse = 1.0 / next;
        // avoids underflow to 0, which would make P singular permanently
        d[j] = (d[j] * growth * (alpha * inverse)).max(f64::MIN_POSITIVE);
        let column = &mut u[j * p..j * p + j];
        for i in 0..j {
            let old = column[i];
            column[i] = old + lambda * k[i];
            k[i] += old * g;
        }
        k[j] = g;
        alpha = next;
    }
}

/// One exact step of `theta` and the factors; `None`, with no change, if a number overflows.
#[inline(always)]
pub(crate) fn exact_step(
    (u, d, theta): (&mut [f64], &mut [f64], &mut [f64]),
    (f, k): (&mut [f64], &mut [f64]),
    phi: &[f64],
    epsilon: f64,
    weights: &Weights,
    (growth, length): (f64, f64),
) -> Option<f64> {
    let s = project(u, d, phi, f);
    let a = weights.gamma() * length;
    let denominator = 1.0 + a * s;
    if !(denominator.is_finite() && epsilon.abs() <= MAX_EPSILON) {
        return None;
    }
    absorb(u, d, f, a, growth, k);
    let step = epsilon * gain(weights, length, s, denominator);
    for (theta, k) in theta.iter_mut().zip(k) {
        *theta += *k * step;
    }
    Some(s)
}

/// Largest eigenvalue of the symmetric matrix `m` (p by p); spoils it. Cyclic Jacobi rotations.
pub(crate) fn largest_eigenvalue(m: &mut [f64], p: usize) -> f64 {
    let scale = m.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    if !(scale > 0.0 && scale.is_finite()) {
        return scale;
    }
    for x in m.iter_mut() {
        *x /= scale;
    }
    for _ in 0..30 {
        let mut off = 0.0;
        for i in 0..p {
            for j in i + 1..p {
                let x = m[i * p + j];
                off += x * x;
                if x == 0.0 {
                    continue;
                }
                let tau = (m[j * p + j] - m[i * p + i]) / (2.0 * x);
                let t = if tau.is_finite() {
                    libm::copysign(1.0, tau) / (tau.abs() + libm::sqrt(1.0 + tau * tau))
                } else {
                    0.0
                };
                let cos = 1.0 / libm::sqrt(1.0 + t * t);
                let sin = t * cos;
                for k in 0..p {
                    let (a, b) = (m[k * p + i], m[k * p + j]);
                    m[k * p + i] = cos * a - sin * b;
                    m[k * p + j] = sin * a + cos * b;
                }
                for k in 0..p {
                    let (a, b) = (m[i * p + k], m[j * p + k]);
                    m[i * p + k] = cos * a - sin * b;
                    m[j * p + k] = sin * a + cos * b;
                }
            }
        }
        if off < f64::EPSILON * f64::EPSILON {
            break;
        }
    }
    scale * (0..p).fold(0.0_f64, |a, i| a.max(m[i * p + i]))
}

/// The factors of a symmetric positive definite matrix of `P` rows.
///
/// For estimators built on top of this crate's; a user reads [`covariance`](crate::RecursiveEstimator::covariance).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UdFactor<const P: usize> {
    /// Stored by columns; only the part above the diagonal is used.
    pub(crate) u: [[f64; P]; P],
    pub(crate) d: [f64; P],
}

impl<const P: usize> UdFactor<P> {
    /// Factors of `matrix`, symmetric and positive definite.
    ///
    /// # Errors
    /// [`Error::NotSymmetric`], [`Error::NotPositiveDefinite`].
    pub fn new(matrix: &SMatrix<f64, P, P>) -> Result<Self, Error> {
        let mut factor = Self {
            u: matrix.data.0,
            d: [0.0; P],
        };
        factorise(factor.u.as_flattened_mut(), &mut factor.d)?;
        Ok(factor)
    }

    /// `U D U'`.
    pub fn to_matrix(&self) -> SMatrix<f64, P, P> {
        SMatrix::from_fn(|i, j| entry(self.u.as_flattened(), &self.d, i, j))
    }

    /// `L = U D^(1/2)`, upper triangular, with `P = L L'`.
    #[inline]
    pub fn root(&self) -> SMatrix<f64, P, P> {
        let mut root = SMatrix::zeros();
        for j in 0..P {
            let spread = libm::sqrt(self.d[j]);
            for i in 0..j {
                root[(i, j)] = self.u[j][i] * spread;
            }
            root[(j, j)] = spread;
        }
        root
    }

    /// Sum of the diagonal of `U D U'`.
    pub fn trace(&self) -> f64 {
        trace(self.u.as_flattened(), &self.d)
    }

    /// `(P x, x' P x)`.
    pub fn times(&self, x: &SVector<f64, P>) -> (SVector<f64, P>, f64) {
        let mut f = [0.0; P];
        let u = self.u.as_flattened();
        let s = project(u, &self.d, x.as_slice(), &mut f);
        let mut k = [0.0; P];
        for j in 0..P {
            let g = self.d[j] * f[j];
            for i in 0..j {
                k[i] += u[j * P + i] * g;
            }
            k[j] = g;
        }
        (SVector::from(k), s)
    }

    /// `x' P^-1 x`.
    pub fn information_norm(&self, x: &SVector<f64, P>) -> f64 {
        let mut x = x.data.0[0];
        information_norm(self.u.as_flattened(), &self.d, &mut x)
    }
}
