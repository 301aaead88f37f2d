//! An implicit step of joined tanks: the implicit Euler method for all levels together, of order one, stable for any step length.
//!
//! Newton's method iterates on values; one more iteration, in duals, gives the derivatives of the solution.

use crate::{Scalar, inflow::Inflow};

use super::{Levels, Stretch, Vessels, Watch};

/// Largest number of Newton iterations on values, and their tolerance as a share of the largest level: the final iteration squares the
/// error.
const NEWTON: (usize, f64) = (30, 1e-8);

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// The implicit step; `values`: a copy of the vessels without derivatives.
    pub(super) fn exchange_implicitly(
        &mut self,
        values: &mut Vessels<f64, N>,
        h: T,
        q: &Inflow<T>,
        t: f64,
        watch: &mut Watch<T>,
    ) {
        let end = t + h.value();
        self.settle_modes(q.start, t, None);
        values.stand_as(self);
        let (there, coupling) = values.settled(h.value(), q.end.value(), end);
        let next = self.newton(&coupling, &there, h, q.end, end);
        if let Some(watch) = watch {
            let (before, after) = (self.levels[self.watched], next[self.watched]);
            watch(&Stretch::straight(h, before, after));
        }
        self.levels = next;
        self.keep_within();
    }

    /// One Newton iteration for `x = levels + h f(x)`, starting at values `x`.
    fn newton(&self, coupling: &Coupling<N>, x: &[f64; N], h: T, q: T, t: f64) -> Levels<T, N> {
        let x = x.map(T::constant);
        let rates = self.rates(&x, q, t);
        let excess = std::array::from_fn(|i| self.levels[i] - x[i] + rates[i] * h);
        let moves = coupling.solve(excess);
        std::array::from_fn(|i| x[i] + moves[i])
    }
}

impl<const N: usize> Vessels<f64, N> {
    /// The levels after an implicit step to time `t`, and the factorised Jacobian of the last iteration.
    fn settled(&self, h: f64, q: f64, t: f64) -> ([f64; N], Coupling<N>) {
        let reach = self.levels.iter().map(|level| level.abs());
        let small = NEWTON.1 * reach.fold(1e-3, f64::max);
        let mut there = self.levels;
        for _ in 0..NEWTON.0 {
            let coupling = self.coupling(&there, h, t);
            let next = self.newton(&coupling, &there, h, q, t);
            let share = self.as_far_as_a_root(&there, &next);
            let mut moved = 0.0_f64;
            for (i, to) in there.iter_mut().enumerate() {
                let rim = self.vessels[i].rim.level;
                let level = (*to + share * (next[i] - *to)).min(rim).max(0.0);
                moved = moved.max((level - *to).abs());
                *to = level;
            }
            if moved.is_nan() || moved <= small {
                break;
            }
        }
        let coupling = self.coupling(&there, h, t);
        (there, coupling)
    }

    /// The share of the way between two sets of levels at which the first head is zero. Beyond that point the slope of the square root is a
    /// different one, and a full Newton step could oscillate for ever.
    fn as_far_as_a_root(&self, from: &[f64; N], to: &[f64; N]) -> f64 {
        let width = self.valves.map_or(0.0, |valves| valves.width);
        let mut share = 1.0_f64;
        for i in 0..N - 1 {
            let head = from[i] - from[i + 1];
            let after = to[i] - to[i + 1];
            if head.abs() > width && head * after < 0.0 {
                share = share.min(head / (head - after));
            }
        }
        share
    }

    /// The Jacobian of the implicit equation at levels `x`, factorised.
    fn coupling(&self, x: &[f64; N], h: f64, t: f64) -> Coupling<N> {
        let mut coupling = Coupling {
            lower: [0.0; N],
            upper: [0.0; N],
            pivot: [0.0; N],
        };
        let mut before = 0.0;
        for i in 0..N {
            let slope = self.valve_slope(i, x, t);
            let share = if self.vessels[i].spilling {
                0.0
            } else {
                h / self.area(i, &x[i])
            };
            let loss = if self.vessels[i].laws.by_level.is_empty() {
                0.0
            } else {
                self.loss_slope(i, x[i], &t).max(0.0)
            };
            let mut pivot = 1.0 + share * (before + slope + loss);
            if i > 0 {
                coupling.lower[i] = -share * before;
                pivot -= coupling.lower[i] * coupling.upper[i - 1];
            }
            if i + 1 < N {
                coupling.upper[i] = -share * slope / pivot;
            }
            coupling.pivot[i] = pivot;
            before = slope;
        }
        coupling
    }
}

/// A tridiagonal matrix, one row for each tank, factorised by the Thomas algorithm.
struct Coupling<const N: usize> {
    lower: [f64; N],
    upper: [f64; N],
    pivot: [f64; N],
}

impl<const N: usize> Coupling<N> {
    fn solve<T: Scalar>(&self, mut x: [T; N]) -> [T; N] {
        for i in 0..N {
            if i > 0 {
                x[i] = x[i] - x[i - 1] * self.lower[i];
            }
            x[i] = x[i] * (1.0 / self.pivot[i]);
        }
        for i in (1..N).rev() {
            x[i - 1] = x[i - 1] - x[i] * self.upper[i - 1];
        }
        x
    }
}
