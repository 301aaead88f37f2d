//! The inflow to the vessels over one step.

use crate::Scalar;

/// The inflow to the first vessel over a step: at its beginning, middle and end; a parabola through the three.
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

    /// Coefficients of `a + b s + c s^2`, `s` from 0 to 1 over the step.
    #[inline]
    pub(crate) fn coefficients(&self) -> [T; 3] {
        let b = self.middle * 4.0 - self.start * 3.0 - self.end;
        let c = (self.start + self.end) * 2.0 - self.middle * 4.0;
        [self.start, b, c]
    }

    /// The part from `from` to `to`, both in `[0, 1]`.
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
