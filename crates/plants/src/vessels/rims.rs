//! Steps of vessels with rims: which vessels overflow, and the time at which a level reaches or leaves its rim. The time is located such
//! that the step keeps its order and its derivatives.

use crate::{Scalar, inflow::Inflow};

use super::{Levels, Vessel, Vessels, Watch};

/// Largest number of events at rims within a step.
const MOST_EVENTS: usize = 12;

/// An event that ends a smooth segment.
pub(super) enum Event<T> {
    /// A vessel's level reaches its rim after this part of the step.
    Rim(usize, T),
    /// A vessel stops overflowing after this part of the step.
    Release(usize, T),
}

impl<T: Scalar, const N: usize> Vessels<T, N> {
    pub(super) fn step_with_rims(&mut self, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let (mut h, mut q, mut t) = (h, *q, t);
        let mut released = None;
        let whole = self.clock;
        // Each vessel can reach and leave its rim a few times within a step; more events are chattering.
        for _ in 0..MOST_EVENTS {
            self.settle_modes(q.start, t, released);
            let (next, begin) = self.trial_and_rates(h, &q, t);
            let Some(event) = self.first_event(&next, begin, h, &q, t) else {
                self.accept(next, h, &q, t, watch);
                self.clock = whole;
                return;
            };
            let (Event::Rim(_, part) | Event::Release(_, part)) = event;
            let first = &q.part(T::constant(0.0), part);
            // The time of the event has derivatives. So do all times within the step that ends at the event, and the time at which the rest
            // of the step begins.
            let begin = self.time(t);
            self.clock = Some((begin, h * part));
            let there = self.trial(h * part, first, t);
            self.accept(there, h * part, first, t, watch);
            released = match event {
                Event::Rim(i, _) => {
                    self.levels[i] = self.vessels[i].rim.level;
                    None
                }
                Event::Release(i, _) => Some(i),
            };
            let instant = begin + h * part;
            t += (h * part).value();
            q = q.part(part, T::constant(1.0));
            h = h - h * part;
            self.clock = Some((instant, h));
        }
        let next = self.trial(h, &q, t);
        self.accept(next, h, &q, t, watch);
        self.clock = whole;
    }

    /// Sets which vessels overflow: those at their rim with a positive net inflow, except one that has just stopped overflowing.
    pub(super) fn settle_modes(&mut self, q: T, t: f64, released: Option<usize>) {
        for vessel in &mut self.vessels {
            vessel.spilling = false;
        }
        let below = |(vessel, level): (&Vessel<T>, &T)| level.value() < vessel.rim.level.value();
        if self.vessels.iter().zip(&self.levels).all(below) {
            return;
        }
        let mut inflow = q;
        for i in 0..self.vessels.len() {
            if Self::JOINED && i + 1 == N {
                inflow = inflow + self.fed(t);
            }
            let (outflow, net) = self.balance(i, inflow, &self.levels, t);
            let vessel = &mut self.vessels[i];
            vessel.spilling = self.levels[i].value() >= vessel.rim.level.value()
                && net.value() > 0.0
                && released != Some(i);
            inflow = outflow;
            if vessel.spilling {
                inflow = inflow + net * vessel.rim.fraction;
            }
        }
    }

