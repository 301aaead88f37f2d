//! A measured disturbance that flows into the lower of two vessels in series. A disturbance that flows into the upper vessel, or into a
//! single vessel, is a part of that vessel's [inflow](crate::inflow).
//!
//! The balance of the lower vessel contains the disturbance ([`Vessels::balance`]). For linear vessels without effects, superposition is
//! exact: the response of one lag to the disturbance is added to the response to the pump.

use crate::{
    Scalar,
    inflow::{Feed, Inflow},
    linear::Propagators,
};

use super::{Levels, Vessels, exponential::LinearFlow};

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// Marks the last vessel as one into which the disturbance of [`Vessels::disturb`] flows.
    pub(crate) fn feed_last(&mut self) {
        self.bare = false;
        let Some(last) = self.vessels.last_mut() else {
            return;
        };
        last.laws.fed = true;
        last.laws.flows = true;
        if let Some(LinearFlow { fed, .. }) = &mut self.linear {
            *fed = Some(Propagators::new(vec![(last.area, T::constant(0.0))]));
        }
    }

    /// Sets the disturbance that flows into the last vessel from now on.
    pub(crate) fn disturb(&mut self, feed: Feed<T>) {
        self.feed = Some(feed);
    }

    /// The disturbance at a time. Not inlined, so that the balance of vessels without a disturbance stays short.
    #[inline(never)]
    pub(super) fn disturbance(&self, t: f64) -> T {
        self.fed(t)
    }

    /// [`Vessels::linear_rates`] with the disturbance.
    #[cold]
    #[inline(never)]
    pub(super) fn fed_linear_rates(&self, levels: &Levels<T, N>, q: T, t: f64) -> Levels<T, N> {
        let mut rates = [T::constant(0.0); N];
        let mut inflow = q;
        for (i, vessel) in self.vessels.iter().enumerate() {
            let outflow = levels[i] - vessel.coefficient;
            let mut net = inflow - outflow;
            if vessel.laws.fed {
                net = net + self.disturbance(t);
            }
            inflow = outflow;
            rates[i] = net * vessel.inverse;
        }
        rates
    }

    /// The disturbance over a step of length `h` from time `t` on.
    pub(super) fn feed_over(&self, h: T, t: f64) -> Option<Inflow<T>> {
        let feed = self.feed.as_ref()?;
        Some(feed.over(self.time(t), h))
    }
}
