//! Real polynomials in `p`, the operator d/dt or the Laplace variable.
//!
//! Model: `P(p) = c[0] + c[1] p + .. + c[n] p^n`, coefficients ascending as in `A = 1 + a1 p + .. + an p^n`.
//!
//! Cost: addition O(n), product and division O(n^2), evaluation O(n).

use alloc::{vec, vec::Vec};
use core::ops::{Add, Mul, Neg, Sub};

use num_complex::Complex64;

use crate::Error;
use crate::error::finite;

/// A real polynomial of any degree, coefficients ascending, the leading one not zero.
///
/// Zero has no coefficients at all and no degree. Operators work on references (`&a * &b`); they cannot fail, so a
/// product beyond the range of `f64` holds infinities, which whatever is made of it refuses.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Polynomial {
    coefficients: Vec<f64>,
}

impl Polynomial {
    /// `c[0] + c[1] p + ..` from its ascending coefficients; trailing zeros are dropped.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn new(coefficients: impl Into<Vec<f64>>) -> Result<Self, Error> {
        let coefficients = coefficients.into();
        finite("a polynomial", &coefficients)?;
        Ok(Self::trimmed(coefficients))
    }

    /// `c[0] + c[1] p + ..` as computed here, finite or not.
    pub(crate) fn trimmed(mut coefficients: Vec<f64>) -> Self {
        while coefficients.last() == Some(&0.0) {
            coefficients.pop();
        }
        Self { coefficients }
    }

    /// 0.
    pub fn zero() -> Self {
        Self::default()
    }

    /// 1.
    pub fn one() -> Self {
        Self::trimmed(vec![1.0])
    }

    /// `p`.
    pub fn p() -> Self {
        Self::trimmed(vec![0.0, 1.0])
    }

    /// `scale * (p - r[0]) (p - r[1]) ..`. Complex roots come with their conjugates, in any order and equal to within
    /// 1e-9 of their modulus.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::UnpairedRoot`], [`Error::Overflow`].
    pub fn from_roots(roots: &[Complex64], scale: f64) -> Result<Self, Error> {
        finite("the leading coefficient", &[scale])?;
        for (index, root) in roots.iter().enumerate() {
            if let Some(value) = [root.re, root.im].into_iter().find(|v| !v.is_finite()) {
                return Err(Error::NotFinite {
                    what: "the roots",
                    index,
                    value,
                });
            }
        }
        let mut product = Self::one();
        let mut open = roots.to_vec();
        while let Some(root) = open.pop() {
            if root.im == 0.0 {
                product = &product * &Self::trimmed(vec![-root.re, 1.0]);
                continue;
            }
            let near = 1e-9 * root.norm();
            let partner = (0..open.len())
                .map(|i| (i, (open[i] - root.conj()).norm()))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .filter(|&(_, distance)| distance <= near);
            let Some((partner, _)) = partner else {
                return Err(Error::UnpairedRoot {
                    re: root.re,
                    im: root.im,
                });
            };
            let root = (root + open.swap_remove(partner).conj()) * 0.5;
            product = &product * &Self::trimmed(vec![root.norm_sqr(), -2.0 * root.re, 1.0]);
        }
        let product = &product * scale;
        product.checked("a polynomial from its roots")
    }

    /// The polynomial, or an error if a coefficient is not finite.
    pub(crate) fn checked(self, what: &'static str) -> Result<Self, Error> {
        match finite(what, &self.coefficients) {
            Ok(()) => Ok(self),
            Err(_) => Err(Error::Overflow {
                what,
                mend: "scale the time or the signals",
            }),
        }
    }

    /// Ascending coefficients, the last of them not zero; empty for zero.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Coefficient of `p^i`; 0 above the degree.
    pub fn coefficient(&self, i: usize) -> f64 {
        self.coefficients.get(i).copied().unwrap_or(0.0)
    }

    /// The largest power; none for zero.
    pub fn degree(&self) -> Option<usize> {
        self.coefficients.len().checked_sub(1)
    }

    /// Coefficient of the largest power; 0 for zero.
    pub fn leading(&self) -> f64 {
        self.coefficients.last().copied().unwrap_or(0.0)
    }

    /// Whether the polynomial is 0.
    pub fn is_zero(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// `P(x)`, by Horner's rule.
    pub fn eval(&self, x: f64) -> f64 {
        self.coefficients.iter().rev().fold(0.0, |s, c| s * x + c)
    }

    /// `P(s)`, by Horner's rule. For `s = jw` prefer [`Polynomial::at_frequency`], which keeps the parts apart.
    pub fn eval_complex(&self, s: Complex64) -> Complex64 {
        self.coefficients
            .iter()
            .rev()
            .fold(Complex64::new(0.0, 0.0), |sum, c| sum * s + c)
    }

    /// `P(jw)` at the angular frequency `w` \[rad/time\]: real and imaginary part have an error of their own, so a
    /// small real part beside a large imaginary one keeps its digits.
    pub fn at_frequency(&self, w: f64) -> Complex64 {
        let (even, odd) = self.even_odd();
        Complex64::new(even.eval(w * w), w * odd.eval(w * w))
    }

    /// `(E, O)` with `P(jw) = E(w^2) + jw O(w^2)`: polynomials in `x = w^2`.
    pub fn even_odd(&self) -> (Self, Self) {
        let part = |first: usize| {
            let signs = [1.0, -1.0].into_iter().cycle();
            let part = self.coefficients.iter().skip(first).step_by(2);
            Self::trimmed(part.zip(signs).map(|(c, s)| s * c).collect())
        };
        (part(0), part(1))
    }

    /// `dP/dp`.
    pub fn derivative(&self) -> Self {
        let powers = self.coefficients.iter().enumerate().skip(1);
        Self::trimmed(powers.map(|(i, c)| i as f64 * c).collect())
    }

    /// `P^k`; 1 for `k = 0`.
    pub fn pow(&self, k: usize) -> Self {
        (0..k).fold(Self::one(), |product, _| &product * self)
    }

    /// `P(p + shift)`: its roots are those of `P`, moved left by `shift`. By Taylor's expansion, O(n^2).
    pub fn shifted(&self, shift: f64) -> Self {
        let mut c = self.coefficients.clone();
        for from in 0..c.len() {
            for i in (from..c.len() - 1).rev() {
                c[i] += shift * c[i + 1];
            }
        }
        Self::trimmed(c)
    }

    /// `P(scale * p)`: its roots are those of `P`, divided by `scale`.
    pub fn scaled(&self, scale: f64) -> Self {
        let mut power = 1.0;
        let mut c = self.coefficients.clone();
        for c in &mut c {
            *c *= power;
            power *= scale;
        }
        Self::trimmed(c)
    }

    /// Quotient and remainder, `self = q * divisor + r` with r of a lower degree than the divisor.
    ///
    /// # Errors
    /// [`Error::ZeroPolynomial`] for a divisor of 0, [`Error::Overflow`].
    pub fn div_rem(&self, divisor: &Self) -> Result<(Self, Self), Error> {
        let what = "the divisor";
        let degree = divisor.degree().ok_or(Error::ZeroPolynomial { what })?;
        let mut rest = self.coefficients.clone();
        let mut quotient = vec![0.0; rest.len().saturating_sub(degree)];
        for (at, q) in quotient.iter_mut().enumerate().rev() {
            *q = rest[at + degree] / divisor.leading();
            for (r, d) in rest[at..].iter_mut().zip(&divisor.coefficients) {
                *r -= *q * d;
            }
            rest.truncate(at + degree);
        }
        let what = "a quotient of polynomials";
        let quotient = Self::trimmed(quotient).checked(what)?;
        Ok((quotient, Self::trimmed(rest).checked(what)?))
    }
}

