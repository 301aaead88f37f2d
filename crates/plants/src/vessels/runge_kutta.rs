//! One Runge-Kutta step of order four in `f64` or duals.

use std::ops::Mul;

use crate::{Scalar, inflow::Inflow};

use super::{Levels, Vessel, Vessels, torricelli::square_root};

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// One Runge-Kutta step from the present levels, in the present modes.
    #[inline]
    pub(super) fn trial(&self, h: T, q: &Inflow<T>, t: f64) -> Levels<T, N> {
        self.trial_and_rates(h, q, t).0
    }

    /// As [`Vessels::trial`], and the rates at the beginning of the step, if they were computed.
    #[inline]
    pub(super) fn trial_and_rates(
        &self,
        h: T,
        q: &Inflow<T>,
        t: f64,
    ) -> (Levels<T, N>, Option<[f64; N]>) {
        let dt = h.value();
        if let Some(rates) = self.damping {
            (self.damped_trial(rates, None, h, q, t), None)
        } else if !h.same_derivatives(T::constant(0.0)) {
            self.trial_by(h, dt, q, t)
        } else if !self.bare {
            self.trial_by(dt, dt, q, t)
        } else if let [only] = &self.vessels[..] {
            (self.bare_trial([only], dt, q), None)
        } else if let [upper, lower] = &self.vessels[..] {
            (self.bare_trial([upper, lower], dt, q), None)
        } else {
            self.trial_by(dt, dt, q, t)
        }
    }

    /// A Runge-Kutta step of vessels with Torricelli outflow and no effects. The operations are in the same order as in
    /// [`Vessels::trial_by`], so the result is identical to the bit; a fit spends most of its time here.
    #[inline]
    fn bare_trial<const M: usize>(
        &self,
        vessels: [&Vessel<T>; M],
        h: f64,
        q: &Inflow<T>,
    ) -> Levels<T, N> {
        // Loops over indices, because arrays by value would be copied.
        let zero = T::constant(0.0);
        let mut next = self.levels;
        let mut at = self.levels;
        let stages = [
            (q.start, 0.0, 1.0),
            (q.middle, 0.5, 2.0),
            (q.middle, 0.5, 2.0),
            (q.end, 1.0, 1.0),
        ];
        let mut rates = [zero; N];
        let mut sum = [zero; N];
        for (stage, (q, ahead, weight)) in stages.into_iter().enumerate() {
            if stage > 0 {
                for i in 0..M {
                    at[i] = self.levels[i] + rates[i] * (h * ahead);
                }
            }
            let mut inflow = q;
            for i in 0..M {
                let outflow = vessels[i].coefficient * square_root(at[i]);
                rates[i] = (inflow - outflow) * vessels[i].plain_inverse.unwrap_or(f64::NAN);
                inflow = outflow;
                sum[i] = sum[i] + rates[i] * weight;
            }
        }
        let sixth = h * (1.0 / 6.0);
        for i in 0..M {
            next[i] = next[i] + sum[i] * sixth;
        }
        next
    }

    /// A Runge-Kutta step of length `h` with or without derivatives.
    #[inline]
    fn trial_by<H: Copy + Mul<f64, Output = H>>(
        &self,
        h: H,
        dt: f64,
        q: &Inflow<T>,
        t: f64,
    ) -> (Levels<T, N>, Option<[f64; N]>)
    where
        T: Mul<H, Output = T>,
    {
        let zero = T::constant(0.0);
        let half = h * 0.5;
        let middle = t + 0.5 * dt;
        let mut next = self.levels;
        let mut at = self.levels;
        let stages = [
            (h, q.start, t, 1.0),
            (half, q.middle, middle, 2.0),
            (half, q.middle, middle, 2.0),
            (h, q.end, t + dt, 1.0),
        ];
        let mut rates = [zero; N];
        let mut sum = [zero; N];
        let mut begin = [0.0; N];
        for (stage, (ahead, q, t, weight)) in stages.into_iter().enumerate() {
            if stage > 0 {
                for i in 0..self.states {
                    at[i] = self.levels[i] + rates[i] * ahead;
                }
            }
            self.rates_into(&mut rates, &at, q, t);
            if stage == 0 {
                begin = rates.map(T::value);
            }
            for i in 0..self.states {
                sum[i] = sum[i] + rates[i] * weight;
            }
        }
        let sixth = h * (1.0 / 6.0);
        for i in 0..self.states {
            next[i] = next[i] + sum[i] * sixth;
        }
        (next, Some(begin))
    }

    /// `from + by h`.
    #[inline(always)]
    pub(super) fn moved<H: Copy>(
        &self,
        from: &Levels<T, N>,
        by: &Levels<T, N>,
        h: H,
    ) -> Levels<T, N>
    where
        T: Mul<H, Output = T>,
    {
        let mut to = *from;
        for i in 0..self.states {
            to[i] = to[i] + by[i] * h;
        }
        to
    }

    #[inline(always)]
    pub(super) fn weighted<H: Copy + Mul<f64, Output = H>>(
        &self,
        from: &Levels<T, N>,
        h: H,
        [k1, k2, k3, k4]: [&Levels<T, N>; 4],
    ) -> Levels<T, N>
    where
        T: Mul<H, Output = T>,
    {
        let sixth = h * (1.0 / 6.0);
        let mut next = *from;
        for i in 0..self.states {
            next[i] = next[i] + (k1[i] + k2[i] * 2.0 + k3[i] * 2.0 + k4[i]) * sixth;
        }
        next
    }
}