    /// The first event within the step that would lead to `next`, if there is one; `begin`: the rates at the beginning of the step, if they
    /// are known.
    pub(super) fn first_event(
        &self,
        next: &Levels<T, N>,
        begin: Option<[f64; N]>,
        h: T,
        q: &Inflow<T>,
        t: f64,
    ) -> Option<Event<T>> {
        let at = |s: f64| {
            let part = T::constant(s);
            let piece = q.part(T::constant(0.0), part);
            (
                self.trial(h * part, &piece, t),
                piece.end,
                t + s * h.value(),
            )
        };
        let mut first: Option<(f64, usize)> = None;
        for (i, vessel) in self.vessels.iter().enumerate() {
            let rim = vessel.rim.level.value();
            if rim == f64::INFINITY {
                continue;
            }
            // A function that is positive after the event.
            let past = |levels: &Levels<T, N>, q: T, t: f64| {
                if vessel.spilling {
                    -self.net(i, levels, q, t).value()
                } else {
                    levels[i].value() - rim
                }
            };
            let low = past(&self.levels, q.start, t);
            let (mut end, mut high) = (1.0, past(next, q.end, t + h.value()));
            if low >= 0.0 {
                // The vessel has just stopped overflowing, or is at the rim with a net inflow of zero.
                continue;
            }
            if high <= 0.0 {
                if vessel.spilling {
                    continue;
                }
                // The level may exceed the rim in between: the maximum of the cubic through the levels and rates at both ends is checked.
                let begin = begin.map(|rates| rates[i]);
                let top = self.top(i, next, begin, h, q, t);
                let Some(top) = top.filter(|&(_, level)| level > rim) else {
                    continue;
                };
                let (levels, q, t) = at(top.0);
                (end, high) = (top.0, past(&levels, q, t));
                if high <= 0.0 {
                    continue;
                }
            }
            let s = crossing((0.0, low), (end, high), |s| {
                let (levels, q, t) = at(s);
                past(&levels, q, t)
            });
            if first.is_none_or(|(earlier, _)| s < earlier) {
                first = Some((s, i));
            }
        }
        let (s, i) = first?;
        // One Newton iteration in duals gives the derivatives of the event time: those of the numerical steps, not of the exact solution;
        // therefore the slope is a finite difference.
        let spilling = self.vessels[i].spilling;
        let past = |s: f64| {
            let (levels, q, t) = at(s);
            if spilling {
                -self.net(i, &levels, q, t)
            } else {
                levels[i] - self.vessels[i].rim.level
            }
        };
        let slope = (past(s + 1e-4).value() - past(s - 1e-4).value()) * 5e3;
        if slope <= 0.0 {
            return None;
        }
        let part = (T::constant(s) - past(s) * (1.0 / slope)).max(T::constant(0.0));
        (part.value() < 1.0).then_some(if spilling {
            Event::Release(i, part)
        } else {
            Event::Rim(i, part)
        })
    }

    /// Position and value of the maximum of a vessel's level within the step; `None` if the maximum is at an end.
    fn top(
        &self,
        i: usize,
        next: &Levels<T, N>,
        begin: Option<f64>,
        h: T,
        q: &Inflow<T>,
        t: f64,
    ) -> Option<(f64, f64)> {
        let dt = h.value();
        let begin = begin.unwrap_or_else(|| self.rates(&self.levels, q.start, t)[i].value()) * dt;
        if begin <= 0.0 {
            return None;
        }
        let end = self.rates(next, q.end, t + dt)[i].value() * dt;
        if end >= 0.0 {
            return None;
        }
        let before = self.levels[i].value();
        let rise = next[i].value() - before;
        // Rate along the cubic: begin + b s + c s^2, positive at the beginning and negative at the end, so there is one root in between.
        let b = 6.0 * rise - 4.0 * begin - 2.0 * end;
        let c = 3.0 * (begin + end - 2.0 * rise);
        let root = (b * b - 4.0 * begin * c).max(0.0).sqrt();
        let s = 2.0 * begin / (root - b);
        let level = before + s * (begin + s * (0.5 * b + s * c / 3.0));
        (s > 0.0 && s < 1.0).then_some((s, level))
    }
}

/// The sign change of a function that is negative at `low` and positive at `high`, by the Illinois variant of regula falsi. Nine digits are
/// sufficient: for a contact with the rim a Newton iteration follows, and at the end of overflow the rate is nearly zero.
pub(super) fn crossing(
    mut low: (f64, f64),
    mut high: (f64, f64),
    mut f: impl FnMut(f64) -> f64,
) -> f64 {
    let mut last = f64::NAN;
    let mut side = 0;
    for _ in 0..60 {
        // Not `clamp`, which panics if a bound is NaN.
        let s = ((low.0 * high.1 - high.0 * low.1) / (high.1 - low.1))
            .max(low.0)
            .min(high.0);
        if (s - last).abs() < 1e-9 || high.0 - low.0 < 1e-9 {
            return s;
        }
        last = s;
        let value = f(s);
        if value > 0.0 {
            high = (s, value);
            if side == 1 {
                low.1 *= 0.5;
            }
            side = 1;
        } else {
            low = (s, value);
            if side == -1 {
                high.1 *= 0.5;
            }
            side = -1;
        }
    }
    last
}
