//! The actuator: static nonlinearities of the command, then dead time, then a first-order lag.

use std::collections::VecDeque;

use crate::{
    Law, Scalar,
    inflow::Inflow,
    moments::{KeptMoments, decayed},
};

/// Corners of a ramp that are closer together than this share of the sampling interval are merged.
const SAME_CORNER: f64 = 1e-9;

/// A smooth segment of the command: `value + slope s + curve s^2`, where `s` is the time since the segment began \[s\].
#[derive(Clone, Copy)]
pub(crate) struct Signal<T> {
    value: T,
    slope: T,
    curve: T,
    /// `slope` and `curve` are zero: the command is constant.
    held: bool,
}

impl<T: Scalar> Signal<T> {
    fn held(value: T) -> Self {
        let zero = T::constant(0.0);
        Self {
            value,
            slope: zero,
            curve: zero,
            held: true,
        }
    }

    fn at(&self, s: T) -> T {
        if self.held {
            self.value
        } else {
            self.value + (self.slope + self.curve * s) * s
        }
    }

    /// The same signal with its time origin moved to `s`.
    pub(crate) fn from(&self, s: T) -> Self {
        if self.held {
            return *self;
        }
        Self {
            value: self.at(s),
            slope: self.slope + self.curve * s * 2.0,
            ..*self
        }
    }

    fn over(&self, h: T) -> Inflow<T> {
        if self.held {
            return Inflow::held(self.value);
        }
        Inflow {
            start: self.value,
            middle: self.at(h * 0.5),
            end: self.at(h),
        }
    }
}

/// A commanded segment that began `after` seconds after `time`.
#[derive(Clone, Copy)]
struct Piece<T> {
    time: f64,
    after: T,
    signal: Signal<T>,
}

pub(crate) struct Actuator<T: Scalar> {
    laws: Vec<Box<dyn Law<T>>>,
    delay: Option<T>,
    lag: Option<KeptMoments<T>>,
    /// Output of the lag minus its input.
    excess: T,
    /// Past commands, oldest first; stored only if there is a dead time.
    past: VecDeque<Piece<T>>,
    /// Corners of a ramp as shares of the sampling interval (scratch space).
    corners: Vec<T>,
    /// Delayed command at the end of the last step: the lag needs it to find the jump of its input.
    last: T,
    /// Position of the element that the command moves, after backlash or stiction.
    stands: f64,
    /// The pump's gain is a function of time.
    drifts: bool,
}

impl<T: Scalar> Actuator<T> {
    /// `at_rest`: the constant command before the record began.
    pub(crate) fn new(laws: Vec<Box<dyn Law<T>>>, at_rest: f64, start: f64) -> Self {
        let delay = laws.iter().find_map(|law| law.delay());
        let lag = laws.iter().find_map(|law| law.actuator_lag());
        let lag = lag.map(KeptMoments::new);
        let zero = T::constant(0.0);
        let drifts = laws.iter().any(|law| law.gain(zero).is_some());
        let mut actuator = Self {
            laws,
            delay,
            lag,
            excess: zero,
            past: VecDeque::new(),
            corners: Vec::new(),
            last: zero,
            stands: at_rest,
            drifts,
        };
        let at_rest = actuator.position(T::constant(at_rest));
        actuator.last = actuator.effective(at_rest, start);
        if delay.is_some() {
            actuator.past.push_back(Piece {
                time: f64::NEG_INFINITY,
                after: zero,
                signal: Signal::held(actuator.last),
            });
        }
        actuator
    }

    /// Sets an initial state of the lag other than steady state: `h` before the record began, its output exceeded its input by `before`.
    pub(crate) fn set_initial_state(&mut self, before: T, h: f64) {
        if let Some(lag) = &self.lag {
            self.excess = decayed(before, lag.time_constant, h);
        }
    }

    /// Position of the actuator at a recorded command.
    fn position(&mut self, u: T) -> T {
        let moved = self.laws.iter_mut().find_map(|law| law.position(u));
        let position = moved.unwrap_or(u);
        self.stands = position.value();
        position
    }

    pub(crate) fn stands(&self) -> f64 {
        self.stands
    }

    fn effective(&mut self, u: T, t: f64) -> T {
        self.laws.iter_mut().fold(u, |u, law| law.command(u, t))
    }

    /// Finds the corners of a ramp after the static nonlinearities, as shares of the interval: zero, the corners, one.
    fn find_corners(&mut self, from: T, to: T, t: f64, h: f64) {
        self.corners.clear();
        self.corners.extend([T::constant(0.0), T::constant(1.0)]);
        for i in 0..self.laws.len() {
            for corner in self.laws[i].corners().into_iter().flatten() {
                let mut k = 0;
                while k + 1 < self.corners.len() {
                    let (low, high) = (self.corners[k], self.corners[k + 1]);
                    let mut before = |s: T| {
                        let time = t + s.value() * h;
                        self.laws[..i]
                            .iter_mut()
                            .fold((to - from) * s + from, |u, law| law.command(u, time))
                    };
                    let (a, b) = (before(low) - corner, before(high) - corner);
                    if a.value() * b.value() < 0.0 {
                        let at = low - (high - low) * a / (b - a);
                        if at.value() - low.value() > SAME_CORNER
                            && high.value() - at.value() > SAME_CORNER
                        {
                            self.corners.insert(k + 1, at);
                            k += 1;
                        }
                    }
                    k += 1;
                }
            }
        }
    }

