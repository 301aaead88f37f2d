//! What a vessel loses beside its outlet, where that is more at a higher level: a hole in its wall may let it forget its level
//! far sooner than the outlet does, and all at once where the level comes to stand above it.

use crate::{Scalar, inflow::Inflow};

use super::Vessels;

/// Runge-Kutta is taken up to so many time constants of a vessel with a loss. It stays well within what is stable; cut shorter,
/// it would be cut only here and there along a record, and its output would not be smooth in the parameters.
const STABLE: f64 = 1.5;

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// By how much more vessel `i` loses where it stands higher \[flow/level unit\].
    pub(super) fn loss_slope(&self, i: usize, level: T, t: &T) -> T {
        let step = 1e-6 * (level.value().abs() + 1e-3);
        let gained = |level: T| {
            let mut net = T::constant(0.0);
            for &law in &self.vessels[i].laws.by_level {
                self.laws[law].net(&level, &mut net, t);
            }
            net
        };
        (gained(level) - gained(level + step)) * (1.0 / step)
    }

    /// The same as a rate \[1/s\], its value alone.
    fn loss_rate(&self, i: usize, level: f64, t: f64) -> f64 {
        let level = T::constant(level);
        let slope = self.loss_slope(i, level, &T::constant(t));
        slope.value() / self.area(i, &level).value().abs()
    }

    /// By how much the losses of vessel `i` change its forgetting \[1/s\] where its level moves by so much.
    pub(super) fn forgetting_changes(&self, i: usize, moved: f64, t: f64) -> f64 {
        // A side tank has none.
        let vessel = self.vessels.get(i);
        if vessel.is_none_or(|vessel| vessel.laws.by_level.is_empty()) {
            return 0.0;
        }
        let level = self.levels[i].value();
        (self.loss_rate(i, level + moved, t) - self.loss_rate(i, level, t)).abs()
    }

    /// [`Vessels::stiffness`] by the losses, now or where the levels are about to be, as a share of [`STABLE`].
    pub(super) fn stiffness_of_losses(&self, h: f64, q: &Inflow<T>, t: f64) -> f64 {
        let bends = |vessel: &super::Vessel<T>| !vessel.laws.by_level.is_empty();
        if !self.vessels.iter().any(bends) {
            return 0.0;
        }
        let rates = self.rates(&self.levels, q.start, t);
        let mut most = 0.0_f64;
        for (i, vessel) in self.vessels.iter().enumerate() {
            if !bends(vessel) {
                continue;
            }
            let level = self.levels[i];
            let forgets = self.slope(i, level, t).value().max(0.0);
            let ahead = level.value() + rates[i].value() * h / (1.0 + h * forgets);
            let now = self.loss_rate(i, level.value(), t);
            let then = self.loss_rate(i, ahead, t);
            // Nothing is lost: the outlet alone says how fast its vessel is.
            if now != 0.0 || then != 0.0 {
                most = most.max(h * forgets.max(forgets - now + then));
            }
        }
        most / STABLE
    }
}
