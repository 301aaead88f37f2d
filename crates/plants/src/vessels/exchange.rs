//! An implicit step of joined tanks: Euler's rule for all levels at once, of order one. It cannot overshoot, whatever its length.
//!
//! Newton's method runs on values; one step more, in duals, gives the solution its derivatives.

use crate::{Scalar, inflow::Inflow};

use super::{Levels, Stretch, Vessels, Watch};

/// Iterations of Newton's method on values, and the share of the largest level to which they are taken: the last step squares it.
const NEWTON: (usize, f64) = (30, 1e-8);

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// The step; `values`: the same vessels without derivatives.
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

    /// A step of Newton's method for `x = levels + h f(x)`, from values `x`.
    fn newton(&self, coupling: &Coupling<N>, x: &[f64; N], h: T, q: T, t: f64) -> Levels<T, N> {
        let x = x.map(T::constant);
        let rates = self.rates(&x, q, t);
        let excess = std::array::from_fn(|i| self.levels[i] - x[i] + rates[i] * h);
        let moves = coupling.solve(excess);
        std::array::from_fn(|i| x[i] + moves[i])
    }
}

impl<const N: usize> Vessels<f64, N> {
    /// The levels after an implicit step to time `t`, and what the step was solved by.
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

    /// How much of the way from levels to others may be gone until a head is zero: beyond it a root's slope is another one, and
    /// Newton's method would go to and fro for ever.
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

    /// How the levels hang together over an implicit step, at levels `x`.
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

/// A tridiagonal system, each row a tank, as Thomas's algorithm leaves it.
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
