//! The smallest `Re G(jw)` over all frequencies, and where it is.
//!
//! Equations: with `P(jw) = E(x) + jw O(x)`, `x = w^2`, `Re G = N/D`, `N = E1 E2 + x O1 O2`, `D = E2^2 + x O2^2`. It is
//! lowest at `w = 0`, at infinity, or at a positive root of `N' D - N D'`.
//!
//! In `f64`: the frequency to about 1e-8 of itself where the lowest point is simple, the value to rounding. Whether a
//! bound is kept at every frequency is decided by [`TransferFunction::exceeds`], without rounding.

use crate::positive_real::scale;
use crate::{Error, Polynomial, TransferFunction};

impl TransferFunction {
    /// `(w, Re G(jw))` at the minimum of the real part, w in \[rad/time\], infinite if the minimum is the limit. For a stable G.
    ///
    /// # Errors
    /// [`Error::Overflow`] and [`Error::NoConvergence`], as [`Polynomial::roots`].
    pub fn least_real_part(&self) -> Result<(f64, f64), Error> {
        // The unit of time that makes the roots of the denominator about 1.
        let unit = libm::ldexp(1.0, scale(self.denominator()) as i32);
        let (e1, o1) = self.numerator().scaled(unit).even_odd();
        let (e2, o2) = self.denominator().scaled(unit).even_odd();
        let x = Polynomial::p();
        let real = &(&e1 * &e2) + &(&x * &(&o1 * &o2));
        let size = &(&e2 * &e2) + &(&x * &(&o2 * &o2));
        let slope = &(&real.derivative() * &size) - &(&size.derivative() * &real);
        let flat = if slope.is_zero() {
            alloc::vec::Vec::new()
        } else {
            slope.roots()?
        };
        // A value at a point that is not a root is no lower than the lowest, so nearly real roots may be tried as real.
        let inner = flat.iter().filter(|x| x.re > 0.0);
        let inner = inner.map(|x| unit * libm::sqrt(x.re)).chain([0.0]);
        let at = |w: f64| (w, self.at_frequency(w).re);
        let finite = inner.map(at).filter(|(_, value)| value.is_finite());
        let limit = (f64::INFINITY, self.direct_term());
        Ok(finite.fold(limit, |a, b| if b.1 <= a.1 { b } else { a }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let least = |b: &[f64], a: &[f64]| {
            let g = TransferFunction::from_coefficients(b, a).unwrap();
            g.least_real_part().unwrap()
        };
        assert_eq!(least(&[3.0], &[1.0]), (0.0, 3.0));
        assert_eq!(least(&[1.0], &[1.0, 1.0]), (f64::INFINITY, 0.0));
        assert_eq!(least(&[0.5, 1.0], &[1.0, 1.0]), (0.0, 0.5));
        // Re 1/(1 + j w T)^2 = (1 - x)/(1 + x)^2 with x = (w T)^2: -1/8 at x = 3.
        for t in [1e-3, 1.0, 250.0] {
            let (w, value) = least(&[1.0], &[1.0, 2.0 * t, t * t]);
            assert!((w * t - libm::sqrt(3.0)).abs() < 1e-7, "{w}");
            assert!((value + 0.125).abs() < 1e-15, "{value}");
        }
    }
}
