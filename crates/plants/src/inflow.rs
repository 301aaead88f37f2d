//! The inflow to the vessels over one step.

use crate::Scalar;

/// The inflow to the first vessel over a step: a parabola through its values at the beginning, the middle and the end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inflow<T> {
    pub start: T,
    pub middle: T,
    pub end: T,
}

impl<T: Scalar> Inflow<T> {
    pub(crate) fn held(q: T) -> Self {
        Self {
            start: q,
            middle: q,
            end: q,
        }
    }

    pub(crate) fn map(self, mut f: impl FnMut(T) -> T) -> Self {
        Self {
            start: f(self.start),
            middle: f(self.middle),
            end: f(self.end),
        }
    }

    /// The sum of two inflows.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            start: self.start + other.start,
            middle: self.middle + other.middle,
            end: self.end + other.end,
        }
    }

    /// Coefficients of the inflow `a + b s + c s^2`, `s` from 0 to 1 over the step.
    #[inline]
    pub(crate) fn coefficients(&self) -> [T; 3] {
        let b = self.middle * 4.0 - self.start * 3.0 - self.end;
        let c = (self.start + self.end) * 2.0 - self.middle * 4.0;
        [self.start, b, c]
    }

    /// The inflow over the part of the step between `from` and `to`, both in `[0, 1]`.
    pub(crate) fn part(&self, from: T, to: T) -> Self {
        let [a, b, c] = self.coefficients();
        let at = |s: T| a + (b + c * s) * s;
        Self {
            start: at(from),
            middle: at((from + to) * 0.5),
            end: at(to),
        }
    }
}

/// An additional inflow (second pump or measured disturbance) as a function of time: `a + b s + c s^2`, `s` the time since `start` \[s\] as
/// a share of `length` \[s\].
pub(crate) struct Feed<T> {
    start: T,
    length: T,
    coefficients: [T; 3],
    held: bool,
}

impl<T: Scalar> Feed<T> {
    pub(crate) fn new(start: T, length: T, coefficients: [T; 3]) -> Self {
        let [_, b, c] = coefficients;
        let nothing = |x: T| x.value() == 0.0 && x.same_derivatives(T::constant(0.0));
        Self {
            start,
            length,
            coefficients,
            held: nothing(b) && nothing(c),
        }
    }

    /// The same feed without derivatives.
    pub(crate) fn values(&self) -> Feed<f64> {
        let coefficients = self.coefficients.map(T::value);
        Feed::new(self.start.value(), self.length.value(), coefficients)
    }

    /// The feed is constant.
    #[inline]
    pub(crate) fn is_held(&self) -> bool {
        self.held || self.length.value() == 0.0
    }

    /// The feed at a time; `time` is called only if the feed is not constant.
    #[inline(always)]
    pub(crate) fn at(&self, time: impl FnOnce() -> T) -> T {
        let [a, b, c] = self.coefficients;
        if self.is_held() {
            return a;
        }
        let share = (time() - self.start) / self.length;
        a + (b + c * share) * share
    }

    /// The feed over `h` seconds from `begin` on.
    pub(crate) fn over(&self, begin: T, h: T) -> Inflow<T> {
        if self.is_held() {
            return Inflow::held(self.coefficients[0]);
        }
        Inflow {
            start: self.at(|| begin),
            middle: self.at(|| begin + h * 0.5),
            end: self.at(|| begin + h),
        }
    }
}
