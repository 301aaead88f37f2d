//! A measured disturbance that flows into the lower of two vessels in series. What flows into the upper one, or into an only vessel, is
//! part of its [inflow](crate::inflow).
//!
//! The balance of the lower vessel has it everywhere ([`Vessels::balance`]). In linear vessels without effects its contribution adds to
//! that of the pump, exactly: it is what one lag makes of it.

use crate::{
    Scalar,
    inflow::{Feed, Inflow},
    linear::Propagators,
};

use super::{Levels, Vessels, exponential::LinearFlow};

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// Makes the last vessel one that [`Vessels::disturb`] feeds.
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

    /// What flows into the last vessel from now on.
    pub(crate) fn disturb(&mut self, feed: Feed<T>) {
        self.feed = Some(feed);
    }

    /// The disturbance at a time. Not inlined: the balance of vessels without one stays short.
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

/// What a lag has of an inflow after a step of length `h`, from zero on.
pub(super) fn brought<T: Scalar>(lag: &mut Propagators<T>, h: T, inflow: &Inflow<T>) -> T {
    let [level] = lag.advance(&[T::constant(0.0)], h, inflow);
    level
}
