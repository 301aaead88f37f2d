//! Exact propagation of linear vessels under a polynomial inflow, in closed form.
//!
//! `S_i dz_i/dt = q_i - z_i`, `z_i = x_i - offset_i`, `q_2 = z_1`, `q_1 = a + b s + c s^2`, `s` from 0 to 1 over a step of length `h`.
//! With `r_i = h/S_i` ([`crate::lag_response`] defines `w_k`, `C` and `W_k`):
//! ```text
//! x_1 <- exp(-r_1) x_1 + w_0(r_1) a + w_1(r_1) b + w_2(r_1) c + w_0(r_1) offset_1
//! x_2 <- C x_1 + exp(-r_2) x_2 + W_0 a + W_1 b + W_2 c + w_0(r_2) offset_2 - C offset_1
//! ```

use crate::{
    Scalar,
    inflow::Inflow,
    lag_response::{one_lag, two_lags},
    limits::SERIES,
};

/// Coefficients of one vessel's level after a step.
#[derive(Clone, Copy)]
struct Row<T> {
    /// Coefficients of the levels before the step.
    levels: [T; SERIES],
    /// Coefficients of the inflow's `a`, `b` and `c`.
    inflow: [T; 3],
    constant: T,
}

/// Exact step of `S_i dx_i/dt = q_i - (x_i - offset_i)`, `q_(i+1) = x_i - offset_i`.
pub(crate) struct Propagators<T> {
    /// Time constant and offset of each vessel.
    vessels: Vec<(T, T)>,
    /// Coefficients computed so far, by step length: even sampling needs one length, a dead time a few.
    known: Vec<(T, [Row<T>; SERIES])>,
    /// Index of the entry that is replaced next.
    oldest: usize,
}

/// Number of step lengths whose coefficients are stored.
const KEPT: usize = 6;

/// Whether the coefficients for a step length `known` are valid for `h`: the lengths differ by less than the rounding of times that are
/// read from text, and have the same derivatives.
pub(crate) fn same_step<T: Scalar>(known: T, h: T) -> bool {
    const SHARE: f64 = 1e-9;
    (known.value() - h.value()).abs() <= SHARE * h.value() && known.same_derivatives(h)
}