    /// The smooth segment between two shares of a ramp's interval.
    fn stretch(&mut self, ramp: (T, T), t: f64, h: f64, low: T, high: T) -> Signal<T> {
        let (from, to) = ramp;
        let mut at = |share: f64| {
            let s = low + (high - low) * share;
            self.effective((to - from) * s + from, t + s.value() * h)
        };
        // The points are strictly inside: at a corner the derivatives could be those of the neighbouring segment.
        let (first, middle, last) = (at(0.25), at(0.5), at(0.75));
        let mut bend = first + last - middle * 2.0;
        let largest = first.value().abs().max(last.value().abs());
        if bend.value().abs() <= 4.0 * f64::EPSILON * largest {
            // The value of `bend` is rounding error here, but its derivatives need not be.
            bend = bend - bend.value();
        }
        let slope = (last - first) * 2.0;
        let inverse = T::constant(1.0) / ((high - low) * h);
        Signal {
            value: middle - slope * 0.5 + bend * 2.0,
            slope: (slope - bend * 8.0) * inverse,
            curve: bend * 8.0 * inverse * inverse,
            held: false,
        }
    }

    /// Calls `each(length, command)` for the smooth pieces of one sampling interval in order of time. `command` is the command after the
    /// static nonlinearities and the dead time.
    pub(crate) fn pieces(
        &mut self,
        from: T,
        to: Option<f64>,
        t: f64,
        h: f64,
        mut each: impl FnMut(&mut Self, T, Signal<T>),
    ) {
        let length = T::constant(h);
        let zero = T::constant(0.0);
        let from = self.position(from);
        let commanded = match to.map(|to| self.position(T::constant(to))) {
            None => {
                let signal = Signal::held(self.effective(from, t));
                if self.delay.is_none() {
                    each(self, length, signal);
                    return;
                }
                self.past.push_back(Piece {
                    time: t,
                    after: zero,
                    signal,
                });
                None
            }
            Some(to) => Some((from, to)),
        };
        if let Some(ramp) = commanded {
            self.find_corners(ramp.0, ramp.1, t, h);
            for k in 0..self.corners.len() - 1 {
                let (low, high) = (self.corners[k], self.corners[k + 1]);
                let signal = self.stretch(ramp, t, h, low, high);
                if self.delay.is_some() {
                    self.past.push_back(Piece {
                        time: t,
                        after: low * h,
                        signal,
                    });
                } else {
                    each(self, (high - low) * h, signal);
                }
            }
        }
        let Some(delay) = self.delay else { return };
        // Break points: the times, from the start of this interval, at which a past piece comes out of the dead time.
        let arrives = |piece: &Piece<T>| delay + piece.after + (piece.time - t);
        while self.past.len() > 1 && arrives(&self.past[1]).value() < 0.0 {
            self.past.pop_front();
        }
        let mut begin = zero;
        let mut index = 0;
        loop {
            let piece = self.past[index];
            let next = self
                .past
                .get(index + 1)
                .map(arrives)
                .filter(|next| next.value() < h);
            let end = next.unwrap_or(length);
            let signal = if piece.signal.held {
                piece.signal
            } else {
                piece.signal.from(begin - arrives(&piece))
            };
            each(self, end - begin, signal);
            if next.is_none() {
                return;
            }
            begin = end;
            index += 1;
        }
    }

    /// The inflow over a segment of length `h` from time `start` on: the lag output times the pump's gain.
    #[inline]
    pub(crate) fn inflow(&mut self, h: T, command: Signal<T>, gain: T, start: T) -> Inflow<T> {
        if self.drifts {
            let ahead = self.lagged(h, command);
            let gain = |share: f64| {
                let t = start + h * share;
                let factors = self.laws.iter().filter_map(|law| law.gain(t));
                factors.fold(gain, |gain, factor| gain * factor)
            };
            return Inflow {
                start: gain(0.0) * ahead.start,
                middle: gain(0.5) * ahead.middle,
                end: gain(1.0) * ahead.end,
            };
        }
        if command.held && self.lag.is_none() {
            return Inflow::held(gain * command.value);
        }
        self.lagged(h, command).map(|u| gain * u)
    }

    /// The lag output over a segment of length `h`, as the parabola with the same first three moments.
    fn lagged(&mut self, h: T, command: Signal<T>) -> Inflow<T> {
        let ahead = command.over(h);
        let Some(kept) = &mut self.lag else {
            return ahead;
        };
        let lag = kept.time_constant;
        // The lag output is continuous: a jump of the lag input changes the excess by the opposite amount.
        self.excess = self.excess + (self.last - command.value);
        self.last = ahead.end;
        if h.value() == 0.0 {
            // A segment of length zero leaves the state unchanged, but its length may have derivatives.
            let behind = ahead.map(|c| c + self.excess);
            self.excess = self.excess - command.slope * h;
            if lag.value() > 0.0 {
                self.excess = self.excess - self.excess / lag * h;
            }
            return behind;
        }
        // For a polynomial input w, the lag output tends to w - T w' + T^2 w''; the difference from that decays exponentially.
        let settled = |s: T| {
            -(lag * (command.slope + command.curve * s * 2.0)) + lag * lag * command.curve * 2.0
        };
        let amplitude = self.excess - settled(T::constant(0.0));
        let (decay, [m0, m1, m2]) = kept.over(h);
        let (l0, l1, l2) = (m0, m1 * 2.0 - m0, (m2 - m1) * 6.0 + m0);
        let at = |s: f64| {
            let (p1, p2) = (2.0 * s - 1.0, 6.0 * s * s - 6.0 * s + 1.0);
            settled(h * s) + amplitude * (l0 + l1 * (3.0 * p1) + l2 * (5.0 * p2))
        };
        let behind = Inflow {
            start: ahead.start + at(0.0),
            middle: ahead.middle + at(0.5),
            end: ahead.end + at(1.0),
        };
        self.excess = amplitude * decay + settled(h);
        behind
    }
}
