//! The actuator: static laws on the command, then dead time, then lag.

use std::collections::VecDeque;

use crate::{Law, Scalar, moments::exponential_moments, vessels::Inflow};

/// A straight piece of the command: from `value` at `time`, `slope` a second.
#[derive(Clone, Copy)]
struct Piece<T> {
    time: f64,
    value: T,
    slope: T,
}

pub(crate) struct Actuator<T: Scalar> {
    laws: Vec<Box<dyn Law<T>>>,
    delay: Option<T>,
    lag: Option<T>,
    /// By how much the lagged signal exceeds the one it follows.
    excess: T,
    /// What the command was, oldest first; only kept where there is a delay.
    past: VecDeque<Piece<T>>,
    /// Where the last step ended: the command after delay, for the lag's jump.
    last: T,
}

impl<T: Scalar> Actuator<T> {
    /// `at_rest`: the command before the record began.
    pub(crate) fn new(laws: Vec<Box<dyn Law<T>>>, at_rest: f64, start: f64) -> Self {
        let delay = laws.iter().find_map(|law| law.delay());
        let lag = laws.iter().find_map(|law| law.actuator_lag());
        let mut actuator = Self {
            laws,
            delay,
            lag,
            excess: T::constant(0.0),
            past: VecDeque::new(),
            last: T::constant(0.0),
        };
        actuator.last = actuator.effective(at_rest, start);
        if delay.is_some() {
            let zero = T::constant(0.0);
            actuator.past.push_back(Piece {
                time: f64::NEG_INFINITY,
                value: actuator.last,
                slope: zero,
            });
        }
        actuator
    }

    fn effective(&mut self, u: f64, t: f64) -> T {
        self.laws
            .iter_mut()
            .fold(T::constant(u), |u, law| law.command(u, t))
    }

    /// Runs `each(length, command)` over the pieces of one sampling interval, in order: a piece is smooth,
    /// and the command on it is what arrives after static laws and dead time.
    pub(crate) fn pieces(
        &mut self,
        from: f64,
        to: Option<f64>,
        t: f64,
        h: f64,
        mut each: impl FnMut(&mut Self, T, Inflow<T>),
    ) {
        let start = self.effective(from, t);
        let length = T::constant(h);
        let command = match to {
            None => Inflow::held(start),
            Some(to) => Inflow {
                start,
                middle: self.effective(0.5 * (from + to), t + 0.5 * h),
                end: self.effective(to, t + h),
            },
        };
        let Some(delay) = self.delay else {
            each(self, length, command);
            return;
        };
        let slope = (command.end - command.start) * (1.0 / h);
        self.past.push_back(Piece {
            time: t,
            value: command.start,
            slope,
        });
        // Break points: where a past piece begins to arrive, in time from the start of this interval.
        let arrives = |piece: &Piece<T>| delay + (piece.time - t);
        while self.past.len() > 1 && arrives(&self.past[1]).value() < 0.0 {
            self.past.pop_front();
        }
        let mut begin = T::constant(0.0);
        let mut index = 0;
        loop {
            let piece = self.past[index];
            let next = self
                .past
                .get(index + 1)
                .map(arrives)
                .filter(|next| next.value() < h);
            let end = next.unwrap_or(length);
            let at = |s: T| {
                if piece.time.is_finite() {
                    piece.value + piece.slope * (s - arrives(&piece))
                } else {
                    piece.value
                }
            };
            let signal = Inflow {
                start: at(begin),
                middle: at((begin + end) * 0.5),
                end: at(end),
            };
            each(self, end - begin, signal);
            if next.is_none() {
                return;
            }
            begin = end;
            index += 1;
        }
    }

    /// The signal behind the lag over a stretch of length `h`, as the parabola with the same first three moments.
    pub(crate) fn lagged(&mut self, h: T, command: Inflow<T>) -> Inflow<T> {
        let Some(lag) = self.lag else { return command };
        // The lag follows continuously: what the command jumps by is added to the excess.
        self.excess = self.excess + (self.last - command.start);
        self.last = command.end;
        if h.value() == 0.0 {
            if lag.value() > 0.0 {
                self.excess = self.excess - self.excess / lag * h;
            }
            return command.map(|c| c + self.excess);
        }
        // Behind a polynomial w the lag settles to w - T w' + T^2 w''; the rest decays.
        let [_, b, c] = command.coefficients();
        let e = lag / h;
        let settled = |s: f64| -(e * (b + c * (2.0 * s))) + e * e * c * 2.0;
        let amplitude = self.excess - settled(0.0);
        let (decay, [m0, m1, m2]) = exponential_moments(lag, h);
        let (l0, l1, l2) = (m0, m1 * 2.0 - m0, (m2 - m1) * 6.0 + m0);
        let at = |s: f64| {
            let (p1, p2) = (2.0 * s - 1.0, 6.0 * s * s - 6.0 * s + 1.0);
            settled(s) + amplitude * (l0 + l1 * (3.0 * p1) + l2 * (5.0 * p2))
        };
        let behind = Inflow {
            start: command.start + at(0.0),
            middle: command.middle + at(0.5),
            end: command.end + at(1.0),
        };
        self.excess = amplitude * decay + settled(1.0);
        behind
    }
}
