//! An exponential Runge-Kutta step of order four (ETDRK4) for states with fast decay.
//!
//! Solves `d' = -rate d + N(d, t)` from `d = 0`. The linear decay is exact for any step length; `N` is interpolated by a parabola through
//! the stages. At a rate of zero this is the classical Runge-Kutta step. `rate` only splits the equation: the exact solution does not
//! depend on `rate`, but the numerical step does, so `rate` carries derivatives.
//!
//! The error of a step that is long against `1/rate` depends on how smooth `N` is: the transient after a jump decays within the step and
//! has exact weights; the slow part is approximated by a parabola. The weights are computed from moments that are smooth down to a time
//! constant of zero, not from differences of exponentials, which cancel (Kassam and Trefethen avoid that cancellation by a contour
//! integral).
//!
//! **References**: S. M. Cox, P. C. Matthews, Exponential time differencing for stiff systems, J. Computational Physics 176
//! (2002) 430-455, equations (26) to (29); A.-K. Kassam, L. N. Trefethen, Fourth-order time-stepping for stiff PDEs, SIAM J.
//! Scientific Computing 26 (2005) 1214-1233.

use crate::{Scalar, moments::exponential_moments};

/// The weights of one vessel for one step.
#[derive(Clone, Copy)]
pub(crate) struct Damped<T> {
    /// Decay factor over half the step.
    decay: T,
    /// `int exp(-rate s) ds` over half the step.
    half: T,
    /// Weights of the drive `N` at the beginning, in the middle and at the end.
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

    /// Half a step from the state `from` under another constant drive.
    pub(crate) fn half_from(&self, from: T, drive: T) -> T {
        from * self.decay + drive * self.half
    }

    /// The whole step under a drive with these values at the beginning, the middle and the end.
    pub(crate) fn whole(&self, [a, b, c]: [T; 3]) -> T {
        a * self.whole[0] + b * self.whole[1] + c * self.whole[2]
    }
}

/// Up to this rate times the step, the decay over the step is neglected: a relative error of the change of at most 5e-7.
const SLOW: f64 = 1e-6;
