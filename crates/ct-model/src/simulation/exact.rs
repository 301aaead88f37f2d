//! Exact steps of linear models, `dx/dt = A x + v`, where `v` is constant or linear in time over the interval.
//!
//! `x(h) = x + h phi1(hA) (A x + v) + h^2 phi2(hA) dv/dt`, with `phi1(z) = (e^z - 1)/z` and `phi2(z) = (phi1(z) - 1)/z`, by scaling and
//! squaring of the Taylor series of `phi2`.
//!
//! **Reference**: N. J. Higham, Functions of Matrices, SIAM 2008, section 10.7.4 (the functions), section 10.3 (scaling and squaring).

use crate::scalar::Scalar;
use crate::tape::Tape;

use super::step::Step;

/// Terms of the Taylor series: for a norm of at most 1/2, the first omitted term is below the rounding error.
const TERMS: usize = 15;
/// Number of interval lengths whose matrices are stored.
const KEPT: usize = 8;
/// Two intervals whose lengths differ by less than this share use the same matrices; the remainder of the time is a step with constant
/// slope.
const SAME: f64 = 1e-6;

#[derive(Debug, Clone)]
pub(super) struct Exact<T> {
    /// The matrix A, row by row.
    a: Vec<T>,
    kept: Vec<Kept<T>>,
    oldest: usize,
}

#[derive(Debug, Clone)]
struct Kept<T> {
    h: f64,
    phi1: Vec<T>,
    phi2: Vec<T>,
}

impl<T: Scalar> Exact<T> {
    /// Computes the matrix A from the slopes at the unit vectors.
    pub fn new(tape: &Tape, work: &mut Step<T>) -> Self {
        let n = tape.states;
        let zero = T::constant(0.0);
        let first = tape.state(0);
        let up_to = tape.delayed(tape.delays.len());
        work.registers.values[tape.input(0)..up_to].fill(zero);
        work.registers.values[0] = zero;
        tape.evaluate_with_guards(&mut work.registers);
        let slopes = |work: &Step<T>| -> Vec<T> {
            let registers = tape.derivatives.iter();
            registers
                .map(|&register| work.registers.values[register])
                .collect()
        };
        let constant = slopes(work);
        let mut a = vec![zero; n * n];
        for j in 0..n {
            work.registers.values[first + j] = T::constant(1.0);
            tape.evaluate(&mut work.registers);
            // The slopes are read before the state is reset: for `der(s) = v` the derivative is the state's own register.
            for (i, slope) in slopes(work).into_iter().enumerate() {
                a[i * n + j] = slope - constant[i];
            }
            work.registers.values[first + j] = zero;
        }
        Self {
            a,
            kept: Vec::new(),
            oldest: 0,
        }
    }

    /// Whether all entries of the matrix are finite.
    pub fn is_finite(&self) -> bool {
        self.a.iter().all(|value| value.value().is_finite())
    }

    /// The states after an interval, from their slope at its beginning and the change of the slope per unit of time that the inputs cause.
    pub fn step(&mut self, x: &mut [T], slope: &[T], rise: &[T], h: f64) {
        let n = x.len();
        let times = |matrix: &[T], i: usize, vector: &[T]| {
            let products = matrix[i * n..].iter().zip(vector);
            products.fold(T::constant(0.0), |sum, (m, v)| sum + *m * *v)
        };
        let at = self.of(h);
        let kept = &self.kept[at];
        let mut moved = vec![T::constant(0.0); n];
        for (i, moved) in moved.iter_mut().enumerate() {
            *moved = times(&kept.phi1, i, slope) * kept.h
                + times(&kept.phi2, i, rise) * (kept.h * kept.h);
        }
        let rest = h - kept.h;
        for i in 0..n {
            x[i] = x[i] + moved[i];
            if rest != 0.0 {
                x[i] = x[i] + (times(&self.a, i, &moved) + slope[i] + rise[i] * kept.h) * rest;
            }
        }
    }

    /// Index of the matrices for an interval of this length.
    fn of(&mut self, h: f64) -> usize {
        let same = |kept: &Kept<T>| (kept.h - h).abs() <= SAME * h;
        if let Some(at) = self.kept.iter().position(same) {
            return at;
        }
        let (phi1, phi2) = phis(&self.a, h);
        let new = Kept { h, phi1, phi2 };
        if self.kept.len() < KEPT {
            self.kept.push(new);
            return self.kept.len() - 1;
        }
        self.oldest = (self.oldest + 1) % KEPT;
        self.kept[self.oldest] = new;
        self.oldest
    }
}

/// `phi1(hA)` and `phi2(hA)`.
fn phis<T: Scalar>(a: &[T], h: f64) -> (Vec<T>, Vec<T>) {
    let n = a.len().isqrt();
    let norm = a
        .chunks_exact(n.max(1))
        .map(|row| row.iter().map(|v| (h * v.value()).abs()).sum());
    let norm = norm.fold(0.0, f64::max);
    let mut doublings = 0;
    // A NaN norm ends the loop; the result is then NaN.
    while doublings < 1000 && norm > 0.5 * 2f64.powi(doublings) {
        doublings += 1;
    }
    let scale = h * 0.5f64.powi(doublings);
    let z: Vec<T> = a.iter().map(|v| *v * scale).collect();
    let zero = T::constant(0.0);
    let product = |a: &[T], b: &[T]| -> Vec<T> {
        let mut out = vec![zero; n * n];
        for i in 0..n {
            for k in 0..n {
                let left = a[i * n + k];
                for j in 0..n {
                    out[i * n + j] = out[i * n + j] + left * b[k * n + j];
                }
            }
        }
        out
    };
    let plus_identity = |mut a: Vec<T>, c: f64| {
        for i in 0..n {
            a[i * n + i] = a[i * n + i] + c;
        }
        a
    };
    // Horner's rule; the coefficients of phi2 are 1/(k + 2)!.
    let mut factorial = 0.5;
    let coefficients: Vec<f64> = (0..TERMS)
        .map(|k| {
            let own = factorial;
            factorial /= (k + 3) as f64;
            own
        })
        .collect();
    let mut phi2 = vec![zero; n * n];
    for c in coefficients.into_iter().rev() {
        phi2 = plus_identity(product(&phi2, &z), c);
    }
    let mut phi1 = plus_identity(product(&phi2, &z), 1.0);
    let mut phi0 = plus_identity(product(&phi1, &z), 1.0);
    for _ in 0..doublings {
        let half = product(&phi0, &phi2);
        for i in 0..n * n {
            phi2[i] = (half[i] + phi1[i] + phi2[i]) * 0.25;
        }
        let half = product(&phi0, &phi1);
        for i in 0..n * n {
            phi1[i] = (half[i] + phi1[i]) * 0.5;
        }
        phi0 = product(&phi0, &phi0);
    }
    (phi1, phi2)
}
