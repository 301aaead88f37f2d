//! An exponential Runge-Kutta step of order four for what forgets fast: ETDRK4.
//!
//! `d' = -rate d + N(d, t)` from `d = 0`: the forgetting is exact for any length of the step, `N` is taken for a parabola through
//! the stages. For a rate of zero it is the classical Runge-Kutta step. `rate` only
//! splits the equation: the solution does not depend on it, but the step does, so it carries derivatives.
//!
//! A step that is long against `1/rate` is as accurate as `N` is smooth: what a jump sets off has died away within the step
//! and is weighted exactly, and the rest follows a parabola. The weights come from moments that are smooth down to a
//! time constant of zero instead of differences of exponentials, whose cancellation Kassam and Trefethen cure by a
//! contour integral.
//!
//! **References**: S. M. Cox, P. C. Matthews, Exponential time differencing for stiff systems, J. Computational Physics 176
//! (2002) 430-455, equations (26) to (29); A.-K. Kassam, L. N. Trefethen, Fourth-order time-stepping for stiff PDEs, SIAM J.
//! Scientific Computing 26 (2005) 1214-1233.

use crate::{Scalar, moments::exponential_moments};

/// The weights of one vessel over one step.
#[derive(Clone, Copy)]
pub(crate) struct Damped<T> {
    /// What is left after half the step.
    decay: T,
    /// `int exp(-rate s) ds` over half the step.
    half: T,
    /// Weights of the drive at the beginning, in the middle and at the end.
    whole: [T; 3],
}

impl<T: Scalar> Damped<T> {
    pub(crate) fn new(rate: T, h: T) -> Self {
        let one = T::constant(1.0);
        let (decay, half, [m0, m1, m2]) = if rate.value() * h.value() > SLOW {
            let lag = one / rate;
            let (decay, [half, ..]) = exponential_moments(lag, h * 0.5);
            (decay, half, exponential_moments(lag, h).1)
        } else {
            let moments = [1.0, 0.5, 1.0 / 3.0];
            (one, one, moments.map(T::constant))
        };
        Self {
            decay,
            half: half * h * 0.5,
            whole: [
                (m2 * 2.0 - m1) * h,
                (m1 - m2) * h * 4.0,
                (m0 - m1 * 3.0 + m2 * 2.0) * h,
            ],
        }
    }

    /// Half a step from zero under a constant drive.
    pub(crate) fn half(&self, drive: T) -> T {
        drive * self.half
    }

    /// Half a step from there under another one.
    pub(crate) fn half_from(&self, from: T, drive: T) -> T {
        from * self.decay + drive * self.half
    }

    /// The whole step under a drive with these values at its beginning, in its middle and at its end.
    pub(crate) fn whole(&self, [a, b, c]: [T; 3]) -> T {
        a * self.whole[0] + b * self.whole[1] + c * self.whole[2]
    }
}

/// Below this the forgetting is left to the drive, which then is all: nothing is lost by it.
const SLOW: f64 = 1e-6;
