//! A running controller: it computes commands from set points and readings.

use super::{Controller, Kind};
use crate::{Error, Scalar};

/// A running controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Regulator<T> {
    pub(super) controller: Controller,
    pub(super) states: Vec<T>,
    pub(super) limited: bool,
}

impl<T: Scalar> Regulator<T> {
    /// The command for a set point and a reading, to be held over the next `h` seconds.
    pub fn command(&mut self, reference: f64, reading: T, h: f64) -> T {
        self.command_beside(reference, reading, 0.0, h)
    }

    /// As [`Self::command`], with a signal `beside` that is added to the command before the limits.
    pub fn command_beside(&mut self, reference: f64, reading: T, beside: f64, h: f64) -> T {
        let error = -reading + reference;
        let limits = self.controller.limits;
        let limit = |wanted: T| {
            if wanted.value() > limits.1 {
                T::constant(limits.1)
            } else if wanted.value() < limits.0 {
                T::constant(limits.0)
            } else {
                wanted
            }
        };
        let states = &mut self.states;
        match &self.controller.kind {
            Kind::Pi {
                gain,
                integral_time,
                integral_first,
            } => {
                let next = states[0] + error * (gain * h / integral_time);
                let integral = if *integral_first { next } else { states[0] };
                let wanted = integral + error * *gain + beside;
                let given = limit(wanted);
                self.limited = wanted.value() != given.value();
                let push = gain * error.value();
                let outwards = (wanted.value() - given.value()) * push > 0.0;
                if !outwards {
                    states[0] = next;
                }
                given
            }
            Kind::Sampled {
                r,
                s,
                operating_point,
            } => {
                let order = r.len() - 1;
                let at_rest = if *operating_point {
                    states[order]
                } else {
                    T::constant(0.0)
                };
                let seen = if order > 0 {
                    states[0]
                } else {
                    T::constant(0.0)
                };
                let wanted = at_rest + seen + error * r[0] + beside;
                let given = limit(wanted);
                self.limited = wanted.value() != given.value();
                // `beside` does not pass through the controller's recursion.
                let own = given - at_rest - beside;
                for i in 0..order {
                    let next = if i + 1 < order {
                        states[i + 1]
                    } else {
                        T::constant(0.0)
                    };
                    states[i] = next + error * r[i + 1] - own * s[i + 1];
                }
                given
            }
        }
    }

    /// The reading for which the next command is this one; `None` if the command is at a limit or does not depend on the present reading.
    #[must_use]
    pub fn reading_for(&self, reference: f64, command: f64, h: f64) -> Option<T> {
        let (low, high) = self.controller.limits;
        let (direct, at_zero) = match &self.controller.kind {
            Kind::Pi {
                gain,
                integral_time,
                integral_first,
            } => {
                let first = if *integral_first {
                    h / integral_time
                } else {
                    0.0
                };
                (gain * (1.0 + first), self.states[0])
            }
            Kind::Sampled {
                r, operating_point, ..
            } => {
                let order = r.len() - 1;
                let seen = |i: usize, there: bool| there.then(|| self.states[i]);
                let states = [seen(0, order > 0), seen(order, *operating_point)];
                let states = states.into_iter().flatten();
                (
                    r[0],
                    states.fold(T::constant(0.0), |sum, state| sum + state),
                )
            }
        };
        let error = (-at_zero + command) * (1.0 / direct);
        let is_free = direct != 0.0 && command > low && command < high;
        is_free.then(|| -error + reference)
    }

    /// Whether the last command was at a limit.
    #[must_use]
    pub fn limited(&self) -> bool {
        self.limited
    }
}

/// A running PI controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Pi(Regulator<f64>);

impl Pi {
    /// `gain` \[input/output\], `integral_time` \[s\], `limits` and `operating_point` \[input\].
    ///
    /// # Errors
    /// As [`Controller::pi`].
    pub fn new(
        gain: f64,
        integral_time: f64,
        limits: (f64, f64),
        operating_point: f64,
    ) -> Result<Self, Error> {
        Ok(Self(
            Controller::pi(gain, integral_time, limits)?.start(&[operating_point]),
        ))
    }

    /// The command for a set point and a reading, to be held over the next `h` seconds.
    pub fn command(&mut self, reference: f64, reading: f64, h: f64) -> f64 {
        self.0.command(reference, reading, h)
    }
}
