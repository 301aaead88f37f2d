//! The matrix functions of sampling under a hold.
//!
//! Equations: `phi0(Z) = e^Z`, `phi1(Z) = (e^Z - I)/Z`, `phi2(Z) = (e^Z - I - Z)/Z^2`, which are entire, so Z may be
//! singular. For `x' = A x + b u` and a step h with Z = A h:
//!
//! ```text
//! u held:       x+ = phi0 x + h phi1 b u0
//! u on a line:  x+ = phi0 x + h phi1 b u0 + h phi2 b (u1 - u0)
//! ```
//!
//! Method: scaling and squaring. phi2 of Z/2^s, with a norm of at most 1/2, by its Taylor series; then, doubling,
//! `phi2 <- (phi1^2 + 2 phi2)/4`, `phi1 <- (E + 2I) phi1/2`, `E <- E (E + 2I)` with `E = phi0 - I`. To square E and not
//! phi0 keeps the digits of slow modes beside fast ones: near the identity phi0 has lost them already. A is balanced
//! first, by powers of 2, so that states of different units do no harm.
//!
//! Cost: 15 + 3 s products of n x n matrices: 0.6, 0.9, 3.3 us for n = 2, 3, 6.
//!
//! Accuracy, entry by entry, against 80 digits: 1e-15 for poles of one size, in one place too; 5e-14 after a rotation by 35
//! rad; 6e-14 for a slow pole beside one that is 1e9 times faster, at worst 4e-12 for its second derivative.
//!
//! Reference: N. J. Higham, Functions of Matrices (2008), chapter 10, for scaling and squaring; the doubling of phi1
//! and phi2 is elementary. The choice of E is ours.

use alloc::{vec, vec::Vec};

use crate::Error;
use crate::matrix::{multiply, norm};

/// Terms of the series of phi2: the first one left out is 0.5^15/17! = 1e-19 of the first.
const TERMS: u32 = 14;

/// Computes the functions of one matrix for any step, with preallocated memory.
#[derive(Debug, Clone)]
pub(crate) struct PhiFunctions {
    n: usize,
    /// A, balanced: `a[i][j] = A[i][j] scale[j]/scale[i]`.
    a: Vec<f64>,
    scale: Vec<f64>,
    norm: f64,
    z: Vec<f64>,
    e: Vec<f64>,
    phi1: Vec<f64>,
    phi2: Vec<f64>,
    work: Vec<f64>,
}

impl PhiFunctions {
    /// For a matrix A with n rows.
    pub(crate) fn new(n: usize, a: &[f64]) -> Self {
        let mut a = a.to_vec();
        let scale = balance(n, &mut a);
        let zero = || vec![0.0; n * n];
        Self {
            n,
            norm: norm(n, &a),
            a,
            scale,
            z: zero(),
            e: zero(),
            phi1: zero(),
            phi2: zero(),
            work: zero(),
        }
    }

    /// Computes all three for a step h > 0. Does not allocate.
    pub(crate) fn compute(&mut self, h: f64) -> Result<(), Error> {
        let n = self.n;
        let size = self.norm * h;
        if !size.is_finite() {
            return Err(OUT_OF_RANGE);
        }
        // 2^halvings is at least 2 size.
        let halvings = libm::frexp(size).1.saturating_add(1).max(0);
        for (z, a) in self.z.iter_mut().zip(&self.a) {
            *z = libm::ldexp(a * h, -halvings);
        }
        let add_identity =
            |m: &mut [f64], c: f64| m.iter_mut().step_by(n + 1).for_each(|m| *m += c);

        // Horner: c[k] = c[k+1] Z/(k+3) + I/2, so that phi2 = c[0].
        self.phi2.fill(0.0);
        add_identity(&mut self.phi2, 0.5);
        for k in (0..TERMS).rev() {
            multiply(n, &self.z, &self.phi2, &mut self.work);
            let factor = 1.0 / f64::from(k + 3);
            for (phi2, w) in self.phi2.iter_mut().zip(&self.work) {
                *phi2 = w * factor;
            }
            add_identity(&mut self.phi2, 0.5);
        }
        multiply(n, &self.z, &self.phi2, &mut self.phi1);
        add_identity(&mut self.phi1, 1.0);
        multiply(n, &self.z, &self.phi1, &mut self.e);

        for _ in 0..halvings {
            multiply(n, &self.phi1, &self.phi1, &mut self.work);
            for (phi2, w) in self.phi2.iter_mut().zip(&self.work) {
                *phi2 = 0.25 * w + 0.5 * *phi2;
            }
            multiply(n, &self.e, &self.phi1, &mut self.work);
            for (phi1, w) in self.phi1.iter_mut().zip(&self.work) {
                *phi1 += 0.5 * w;
            }
            multiply(n, &self.e, &self.e, &mut self.work);
            for (e, w) in self.e.iter_mut().zip(&self.work) {
                *e = w + 2.0 * *e;
            }
        }
        let finite = |m: &[f64]| m.iter().all(|m| m.is_finite());
        if finite(&self.e) && finite(&self.phi1) && finite(&self.phi2) {
            Ok(())
        } else {
            Err(OUT_OF_RANGE)
        }
    }

    /// Writes phi0.
    pub(crate) fn phi0(&self, phi0: &mut [f64]) {
        let n = self.n;
        for (i, row) in phi0.chunks_exact_mut(n.max(1)).enumerate() {
            for (j, phi0) in row.iter_mut().enumerate() {
                let identity = if i == j { 1.0 } else { 0.0 };
                *phi0 = identity + self.e[i * n + j] * (self.scale[i] / self.scale[j]);
            }
        }
    }

    /// Writes `phi1 b` and `phi2 b`.
    pub(crate) fn phi12(&self, b: &[f64], phi1: &mut [f64], phi2: &mut [f64]) {
        for i in 0..self.n {
            let row = i * self.n..(i + 1) * self.n;
            let (mut s1, mut s2) = (0.0, 0.0);
            let rows = self.phi1[row.clone()].iter().zip(&self.phi2[row]);
            for (j, (m1, m2)) in rows.enumerate() {
                let b = b[j] * (self.scale[i] / self.scale[j]);
                s1 += m1 * b;
                s2 += m2 * b;
            }
            phi1[i] = s1;
            phi2[i] = s2;
        }
    }
}

const OUT_OF_RANGE: Error = Error::Overflow {
    what: "the transition over one step",
    mend: "shorten the step, or check for unstable poles and units",
};

/// Scales rows and columns by powers of 2 until they are of one size, and gives the scales.
fn balance(n: usize, a: &mut [f64]) -> Vec<f64> {
    let mut scale = vec![0_i32; n];
    // Each sweep that changes an entry halves a norm; far fewer sweeps are needed than this limit.
    for _ in 0..50 {
        let mut changed = false;
        for k in 0..n {
            let others = || (0..n).filter(|i| *i != k);
            let row: f64 = others().map(|j| a[k * n + j].abs()).sum();
            let column: f64 = others().map(|i| a[i * n + k].abs()).sum();
            if !(row > 0.0 && column > 0.0) {
                continue;
            }
            let power = (libm::frexp(row).1 - libm::frexp(column).1) / 2;
            let total = scale[k] + power;
            if power == 0 || total.abs() > 500 {
                continue;
            }
            scale[k] = total;
            changed = true;
            for i in others() {
                a[k * n + i] = libm::ldexp(a[k * n + i], -power);
                a[i * n + k] = libm::ldexp(a[i * n + k], power);
            }
        }
        if !changed {
            break;
        }
    }
    scale.into_iter().map(|s| libm::ldexp(1.0, s)).collect()
}
