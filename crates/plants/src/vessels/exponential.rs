//! A step that integrates a deviation from an exact solution: that of linear vessels without effects, or each vessel's exponential decay.
//!
//! The deviation is integrated by a Runge-Kutta step of order four if the step is short against the vessels' time constants, and by the
//! exponential Runge-Kutta step of [`Damped`] if it is long: the stages of S. M. Cox and P. C. Matthews (2002), equations (26) to (29), for
//! a chain in which each vessel also drives the next one.

use crate::{Scalar, damped::Damped, inflow::Inflow, linear::Propagators};

use super::{Levels, Vessels};

/// Linear vessels have an exact solution; the deviation that effects cause is integrated separately, so that it is exactly zero for effects
/// at their absent values.
pub(super) struct LinearFlow<T> {
    pub whole: Propagators<T>,
    pub half: Propagators<T>,
    /// The second vessel alone, if a measured disturbance flows into it: by superposition, its contribution is added.
    pub fed: Option<Propagators<T>>,
    /// Effects are active, so that the exact solution of the nominal vessels is not complete.
    pub disturbed: bool,
}

/// The exact solution over one step.
pub(super) struct Flow<T, const N: usize> {
    half: Levels<T, N>,
    whole: Levels<T, N>,
    /// For two vessels: the coupling from the first to the second.
    handed: Option<Handed<T>>,
}