impl From<f64> for Polynomial {
    /// A constant. A value that is not finite causes an error when a system is built from it.
    fn from(constant: f64) -> Self {
        Self::trimmed(vec![constant])
    }
}

impl Add for &Polynomial {
    type Output = Polynomial;
    fn add(self, other: Self) -> Polynomial {
        let n = self.coefficients.len().max(other.coefficients.len());
        Polynomial::trimmed(
            (0..n)
                .map(|i| self.coefficient(i) + other.coefficient(i))
                .collect(),
        )
    }
}

impl Sub for &Polynomial {
    type Output = Polynomial;
    fn sub(self, other: Self) -> Polynomial {
        self + &-other
    }
}

impl Neg for &Polynomial {
    type Output = Polynomial;
    fn neg(self) -> Polynomial {
        self * -1.0
    }
}

impl Mul<f64> for &Polynomial {
    type Output = Polynomial;
    fn mul(self, factor: f64) -> Polynomial {
        Polynomial::trimmed(self.coefficients.iter().map(|c| c * factor).collect())
    }
}

impl Mul for &Polynomial {
    type Output = Polynomial;
    fn mul(self, other: Self) -> Polynomial {
        if self.is_zero() || other.is_zero() {
            return Polynomial::zero();
        }
        let mut product = vec![0.0; self.coefficients.len() + other.coefficients.len() - 1];
        for (i, a) in self.coefficients.iter().enumerate() {
            for (sum, b) in product[i..].iter_mut().zip(&other.coefficients) {
                *sum += a * b;
            }
        }
        Polynomial::trimmed(product)
    }
}

