//! Cuts a step that is long against a vessel's time constant into parts that are accurate and stable.
//!
//! A step of up to one time constant is not cut. A longer step is cut into parts of doubling length: the transient after a jump of the
//! inflow has decayed before the parts are long, and a vessel near its steady state takes the rest in one exponential part. If a level
//! changes so much that its decay rate is not constant, the parts are short or, as a last resort, implicit and of order one.

use crate::{Scalar, inflow::Inflow};

use super::{Vessels, Watch};

/// Runge-Kutta steps are used up to this many time constants of the fastest vessel.
pub(super) const STEP_LIMIT: f64 = 1.0;
/// The same limit near a rim, where linear vessels are integrated by Runge-Kutta steps too.
const STEP_LIMIT_AT_RIM: f64 = 0.125;
/// Largest number of such parts of a step of linear vessels.
const MOST_PARTS: usize = 256;
/// Largest number of parts of a step that is too long for its vessels; a part that is still too long is implicit.
const UNITS: usize = 32;
/// A long part may be as long as the part of the step that is done, if no level will change by more than this share of itself: the fast
/// transient has then decayed.
const SETTLING: f64 = 0.2;
/// The rest of the step is one part if no fast vessel will change by more than this share of its level: the first limit is for all vessels
/// except the last, the second for the last one. A transient that decays before the next reading influences only the vessel that it flows
/// into, so the last vessel may change more.
const SETTLED: [f64; 2] = [1e-4, 1e-2];

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// Advances by `h` from time `start`; `watch` is called for every smooth segment of the watched level, in order.
    pub(crate) fn step(&mut self, h: T, q: &Inflow<T>, start: T, watch: &mut Watch<T>) {
        if self.switches.is_empty() {
            self.stretch(h, q, start, watch);
            return;
        }
        let (mut h, mut q, mut start) = (h, *q, start);
        while let Some((law, at)) = self.next_switch(&start, &h) {
            let (begin, whole) = (start, h);
            let first = at - begin;
            if first.value() >= 0.0 {
                let share = first / whole;
                self.stretch(first, &q.part(T::constant(0.0), share), begin, watch);
                (h, start) = (whole - first, at);
                q = q.part(share, T::constant(1.0));
            }
            self.laws[law].switch_over();
            if let Some(values) = &mut self.values {
                values.laws[law].switch_over();
            }
            self.switches.retain(|&waiting| waiting != law);
        }
        self.stretch(h, &q, start, watch);
    }

    /// The first law that jumps before the end of a step, and the time of the jump.
    fn next_switch(&self, start: &T, h: &T) -> Option<(usize, T)> {
        let end = start.value() + h.value();
        self.switches
            .iter()
            .filter_map(|&law| Some((law, self.laws[law].switch()?)))
            .filter(|(_, at)| at.value() < end)
            .min_by(|a, b| a.1.value().total_cmp(&b.1.value()))
    }

    /// A step within which no law jumps.
    fn stretch(&mut self, h: T, q: &Inflow<T>, start: T, watch: &mut Watch<T>) {
        let zero = T::constant(0.0);
        let plain = h.same_derivatives(zero) && start.same_derivatives(zero);
        let timed = !self.laws.is_empty() || self.feed.is_some();
        self.clock = (!plain && timed).then_some((start, h));
        let t = start.value();
        let wanted = self.fastest * h.value();
        if wanted > STEP_LIMIT {
            self.fast_linear_step(wanted, h, q, t, watch);
        } else if self.rims && wanted > STEP_LIMIT_AT_RIM {
            self.equal_parts(wanted / STEP_LIMIT_AT_RIM, h, q, t, watch);
        } else {
            self.part(h, q, t, watch);
        }
    }

    fn equal_parts(&mut self, wanted: f64, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let parts = (wanted.min(MOST_PARTS as f64).ceil() as usize).next_power_of_two();
        let share = 1.0 / parts as f64;
        let each = h * share;
        for k in 0..parts {
            let edge = |k: usize| T::constant(k as f64 * share);
            let begin = t + k as f64 * each.value();
            self.part(each, &q.part(edge(k), edge(k + 1)), begin, watch);
        }
    }

    /// A step of linear vessels longer than a time constant, in parts of doubling length: the transient after a jump of the input has
    /// decayed before the parts are long. The lengths do not depend on effects, so that a model with an effect at its absent value takes
    /// the steps of the model without it.
    fn fast_linear_step(&mut self, wanted: f64, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let parts = (wanted.min(MOST_PARTS as f64).ceil() as usize).next_power_of_two();
        let share = 1.0 / parts as f64;
        let (mut done, mut length) = (0, 1);
        while done < parts {
            let (from, to) = (done as f64 * share, (done + length) as f64 * share);
            let part = h * (length as f64 * share);
            let q = &q.part(T::constant(from), T::constant(to));
            let begin = t + h.value() * from;
            let quiet = !self.rims || self.quiet_part(part, q, begin, watch);
            if !self.rims {
                self.damping = Some(self.forgetting(begin));
                self.part(part, q, begin, watch);
                self.damping = None;
            } else if !quiet {
                // An event at a rim occurs in this part: short Runge-Kutta steps are used.
                let wanted = self.fastest * part.value() / STEP_LIMIT_AT_RIM;
                self.equal_parts(wanted, part, q, begin, watch);
            }
            done += length;
            length = done;
        }
    }

    /// Takes a part of linear vessels with rims in one step; returns `false` and changes nothing if an event at a rim occurs in it.
    fn quiet_part(&mut self, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) -> bool {
        if self.stiffness(h.value(), q, t) > STEP_LIMIT {
            return false;
        }
        self.settle_modes(q.start, t, None);
        self.damping = Some(self.forgetting(t));
        // A vessel at its rim drives the next vessel by a parabola, for which the exponential step is exact.
        let next = if self.vessels.iter().any(|vessel| vessel.spilling) {
            self.trial(h, q, t)
        } else {
            self.flow(h, q, t)
        };
        let quiet = self.first_event(&next, None, h, q, t).is_none();
        if quiet {
            self.accept(next, h, q, t, watch);
        }
        self.damping = None;
        quiet
    }

    fn part(&mut self, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        if Self::JOINED {
            self.joined_part(h, q, t, watch);
            return;
        }
        if self.stiffness(h.value(), q, t) <= STEP_LIMIT {
            self.unit(h, q, t, watch);
            return;
        }
        let given = self.damping;
        let mut done = 0;
        while done < UNITS {
            let left = UNITS - done;
            let span = |from: usize, to: usize| {
                let edge = |k: usize| T::constant(k as f64 / UNITS as f64);
                let length = h * ((to - from) as f64 / UNITS as f64);
                let begin = t + h.value() * (from as f64 / UNITS as f64);
                (length, q.part(edge(from), edge(to)), begin)
            };
            let (length, inflow, begin) = span(done, UNITS);
            // The longest part that is short enough, in powers of two.
            let stiffness = self.stiffness(h.value(), &inflow, begin);
            let mut units = 1 << left.ilog2();
            while units > 1 && stiffness * units as f64 > STEP_LIMIT * UNITS as f64 {
                units /= 2;
            }
            let short = stiffness * units as f64 <= STEP_LIMIT * UNITS as f64;
            let rates = self.forgetting(begin);
            let calm = if self.linear.is_some() {
                // The stiffness is due to the effects, which the exact decay of the vessels does not include.
                0
            } else {
                self.calm(&rates, length.value(), &inflow, begin, done)
            };
            if calm > units || (calm > 0 && !short) {
                let (length, q, begin) = span(done, done + calm);
                self.damping = Some(rates);
                self.unit(length, &q, begin, watch);
                self.damping = given;
                done += calm;
                continue;
            }
            let (length, q, begin) = span(done, done + units);
            if short {
                self.unit(length, &q, begin, watch);
            } else {
                self.relax(length, &q, begin, watch);
            }
            done += units;
        }
    }

    /// Number of [`UNITS`] that the next part may last although a vessel is faster, after `done` of them; zero if a level changes so much
    /// that its decay rate is not constant.
    fn calm(&self, rates: &[T; N], h: f64, q: &Inflow<T>, t: f64, done: usize) -> usize {
        let left = UNITS - done;
        let mut longest = left;
        let mut inflows = [Some((q.start, t)), Some((q.end, t))];
        match &self.feed {
            // A disturbance that is not held is evaluated at both ends too.
            Some(feed) if !feed.is_held() => inflows[1] = Some((q.end, t + h)),
            _ if q.start.value() == q.end.value() => inflows[1] = None,
            _ => {}
        }
        for (q, t) in inflows.into_iter().flatten() {
            let moves = self.rates(&self.levels, q, t);
            for i in 0..self.states {
                let fast = rates[i].value() * h > STEP_LIMIT;
                let time = if fast { 1.0 / rates[i].value() } else { h };
                let (level, moves) = (self.levels[i].value(), moves[i].value());
                // An empty vessel without inflow stays empty.
                let share = if level <= 0.0 && moves <= 0.0 {
                    0.0
                } else {
                    // The relative change of a square root's slope is half the relative change of its argument.
                    let bends = 2.0 * time * self.forgetting_changes(i, moves * time, t);
                    (moves * time / level).abs().max(bends)
                };
                let settled = SETTLED[usize::from(i + 1 == self.vessels.len())];
                if share.is_nan() || share > SETTLING {
                    return 0;
                }
                if fast && share > settled {
                    longest = longest.min(done.max(1));
                }
            }
        }
        longest
    }

    /// A step that is short enough for its vessels.
    pub(super) fn unit(&mut self, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        if self.rims {
            self.step_with_rims(h, q, t, watch);
            return;
        }
        let next = self.flow(h, q, t);
        self.accept(next, h, q, t, watch);
    }
}
