//! The sensor: a first-order lag of the measured level, then static nonlinearities of the reading.

use crate::{
    Law, Scalar,
    moments::{KeptMoments, decayed},
    vessels::Stretch,
};

pub(crate) struct Sensor<T: Scalar> {
    laws: Vec<Box<dyn Law<T>>>,
    lag: Option<KeptMoments<T>>,
    /// Lag output minus level.
    excess: T,
}

impl<T: Scalar> Sensor<T> {
    /// The sensor's lag starts in steady state, unless [`Sensor::set_initial_state`] sets another initial state.
    pub(crate) fn new(laws: Vec<Box<dyn Law<T>>>) -> Self {
        let lag = laws.iter().find_map(|law| law.sensor_lag());
        let lag = lag.map(KeptMoments::new);
        Self {
            laws,
            lag,
            excess: T::constant(0.0),
        }
    }

    /// Sets an initial state of the lag other than steady state: `h` before the record began, its output exceeded the level by `before`.
    pub(crate) fn set_initial_state(&mut self, before: T, h: f64) {
        if let Some(lag) = &self.lag {
            self.excess = decayed(before, lag.time_constant, h);
        }
    }

    pub(crate) fn has_lag(&self) -> bool {
        self.lag.is_some()
    }

    /// Advances the lag over a segment: `T dw/dt = -w - T dH/dt`, `w` the excess. The level is the cubic through its values and rates at
    /// both ends.
    pub(crate) fn follow(&mut self, stretch: &Stretch<T>) {
        let Some(kept) = &mut self.lag else { return };
        let h = stretch.h;
        if h.value() == 0.0 {
            let lag = kept.time_constant;
            let relaxed = if lag.value() > 0.0 {
                self.excess / lag
            } else {
                T::constant(0.0)
            };
            self.excess = self.excess - (relaxed + stretch.rate_before) * h;
            return;
        }
        // dH/ds = a + b s + c s^2 over s in [0, 1].
        let (a, end) = (stretch.rate_before * h, stretch.rate_after * h);
        let rise = stretch.after - stretch.before;
        let b = rise * 6.0 - a * 4.0 - end * 2.0;
        let c = (a + end - rise * 2.0) * 3.0;
        let (decay, [m0, m1, m2]) = kept.over(h);
        // int_0^1 exp(-(1-s)/e) (a + b s + c s^2) ds
        let felt = a * m0 + b * (m0 - m1) + c * (m0 - m1 * 2.0 + m2);
        self.excess = self.excess * decay - felt;
    }

    /// The reading of a level.
    pub(crate) fn read(&mut self, level: T, t: f64) -> T {
        let behind = if self.lag.is_some() {
            level + self.excess
        } else {
            level
        };
        self.laws
            .iter_mut()
            .fold(behind, |y, law| law.reading(y, t))
    }
}
