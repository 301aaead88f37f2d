//! The first moments of an exponential over one step, smooth down to a time constant of zero.
//!
//! The transient of a first-order lag of time constant `T` behind a constant or polynomial signal decays as
//! `exp(-s/e)`, `s = t/h` in `[0, 1]`, `e = T/h`. Its effect on a slow vessel is given by the moments
//! `M_j = int_0^1 s^j exp(-s/e) ds`. They go to zero with `e`, with the correct slope (`M_0 -> e`), so that the model is smooth where the
//! lag vanishes.

use crate::{Scalar, linear::same_step};

/// The moments of the last step, kept for reuse: most steps have the same length.
pub(crate) struct KeptMoments<T> {
    pub time_constant: T,
    last: Option<(T, (T, [T; 3]))>,
}

impl<T: Scalar> KeptMoments<T> {
    pub(crate) fn new(time_constant: T) -> Self {
        Self {
            time_constant,
            last: None,
        }
    }

    /// [`exponential_moments`] over a step of length `h`.
    pub(crate) fn over(&mut self, h: T) -> (T, [T; 3]) {
        if let Some((known, moments)) = self.last
            && same_step(known, h)
        {
            return moments;
        }
        let moments = exponential_moments(self.time_constant, h);
        self.last = Some((h, moments));
        moments
    }
}

/// `(-1)^n/(n! (n + 4))`, the terms of `M_3` by powers of `z`.
const SERIES: [f64; 16] = {
    let mut terms = [0.0; 16];
    let (mut n, mut factor) = (0, 1.0);
    while n < terms.len() {
        terms[n] = factor / (n + 4) as f64;
        factor = -factor / (n + 1) as f64;
        n += 1;
    }
    terms
};

/// `exp(-1/e)` and the moments `M_0, M_1, M_2` for `e = time_constant/h`, both non-negative, not both zero.
pub(crate) fn exponential_moments<T: Scalar>(time_constant: T, h: T) -> (T, [T; 3]) {
    if time_constant.value() > 2.0 * h.value() {
        // For small z = h/T the downward recursion cancels. The upward one does not: M_(j-1) = (z M_j + exp(-z))/j, from the series of M_3;
        // and the derivative of M_j by z is -M_(j+1).
        let rate = h / time_constant;
        let z = rate.value();
        // At z <= 1/2 the first omitted term is 2e-19 of the sum.
        let m3 = SERIES.iter().rev().fold(0.0, |sum, c| sum * z + c);
        let decay = (-z).exp();
        let m2 = (z * m3 + decay) / 3.0;
        let m1 = (z * m2 + decay) / 2.0;
        let m0 = z * m1 + decay;
        let of = |value, slope| T::with_slopes(value, [(rate, slope)]);
        return (of(decay, -decay), [of(m0, -m1), of(m1, -m2), of(m2, -m3)]);
    }
    let e = time_constant / h;
    // Below 1/700 the exponential is zero in double precision, with all its derivatives.
    let decay = if e.value() < 1.0 / 700.0 {
        T::constant(0.0)
    } else {
        (-(h / time_constant)).exp()
    };
    let m0 = e * (-decay + 1.0);
    let m1 = e * (m0 - decay);
    let m2 = e * (m1 * 2.0 - decay);
    (decay, [m0, m1, m2])
}

/// An excess after it has decayed for `h`, smooth down to a time constant of zero, where it is zero.
pub(crate) fn decayed<T: Scalar>(excess: T, time_constant: T, h: f64) -> T {
    if 700.0 * time_constant.value() > h {
        excess * (-(T::constant(h) / time_constant)).exp()
    } else {
        T::constant(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;
    use approx::assert_relative_eq;

    #[test]
    fn kept_moments_are_those_of_the_step() {
        let lag = Dual::<2>::variable(3.0, 0);
        let mut kept = KeptMoments::new(lag);
        // Same length, other length, and the same length with derivatives.
        let [plain, other] = [2.0, 0.5].map(Dual::constant);
        for h in [plain, plain, other, plain, Dual::variable(2.0, 1), plain] {
            assert_eq!(kept.over(h), exponential_moments(lag, h));
        }
    }

    #[test]
    fn moments_agree_with_a_fine_quadrature() {
        for e in [1e-3, 0.02, 0.3, 1.0, 1.9, 2.1, 10.0, 1e4] {
            let (decay, moments) = exponential_moments(e, 1.0);
            assert_relative_eq!(decay, (-1.0_f64 / e).exp(), epsilon = 1e-15);
            let n = 400_000;
            for (j, moment) in moments.iter().enumerate() {
                // Midpoint rule: its error is at most 1/(24 n^2 e).
                let sum: f64 = (0..n)
                    .map(|i| (i as f64 + 0.5) / f64::from(n))
                    .map(|s| s.powi(j as i32) * (-s / e).exp())
                    .sum::<f64>()
                    / f64::from(n);
                assert_relative_eq!(*moment, sum, max_relative = 2e-6, epsilon = 1e-13);
            }
        }
    }

    #[test]
    fn the_slope_at_zero_is_that_of_the_limit() {
        let (decay, m) = exponential_moments(Dual::<1>::variable(0.0, 0), Dual::constant(2.0));
        assert_eq!((decay.re, decay.eps[0]), (0.0, 0.0));
        assert_eq!((m[0].re, m[0].eps[0]), (0.0, 0.5));
        assert_eq!((m[1].re, m[1].eps[0]), (0.0, 0.0));
    }
}
