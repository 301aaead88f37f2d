//! Exact propagation of linear vessels under a polynomial inflow, by the matrix exponential.

use crate::{Scalar, inflow::Inflow, structure::SERIES};

/// Vessels, and the inflow's three coefficients and the constant one beside them.
const SIZE: usize = SERIES + 4;

type Matrix<T> = [[T; SIZE]; SIZE];

/// Propagates `S_i dx_i/dt = q_i - (x_i - offset_i)`, `q_(i+1) = x_i - offset_i`.
pub(crate) struct Propagators<T> {
    /// Time constant and offset of each vessel.
    vessels: Vec<(T, T)>,
    /// Exponentials made so far, by step length; a delay needs a few, an even sampling one.
    known: Vec<(T, Vec<[T; SIZE]>)>,
}

/// Exponentials that are kept.
const KEPT: usize = 12;

/// Whether what was computed for a step of length `known` holds for one of length `h`: they differ by less than times that
/// are read from text do, and have the same derivatives.
pub(crate) fn same_step<T: Scalar>(known: T, h: T) -> bool {
    const SHARE: f64 = 1e-9;
    (known.value() - h.value()).abs() <= SHARE * h.value() && known.same_derivatives(h)
}

impl<T: Scalar> Propagators<T> {
    pub(crate) fn new(vessels: Vec<(T, T)>) -> Self {
        Self {
            vessels,
            known: Vec::with_capacity(KEPT),
        }
    }

    /// The levels after a step of length `h`.
    pub(crate) fn advance<const N: usize>(
        &mut self,
        levels: &[T; N],
        h: T,
        q: &Inflow<T>,
    ) -> [T; N] {
        let n = self.vessels.len();
        if h.value() == 0.0 {
            // An empty stretch moves nothing, but its length may have derivatives.
            let mut next = *levels;
            let mut inflow = q.start;
            for (i, &(tau, offset)) in self.vessels.iter().enumerate() {
                let outflow = levels[i] - offset;
                next[i] = next[i] + (inflow - outflow) / tau * h;
                inflow = outflow;
            }
            return next;
        }
        let rows = self.rows(h);
        let [a, b, c] = q.coefficients();
        let mut next = *levels;
        for (row, to) in rows.iter().zip(next.iter_mut()) {
            let mut sum = row[n] * a + row[n + 1] * b + row[n + 2] * c + row[n + 3];
            for j in 0..n {
                sum = sum + row[j] * levels[j];
            }
            *to = sum;
        }
        next
    }

    /// What the second vessel gets over a step of length `h`: from the first one's level, and from its inflow's three
    /// coefficients.
    pub(crate) fn second_from(&mut self, h: T) -> (T, [T; 3]) {
        let n = self.vessels.len();
        let row = &self.rows(h)[1];
        (row[0], [row[n], row[n + 1], row[n + 2]])
    }

    /// The exponential's rows for a step of length `h`, which is not zero.
    fn rows(&mut self, h: T) -> &[[T; SIZE]] {
        let found = self
            .known
            .iter()
            .position(|&(known, _)| same_step(known, h));
        let at = found.unwrap_or_else(|| {
            if self.known.len() == KEPT {
                self.known.remove(0);
            }
            let rows = self.exponential(h);
            self.known.push((h, rows));
            self.known.len() - 1
        });
        &self.known[at].1
    }

    /// The first rows of `exp(M)`, where `M` drives the vessels over the unit interval by
    /// `a + b s + c s^2` and by the offsets: the columns after the vessels' belong to `a`, `b`, `c` and one.
    fn exponential(&self, h: T) -> Vec<[T; SIZE]> {
        let zero = T::constant(0.0);
        let n = self.vessels.len();
        // Generator of (levels, p0, p1, p2, 1) with p0 = a + b s + c s^2, p1 = b + 2 c s, p2 = 2 c:
        // p0' = p1, p1' = p2.
        let mut m: Matrix<T> = [[zero; SIZE]; SIZE];
        for (i, &(tau, offset)) in self.vessels.iter().enumerate() {
            let rate = h / tau;
            m[i][i] = -rate;
            m[i][n + 3] = rate * offset;
            if i == 0 {
                m[i][n] = rate;
            } else {
                m[i][i - 1] = rate;
                m[i][n + 3] = m[i][n + 3] - rate * self.vessels[i - 1].1;
            }
        }
        m[n][n + 1] = T::constant(1.0);
        m[n + 1][n + 2] = T::constant(1.0);
        let size = n + 4;
        // Scaling and squaring with the Taylor series: at a norm of at most 1/2 sixteen terms reach rounding.
        let norm = (0..size)
            .map(|i| (0..size).map(|j| m[i][j].value().abs()).sum::<f64>())
            .fold(0.0, f64::max);
        let mut squarings = 0;
        while norm * 0.5_f64.powi(squarings) > 0.5 && squarings < 200 {
            squarings += 1;
        }
        let scale = 0.5_f64.powi(squarings);
        for row in &mut m {
            for entry in row.iter_mut() {
                *entry = *entry * scale;
            }
        }
        let mut sum = identity();
        for k in (1..=16).rev() {
            // Horner: I + M/k (I + M/(k+1) (...)).
            sum = product(&m, &sum, size);
            for (i, row) in sum.iter_mut().enumerate().take(size) {
                for (j, entry) in row.iter_mut().enumerate().take(size) {
                    *entry = *entry * (1.0 / f64::from(k));
                    if i == j {
                        *entry = *entry + 1.0;
                    }
                }
            }
        }
        for _ in 0..squarings {
            sum = product(&sum, &sum, size);
        }
        // From (p0, p1, p2) at the beginning to (a, b, c): p0 = a, p1 = b, p2 = 2 c.
        sum.iter()
            .take(n)
            .map(|row| {
                let mut row = *row;
                row[n + 2] = row[n + 2] * 2.0;
                row
            })
            .collect()
    }
}

fn identity<T: Scalar>() -> Matrix<T> {
    let mut unit = [[T::constant(0.0); SIZE]; SIZE];
    for (i, row) in unit.iter_mut().enumerate() {
        row[i] = T::constant(1.0);
    }
    unit
}

fn product<T: Scalar>(a: &Matrix<T>, b: &Matrix<T>, size: usize) -> Matrix<T> {
    let mut c = [[T::constant(0.0); SIZE]; SIZE];
    for i in 0..size {
        for k in 0..size {
            let factor = a[i][k];
            for j in 0..size {
                c[i][j] = c[i][j] + factor * b[k][j];
            }
        }
    }
    c
}