impl core::fmt::Display for Polynomial {
    /// `1 + 3 p - 2 p^2`, with the precision asked for (`{:.3}`).
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mut first = true;
        for (i, &c) in self.coefficients.iter().enumerate() {
            if c == 0.0 {
                continue;
            }
            match (first, c < 0.0) {
                (true, true) => f.write_str("-")?,
                (true, false) => {}
                (false, true) => f.write_str(" - ")?,
                (false, false) => f.write_str(" + ")?,
            }
            first = false;
            let size = c.abs();
            if i == 0 || size != 1.0 {
                match f.precision() {
                    Some(digits) => write!(f, "{size:.digits$}")?,
                    None => write!(f, "{size}")?,
                }
                if i > 0 {
                    f.write_str(" ")?;
                }
            }
            match i {
                0 => {}
                1 => f.write_str("p")?,
                _ => write!(f, "p^{i}")?,
            }
        }
        if first {
            f.write_str("0")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn poly(c: &[f64]) -> Polynomial {
        Polynomial::new(c).unwrap()
    }

    #[test]
    fn arithmetic_by_hand() {
        let (a, b) = (poly(&[1.0, 2.0, 3.0]), poly(&[0.0, -2.0]));
        assert_eq!(&a + &b, poly(&[1.0, 0.0, 3.0]));
        assert_eq!(&a - &a, Polynomial::zero());
        assert_eq!(&a * &b, poly(&[0.0, -2.0, -4.0, -6.0]));
        assert_eq!(a.derivative(), poly(&[2.0, 6.0]));
        assert_eq!(a.pow(0), Polynomial::one());
        assert_eq!(a.pow(2), &a * &a);
        assert_eq!(a.shifted(1.0), poly(&[6.0, 8.0, 3.0]));
        assert_eq!(a.scaled(2.0), poly(&[1.0, 4.0, 12.0]));
        assert_eq!((a.eval(2.0), a.degree(), a.leading()), (17.0, Some(2), 3.0));
        assert_eq!(
            a.at_frequency(2.0),
            a.eval_complex(Complex64::new(0.0, 2.0))
        );
    }

    #[test]
    fn zero_is_a_polynomial() {
        let zero = poly(&[0.0, 0.0]);
        assert_eq!(
            (zero.degree(), zero.leading(), zero.eval(3.0)),
            (None, 0.0, 0.0)
        );
        assert_eq!(zero.derivative(), zero);
        assert_eq!(zero.shifted(1.0), zero);
        assert_eq!(&zero * &Polynomial::p(), zero);
        assert!(Polynomial::one().div_rem(&zero).is_err());
        assert_eq!(
            zero.div_rem(&Polynomial::p()).unwrap(),
            (zero.clone(), zero)
        );
    }

    #[test]
    fn written_as_on_paper() {
        let text = alloc::format!("{}", poly(&[1.0, 0.0, -2.0, 1.0]));
        assert_eq!(text, "1 - 2 p^2 + p^3");
        assert_eq!(
            alloc::format!("{:.2}", poly(&[-1.0, 0.5])),
            "-1.00 + 0.50 p"
        );
        assert_eq!(alloc::format!("{}", Polynomial::zero()), "0");
    }

    #[test]
    fn a_root_alone_is_refused() {
        let root = Complex64::new(-1.0, 2.0);
        let alone = Polynomial::from_roots(&[root, Complex64::new(-3.0, 0.0)], 1.0);
        assert_eq!(alone, Err(Error::UnpairedRoot { re: -1.0, im: 2.0 }));
        let both = Polynomial::from_roots(&[root, root.conj()], 2.0).unwrap();
        assert_eq!(both, poly(&[10.0, 4.0, 2.0]));
    }
}