/// Contributions of the first linear vessel to the second one.
#[derive(Clone, Copy)]
struct Handed<T> {
    /// In half a step, per unit of initial deviation of the first vessel's level.
    deviation: T,
    /// In half a step, per unit of a constant drive of the first vessel.
    drive: T,
    /// In a whole step, for the coefficients of a drive `a + b s + c s^2` of the first vessel.
    whole: [T; 3],
}

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// The levels after a step without events.
    pub(super) fn flow(&mut self, h: T, q: &Inflow<T>, t: f64) -> Levels<T, N> {
        let linear = self.linear.as_ref();
        let fed = linear.and_then(|flow| flow.fed.as_ref().and(self.feed_over(h, t)));
        let Some(flow) = &mut self.linear else {
            return self.trial(h, q, t);
        };
        let (begin, middle) = (T::constant(0.0), T::constant(0.5));
        let mut whole = flow.whole.advance(&self.levels, h, q);
        if let (Some(lower), Some(fed)) = (&mut flow.fed, &fed) {
            whole[1] = whole[1] + brought(lower, h, fed);
        }
        if !flow.disturbed {
            return whole;
        }
        let first = q.part(begin, middle);
        let mut half = flow.half.advance(&self.levels, h * 0.5, &first);
        if let (Some(lower), Some(fed)) = (&mut flow.fed, &fed) {
            half[1] = half[1] + brought(lower, h * 0.5, &fed.part(begin, middle));
        }
        let handed = (self.vessels.len() == 2 && h.value() > 0.0).then(|| {
            // A drive of the level (a rate) is an inflow divided by the area.
            let area = self.vessels[0].area;
            let (deviation, [drive, ..]) = flow.half.second_from(h * 0.5);
            let (_, whole) = flow.whole.second_from(h);
            Handed {
                deviation,
                drive: drive * area,
                whole: whole.map(|weight| weight * area),
            }
        });
        let flow = Flow {
            half,
            whole,
            handed,
        };
        self.linear_trial(&flow, h, q, t)
    }

    /// One step of linear vessels: the exact solution, and a Runge-Kutta step for the deviation that the effects cause.
    fn linear_trial(&self, flow: &Flow<T, N>, h: T, q: &Inflow<T>, t: f64) -> Levels<T, N> {
        let (whole, half) = (flow.whole, flow.half);
        let dt = h.value();
        if let Some(rates) = self.damping {
            return self.damped_trial(rates, Some(flow), h, q, t);
        }
        let added = |levels: &Levels<T, N>, flow: &Levels<T, N>, q: T, t: f64| {
            let mut rates = self.rates(levels, q, t);
            let linear = self.linear_rates(flow, q, t);
            for (rate, linear) in rates.iter_mut().zip(linear) {
                *rate = *rate - linear;
            }
            rates
        };
        let k1 = added(&self.levels, &self.levels, q.start, t);
        let k2 = added(
            &self.moved(&half, &k1, h * 0.5),
            &half,
            q.middle,
            t + 0.5 * dt,
        );
        let k3 = added(
            &self.moved(&half, &k2, h * 0.5),
            &half,
            q.middle,
            t + 0.5 * dt,
        );
        let k4 = added(&self.moved(&whole, &k3, h), &whole, q.end, t + dt);
        self.weighted(&whole, h, [&k1, &k2, &k3, &k4])
    }

    /// One step of the deviation from an exact solution, or from constant levels, with each vessel's decay integrated exactly.
    pub(super) fn damped_trial(
        &self,
        rates: [T; N],
        flow: Option<&Flow<T, N>>,
        h: T,
        q: &Inflow<T>,
        t: f64,
    ) -> Levels<T, N> {
        let n = self.states;
        let zero = [T::constant(0.0); N];
        let damped: [Damped<T>; N] = std::array::from_fn(|i| Damped::new(rates[i], h));
        let [begin, half, whole] = match flow {
            Some(flow) => [&self.levels, &flow.half, &flow.whole],
            None => [&self.levels; 3],
        };
        // The drive of the deviation: all of its rate except each vessel's decay and the coupling of linear vessels.
        let driving = |at: &Levels<T, N>, deviation: &Levels<T, N>, q: T, t: f64| {
            let mut levels = *at;
            for i in 0..n {
                levels[i] = levels[i] + deviation[i];
            }
            let mut drive = self.rates(&levels, q, t);
            for i in 0..n {
                drive[i] = drive[i] + deviation[i] * rates[i];
            }
            if flow.is_some() {
                for (drive, own) in drive.iter_mut().zip(self.linear_rates(at, q, t)) {
                    *drive = *drive - own;
                }
                for i in 1..self.vessels.len() {
                    drive[i] = drive[i] - deviation[i - 1] * self.vessels[i].inverse;
                }
            }
            drive
        };
        // Contributions of the first vessel's deviation and drive to the second vessel, in half a step and in a whole step.
        let handed = flow.and_then(|flow| flow.handed);
        let middle = t + 0.5 * h.value();
        let from_zero = |k: &Levels<T, N>| {
            let mut d = zero;
            for i in 0..n {
                d[i] = damped[i].half(k[i]);
            }
            if let Some(handed) = &handed {
                d[1] = d[1] + k[0] * handed.drive;
            }
            d
        };
        let k1 = driving(begin, &zero, q.start, t);
        let d2 = from_zero(&k1);
        let k2 = driving(half, &d2, q.middle, middle);
        let k3 = driving(half, &from_zero(&k2), q.middle, middle);
        let mut d4 = zero;
        for i in 0..n {
            d4[i] = damped[i].half_from(d2[i], k3[i] * 2.0 - k1[i]);
        }
        if let Some(handed) = &handed {
            d4[1] = d4[1] + d2[0] * handed.deviation + (k3[0] * 2.0 - k1[0]) * handed.drive;
        }
        let k4 = driving(whole, &d4, q.end, t + h.value());
        let mut next = *whole;
        for i in 0..n {
            next[i] = next[i] + damped[i].whole([k1[i], (k2[i] + k3[i]) * 0.5, k4[i]]);
        }
        if let Some(handed) = &handed {
            let drive = Inflow {
                start: k1[0],
                middle: (k2[0] + k3[0]) * 0.5,
                end: k4[0],
            };
            for (c, weight) in drive.coefficients().into_iter().zip(handed.whole) {
                next[1] = next[1] + c * weight;
            }
        }
        next
    }
}

/// The output of a lag after a step of length `h` under an inflow, from an initial value of zero.
fn brought<T: Scalar>(lag: &mut Propagators<T>, h: T, inflow: &Inflow<T>) -> T {
    let [level] = lag.advance(&[T::constant(0.0)], h, inflow);
    level
}