impl<T: Scalar> Propagators<T> {
    pub(crate) fn new(vessels: Vec<(T, T)>) -> Self {
        Self {
            vessels,
            known: Vec::with_capacity(KEPT),
            oldest: 0,
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
            // A step of length zero leaves the levels unchanged, but its length may have derivatives.
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
        for (row, to) in rows.iter().zip(next.iter_mut()).take(n) {
            let [by_a, by_b, by_c] = row.inflow;
            let mut sum = by_a * a + by_b * b + by_c * c + row.constant;
            for (own, level) in row.levels.iter().zip(levels).take(n) {
                sum = sum + *own * *level;
            }
            *to = sum;
        }
        next
    }

    /// Contributions to the second vessel's level over a step of length `h`: of the first vessel's level, and of the inflow's three
    /// coefficients.
    pub(crate) fn second_from(&mut self, h: T) -> (T, [T; 3]) {
        let row = &self.rows(h)[1];
        (row.levels[0], row.inflow)
    }

    /// The coefficients for a step of length `h`, which is not zero.
    fn rows(&mut self, h: T) -> &[Row<T>; SERIES] {
        let found = self
            .known
            .iter()
            .position(|&(known, _)| same_step(known, h));
        let at = found.unwrap_or_else(|| {
            let made = (h, self.rows_of(h));
            if self.known.len() < KEPT {
                self.known.push(made);
                return self.known.len() - 1;
            }
            let at = self.oldest;
            self.known[at] = made;
            self.oldest = (at + 1) % KEPT;
            at
        });
        &self.known[at].1
    }

    /// The coefficients in closed form.
    fn rows_of(&self, h: T) -> [Row<T>; SERIES] {
        let zero = T::constant(0.0);
        let mut rows = [Row {
            levels: [zero; SERIES],
            inflow: [zero; 3],
            constant: zero,
        }; SERIES];
        let mut before: Option<(T, T)> = None;
        for (i, (&(tau, offset), row)) in self.vessels.iter().zip(&mut rows).enumerate() {
            let r = h / tau;
            let own = one_lag(r.value());
            let of_one = |partial: [f64; 2]| T::with_slopes(partial[0], [(r, partial[1])]);
            row.levels[i] = of_one(own.decay);
            let filled = of_one(own.inflow[0]);
            row.constant = filled * offset;
            match before {
                None => {
                    row.inflow = [filled, of_one(own.inflow[1]), of_one(own.inflow[2])];
                }
                Some((first, offset_above)) => {
                    let [level, inflow @ ..] = two_lags(first.value(), r.value()).map(|partial| {
                        T::with_slopes(partial.value, [(first, partial.by[0]), (r, partial.by[1])])
                    });
                    row.levels[i - 1] = level;
                    row.inflow = inflow;
                    row.constant = row.constant - row.levels[i - 1] * offset_above;
                }
            }
            before = Some((r, offset));
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;

    /// Size of the augmented system: the vessels, the inflow's three coefficients and the constant one.
    const SIZE: usize = SERIES + 4;

    type Matrix<T> = [[T; SIZE]; SIZE];

    /// Reference for the closed form: the matrix exponential by scaling and squaring.
    struct Reference<T> {
        vessels: Vec<(T, T)>,
    }

    impl<T: Scalar> Reference<T> {
        /// The first rows of `exp(M)`, where `M` describes the vessels over the unit interval, driven by `a + b s + c s^2` and the offsets:
        /// the columns after those of the vessels belong to `a`, `b`, `c` and one.
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
            // Scaling and squaring with the Taylor series: at a norm of at most 1/2, sixteen terms are exact to rounding.
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
            // Change of variables from (p0, p1, p2) at the beginning to (a, b, c): p0 = a, p1 = b, p2 = 2 c.
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

    fn rates() -> Vec<f64> {
        (-8..=3)
            .flat_map(|power| [1.0, 2.3, 6.1].map(|m| m * 10.0_f64.powi(power)))
            .filter(|r| *r <= 1e3)
            .collect()
    }

    /// Largest error of the values and of the derivatives of the coefficients, each relative to the largest entry of its kind.
    fn error(vessels: Vec<(Dual<5>, Dual<5>)>, h: Dual<5>) -> f64 {
        let n = vessels.len();
        let reference = Reference {
            vessels: vessels.clone(),
        }
        .exponential(h);
        let rows = Propagators::new(vessels).rows_of(h);
        let mut worst = 0.0_f64;
        for (row, reference) in rows.iter().zip(&reference) {
            let own = row.levels[..n]
                .iter()
                .chain(&row.inflow)
                .chain([&row.constant]);
            for (entry, wanted) in own.zip(&reference[..n + 4]) {
                worst = worst.max((entry.re - wanted.re).abs());
                for (a, b) in entry.eps.iter().zip(&wanted.eps) {
                    worst = worst.max((a - b).abs());
                }
            }
        }
        worst
    }

    /// Time constants for these rates over a step of length one, as duals with relative derivatives.
    fn lags(rates: &[f64]) -> Vec<(Dual<5>, Dual<5>)> {
        let lag = |(i, r): (usize, &f64)| {
            let mut tau = Dual::variable(1.0 / r, i);
            tau.eps[i] = 1.0 / r;
            (tau, Dual::variable(0.7 - i as f64, 2 + i))
        };
        rates.iter().enumerate().map(lag).collect()
    }

    #[test]
    fn the_closed_form_is_the_matrix_exponential() {
        let h = Dual::variable(1.0, 4);
        for a in rates() {
            let one = error(lags(&[a]), h);
            assert!(one < 1e-12, "{a}: {one:e}");
            let near = [
                1.0,
                1.0 + 1e-12,
                1.0 + 1e-7,
                1.001,
                0.97,
                1.1,
                1.39,
                1.41,
                0.69,
                0.6,
            ]
            .map(|f| f * a);
            for b in rates().into_iter().chain(near) {
                let both = error(lags(&[a, b]), h);
                // Each squaring doubles the rounding error of the reference.
                let rounding = 4e-15 * a.max(b).max(1.0) + 2e-14;
                assert!(both < rounding, "{a} {b}: {both:e}");
            }
        }
    }
}
