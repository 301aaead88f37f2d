//! Losses of a vessel besides its outlet that increase with the level: a hole in the wall can make the decay rate much larger than the
//! outlet does, and abruptly when the level rises above the hole.

use crate::{Scalar, inflow::Inflow};

use super::Vessels;

/// Runge-Kutta steps are used up to this many time constants of a vessel with a loss, well within the stability limit. With a smaller
/// limit, only some steps of a record would be cut, and the output would not be a smooth function of the parameters.
const STABLE: f64 = 1.5;

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// Derivative of the loss of vessel `i` by its level \[flow/level unit\].
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

    /// [`Vessels::loss_slope`] divided by the area, value only \[1/s\].
    fn loss_rate(&self, i: usize, level: f64, t: f64) -> f64 {
        let level = T::constant(level);
        let slope = self.loss_slope(i, level, &T::constant(t));
        slope.value() / self.area(i, &level).value().abs()
    }

    /// Change of the decay rate of vessel `i` due to its losses if its level changes by `moved` \[1/s\].
    pub(super) fn forgetting_changes(&self, i: usize, moved: f64, t: f64) -> f64 {
        // A side tank has no losses.
        let vessel = self.vessels.get(i);
        if vessel.is_none_or(|vessel| vessel.laws.by_level.is_empty()) {
            return 0.0;
        }
        let level = self.levels[i].value();
        (self.loss_rate(i, level + moved, t) - self.loss_rate(i, level, t)).abs()
    }

    /// [`Vessels::stiffness`] due to the losses, at the present levels or at the predicted end of the step, relative to [`STABLE`].
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
            // If there is no loss, the outlet alone determines the vessel's decay rate.
            if now != 0.0 || then != 0.0 {
                most = most.max(h * forgets.max(forgets - now + then));
            }
        }
        most / STABLE
    }
}
