//! The vessels' balance equations: the rates of the levels, and the decay rate of each vessel.

use crate::{Outlet, Scalar, Side, inflow::Inflow};

use super::{
    Levels, VesselLaws, Vessels,
    parts::STEP_LIMIT,
    torricelli::{A_LITTLE, slope_of_root, square_root},
};

/// The time `t` within a step whose beginning and length have derivatives.
// If it were inlined, the compiler would move the division out of the loop over the vessels and execute it also for steps without a clock.
#[cold]
#[inline(never)]
fn time_by<T: Scalar>(&(start, length): &(T, T), t: f64) -> T {
    let share = if length.value() == 0.0 {
        0.0
    } else {
        (t - start.value()) / length.value()
    };
    // The value is exactly `t`, as in a step without derivatives.
    let moved = start + length * share;
    moved - moved.value() + t
}

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// A time within the present step, with its derivatives.
    #[inline]
    pub(super) fn time(&self, t: f64) -> T {
        match &self.clock {
            None => T::constant(t),
            Some(clock) => time_by(clock, t),
        }
    }

    /// Outflow of vessel `i` without effects at a level or, for an outlet through a valve, at a head.
    #[inline(always)]
    pub(super) fn own_outflow(&self, i: usize, level: &T) -> T {
        let vessel = &self.vessels[i];
        if Self::JOINED && i + 1 < N {
            return self.through_valve(i, *level);
        }
        match vessel.outlet {
            Outlet::Torricelli => vessel.coefficient * square_root(*level),
            Outlet::Linear => *level - vessel.coefficient,
        }
    }

    /// The head of vessel `i` without effects: its level or, for an outlet through a valve, its level minus that of the next vessel.
    #[inline(always)]
    pub(super) fn own_head(&self, i: usize, level: &T, levels: &Levels<T, N>) -> T {
        if Self::JOINED && i + 1 < N {
            *level - levels[i + 1]
        } else {
            *level
        }
    }

    /// The head that drives the outflow of vessel `i` at a level, the other levels being `levels`.
    #[inline(always)]
    fn head(&self, i: usize, level: &T, levels: &Levels<T, N>) -> T {
        let mut head = self.own_head(i, level, levels);
        if i + 1 < self.vessels.len() {
            for &law in &self.vessels[i].laws.head {
                self.laws[law].head(&mut head, &levels[i + 1]);
            }
        }
        head
    }

    /// Outflow of vessel `i` to the next one at a level, the other levels being `levels`.
    #[inline(always)]
    pub(super) fn outflow(&self, i: usize, level: &T, levels: &Levels<T, N>, t: &T) -> T {
        let vessel = &self.vessels[i];
        if vessel.laws.head.is_empty() && vessel.laws.outflow.is_empty() {
            return self.own_outflow(i, &self.own_head(i, level, levels));
        }
        let head = self.head(i, level, levels);
        let mut outflow = self.own_outflow(i, &head);
        for &law in &vessel.laws.outflow {
            self.laws[law].outflow(&head, &mut outflow, t);
        }
        outflow
    }

    /// Outflow of vessel `i` to the next one, and its net inflow.
    #[inline(always)]
    pub(super) fn balance(&self, i: usize, inflow: T, levels: &Levels<T, N>, t: f64) -> (T, T) {
        let level = &levels[i];
        let laws = &self.vessels[i].laws;
        if !laws.flows {
            // No effect changes the head or a flow; one may still change the area.
            let outflow = self.own_outflow(i, &self.own_head(i, level, levels));
            return (outflow, inflow - outflow);
        }
        let now = self.time(t);
        let outflow = self.outflow(i, level, levels, &now);
        let mut net = inflow - outflow;
        if !Self::JOINED && laws.fed {
            net = net + self.disturbance(t);
        }
        for &law in &laws.net {
            self.laws[law].net(level, &mut net, &now);
        }
        if let Some(side) = &self.side {
            net = net - self.exchange(side) * (*level - levels[i + 1]);
        }
        (outflow, net)
    }

    /// Flow to a side tank per unit of level difference between the vessel and the side tank.
    #[inline]
    fn exchange(&self, side: &Side<T>) -> T {
        self.vessels[0].area * side.share * side.rate
    }

    /// Surface of vessel `i` at a level.
    #[inline]
    pub(super) fn area(&self, i: usize, level: &T) -> T {
        let vessel = &self.vessels[i];
        let mut area = vessel.area;
        for &law in &vessel.laws.area {
            self.laws[law].area(level, &mut area);
        }
        area
    }

    /// Rate of vessel `i` at a level. The nominal area enters as its inverse, and an effect on the area as a factor that is one if there is
    /// no effect, so that both forms give identical bits.
    #[inline(always)]
    pub(super) fn rate(&self, i: usize, level: &T, net: T) -> T {
        let vessel = &self.vessels[i];
        let rate = match vessel.plain_inverse {
            Some(inverse) => net * inverse,
            None => net * vessel.inverse,
        };
        if vessel.laws.area.is_empty() {
            rate
        } else {
            rate * (vessel.area / self.area(i, level))
        }
    }

    /// Rates of all levels \[level unit/s\].
    #[inline]
    pub(super) fn rates(&self, levels: &Levels<T, N>, q: T, t: f64) -> Levels<T, N> {
        let mut rates = [T::constant(0.0); N];
        self.rates_into(&mut rates, levels, q, t);
        rates
    }

    /// As [`Vessels::rates`], in place; a rate that is zero in the present mode is written too.
    #[inline(always)]
    pub(super) fn rates_into(&self, rates: &mut Levels<T, N>, levels: &Levels<T, N>, q: T, t: f64) {
        let mut inflow = q;
        for (i, vessel) in self.vessels.iter().enumerate() {
            if Self::JOINED && i + 1 == N {
                inflow = inflow + self.fed(t);
            }
            let (outflow, net) = self.balance(i, inflow, levels, t);
            inflow = outflow;
            if vessel.spilling {
                // The level is at the rim, and the net inflow overflows; when the net inflow becomes negative, this mode ends.
                inflow = inflow + net * vessel.rim.fraction;
                rates[i] = T::constant(0.0);
            } else {
                rates[i] = self.rate(i, &levels[i], net);
            }
        }
        if let Some(side) = &self.side {
            let last = self.states - 1;
            rates[last] = (levels[last - 1] - levels[last]) * side.rate;
        }
    }

    /// Rates of linear vessels without effects, with the operations of [`Vessels::rates`].
    pub(super) fn linear_rates(&self, levels: &Levels<T, N>, q: T, t: f64) -> Levels<T, N> {
        if self.feed.is_some() {
            return self.fed_linear_rates(levels, q, t);
        }
        let mut rates = [T::constant(0.0); N];
        let mut inflow = q;
        for (i, vessel) in self.vessels.iter().enumerate() {
            let outflow = levels[i] - vessel.coefficient;
            let net = inflow - outflow;
            inflow = outflow;
            rates[i] = net * vessel.inverse;
        }
        rates
    }

    /// The net inflow of vessel `i` at given levels, in the present modes.
    pub(super) fn net(&self, i: usize, levels: &Levels<T, N>, q: T, t: f64) -> T {
        let mut inflow = q;
        for (k, vessel) in self.vessels.iter().enumerate().take(i) {
            let (outflow, net) = self.balance(k, inflow, levels, t);
            inflow = outflow;
            if vessel.spilling {
                inflow = inflow + net * vessel.rim.fraction;
            }
        }
        if Self::JOINED && i + 1 == N {
            inflow = inflow + self.fed(t);
        }
        self.balance(i, inflow, levels, t).1
    }

    /// Decay rate of vessel `i` at a level, the negative derivative of the level's rate by the level, with the other levels held \[1/s\].
    /// The contribution of the effects is a finite difference of their contribution to the outflow alone, so that it is zero for effects at
    /// their absent values.
    pub(super) fn slope(&self, i: usize, level: T, t: f64) -> T {
        let vessel = &self.vessels[i];
        if Self::JOINED {
            return self.joined_slope(i, level, t);
        }
        let own = match vessel.outlet {
            Outlet::Torricelli => vessel.coefficient * slope_of_root(level),
            Outlet::Linear => T::constant(1.0),
        };
        if !vessel.laws.any {
            return own * vessel.inverse;
        }
        let step = 1e-6 * (level.value().abs() + 1e-3);
        let t = self.time(t);
        let added =
            |level: &T| self.outflow(i, level, &self.levels, &t) - self.own_outflow(i, level);
        let mut slope = own + (added(&(level + step)) - added(&level)) * (1.0 / step);
        if !vessel.laws.by_level.is_empty() {
            slope = slope + self.loss_slope(i, level, &t);
        }
        if let Some(side) = &self.side {
            slope = slope + self.exchange(side);
        }
        slope * vessel.inverse * (vessel.area / self.area(i, &level))
    }

    /// The decay rate of each vessel's level \[1/s\].
    pub(super) fn forgetting(&self, t: f64) -> [T; N] {
        let mut rates = [T::constant(0.0); N];
        for (i, rate) in rates.iter_mut().enumerate().take(self.vessels.len()) {
            *rate = match self.linear {
                // For linear vessels, only the nominal decay is integrated exactly.
                Some(_) => self.vessels[i].inverse,
                None => self.slope(i, self.levels[i], t).max(T::constant(0.0)),
            };
        }
        if let Some(side) = &self.side {
            rates[self.states - 1] = side.rate;
        }
        rates
    }

    /// Length `h` of the step in time constants of the fastest vessel, within a factor of two, to decide whether a Runge-Kutta step is
    /// stable. Computed from values only, so that values and derivatives are integrated with the same steps.
    #[inline]
    pub(super) fn stiffness(&self, h: f64, q: &Inflow<T>, t: f64) -> f64 {
        let mut most = 0.0_f64;
        for (i, vessel) in self.vessels.iter().enumerate() {
            let level = self.levels[i];
            match vessel.outlet {
                // The outflow is a concave function of the level, zero at zero, so its slope is below outflow/level (for a square root:
                // half of it). An empty vessel is replaced by a nearly empty one: the slope is the same, and the vessel may begin to fill.
                Outlet::Torricelli => {
                    let height = level.value().max(A_LITTLE);
                    let VesselLaws {
                        head,
                        outflow,
                        area,
                        ..
                    } = &vessel.laws;
                    let nominal = head.is_empty() && outflow.is_empty() && area.is_empty();
                    let (outflow, content) = if nominal {
                        let outflow = vessel.coefficient.value() * square_root(height);
                        (outflow, height * vessel.area.value())
                    } else {
                        let level = T::constant(height);
                        let now = T::constant(t);
                        let outflow = self.outflow(i, &level, &self.levels, &now).value();
                        // Backflow reduces the head, but not the slope by the head.
                        let head = self.head(i, &level, &self.levels).value().max(A_LITTLE);
                        (outflow, head * self.area(i, &level).value())
                    };
                    // This form needs no division in the common case.
                    if h * outflow > 2.0 * STEP_LIMIT * content {
                        most = most.max(0.5 * h * outflow / content);
                    }
                }
                Outlet::Linear if !vessel.laws.any => {}
                // The nominal decay of a linear vessel is integrated exactly; only the decay that the effects add counts.
                Outlet::Linear => {
                    let own = 1.0 / vessel.area.value().abs();
                    let slope = self.slope(i, self.levels[i], t).value().abs();
                    let added = if h * own > STEP_LIMIT {
                        slope - own
                    } else {
                        slope
                    };
                    most = most.max(0.5 * h * added);
                }
            }
        }
        if let Some(side) = &self.side {
            most = most.max(h * (1.0 + side.share.value()) * side.rate.value());
        }
        most.max(self.stiffness_of_losses(h, q, t))
    }
}
