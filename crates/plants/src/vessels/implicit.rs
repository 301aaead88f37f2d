//! A step that is stable for any length: the implicit Euler method in each vessel's own level.

use crate::{Outlet, Scalar, inflow::Inflow};

use super::{Stretch, Vessels, Watch, rims::crossing};

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// One step that is stable for any length: implicit in each vessel's own level, of order one.
    pub(super) fn relax(&mut self, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let mut next = self.levels;
        let mut inflow = q.end;
        for (i, to) in next.iter_mut().enumerate().take(self.vessels.len()) {
            let level = self.levels[i];
            let Implicit {
                rise,
                kept,
                passed_on,
            } = self.implicit(i, inflow, h, t);
            let low = match self.vessels[i].outlet {
                Outlet::Torricelli => 0.0,
                Outlet::Linear => f64::NEG_INFINITY,
            };
            let rim = self.vessels[i].rim;
            *to = (level + rise).max(T::constant(low)).min(rim.level);
            inflow = passed_on;
            if to.value() != (level + rise).value() && rise.value() != 0.0 {
                let beyond = kept * (T::constant(1.0) - (*to - level) / rise);
                inflow = if rise.value() > 0.0 {
                    inflow + beyond * rim.fraction
                } else {
                    inflow + beyond
                };
            }
            // A leak cannot take more than the vessel contains.
            inflow = inflow.max(T::constant(low));
        }
        if let Some(side) = &self.side {
            let last = self.states - 1;
            let drawn = h * side.rate;
            next[last] = (next[last] + drawn * next[last - 1]) / (drawn + 1.0);
        }
        if let Some(watch) = watch {
            // The transient has decayed within the step; the level is taken as linear over it.
            let (before, after) = (self.levels[self.watched], next[self.watched]);
            watch(&Stretch::straight(h, before, after));
        }
        self.levels = next;
    }

    /// The implicit step of one vessel.
    fn implicit(&self, i: usize, inflow: T, h: T, t: f64) -> Implicit<T> {
        let level = self.levels[i];
        let mut levels = self.levels;
        let solution = self.solution(i, inflow, h.value(), t);
        if let Some(level) = solution {
            levels[i] = T::constant(level);
        }
        let (outflow, net) = self.balance(i, inflow, &levels, t);
        let slope = self.slope(i, levels[i], t).max(T::constant(0.0));
        let damped = T::constant(1.0) / (h * slope + 1.0);
        let rate = self.rate(i, &levels[i], net);
        if solution.is_none() {
            let kept = net * damped;
            return Implicit {
                rise: rate * h * damped,
                kept,
                // Mass balance: the flow that is not stored in the vessel leaves by the outlet or over the rim.
                passed_on: outflow + net - kept,
            };
        }
        // One Newton iteration in duals gives the derivatives of the solution.
        levels[i] = levels[i] + (level - levels[i] + rate * h) * damped;
        let (outflow, net) = self.balance(i, inflow, &levels, t);
        Implicit {
            rise: levels[i] - level,
            kept: net,
            passed_on: outflow,
        }
    }

    /// The level that solves the implicit equation of a vessel with a nonlinear loss: if the loss begins within the step, a step linearised
    /// at the present level would overshoot by far. `None` if the linearised step is sufficient.
    fn solution(&self, i: usize, inflow: T, h: f64, t: f64) -> Option<f64> {
        if self.vessels[i].laws.by_level.is_empty() {
            return None;
        }
        let mut levels = self.levels;
        let mut rate = |level: f64| {
            levels[i] = T::constant(level);
            let (_, net) = self.balance(i, inflow, &levels, t);
            self.rate(i, &levels[i], net).value()
        };
        let level = self.levels[i].value();
        let first = rate(level);
        if self.forgetting_changes(i, h * first, t) == 0.0 {
            return None;
        }
        // The solution is the share of the explicit step that equals the ratio of the rate at its end to the present rate.
        let mut excess = |share: f64| share - rate(level + share * h * first) / first;
        let most = excess(1.0);
        (first != 0.0 && most > 0.0)
            .then(|| level + h * first * crossing((0.0, -1.0), (1.0, most), excess))
    }
}

/// The result of an implicit step of one vessel.
struct Implicit<T> {
    /// Rise of the vessel's level.
    rise: T,
    /// Net inflow that is stored in the vessel \[flow\].
    kept: T,
    /// Flow to the next vessel \[flow\].
    passed_on: T,
}
