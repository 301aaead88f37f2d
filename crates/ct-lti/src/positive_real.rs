//! Whether `Re G(jw) > d` at every frequency, decided exactly and without a frequency grid.
//!
//! Model: `G = P1/P2`, proper. Write `P(jw) = E(x) + jw O(x)` with `x = w^2`. Then `Re G(jw) > d` exactly where
//!
//! ```text
//! N(x) = E1 E2 + x O1 O2 - d (E2^2 + x O2^2) > 0,
//! ```
//!
//! and the question is whether the polynomial N is positive on `[0, inf)`: `N(0) > 0`, a positive leading coefficient,
//! and no positive root, by Sturm's chain. N and the chain are computed in integers, as the coefficients given are
//! integers times powers of 2; no tolerance enters. Before that, N is computed in `f64` with a bound of its rounding:
//! where all its coefficients are positive beyond doubt, that decides.
//!
//! It is needed for the output error with an extended vector: `C^/A0` strictly positive real, `C^/A0 - gamma/(2c)` for
//! the least-squares gain (A. J. Udink ten Cate, WP-85-54, 1985, section 4), and for the closed-loop output error:
//! `P^/P - 1/2` (Baysse, Carrillo, Habbadi, (14)).
//!
//! For `C = 1 + c1 p + c2 p^2`, `A = 1 + a1 p + a2 p^2`, `d = 0` it is `c2 >= 0` and
//! `a1 c1 > (sqrt(a2) - sqrt(c2))^2`; for order one `c1 >= 0`.
//!
//! Cost: 35 to 160 ns for order 2 to 6 where the signs decide; otherwise 8, 30, 110 us for order 2, 4, 6.

use alloc::vec::Vec;

use crate::error::finite;
use crate::exact::Exact;
use crate::{Error, Polynomial, TransferFunction};

/// Result of [`TransferFunction::exceeds`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Positivity {
    /// Stable, and `Re G(jw) > d` at every frequency, infinity included.
    Strict,
    /// Stable, and `Re G(jw) > d` at every finite frequency; at infinity `Re G = d`, reached from above and no faster
    /// than `1/w^2`. For `d = 0` this is what is called strictly positive real of relative degree one.
    StrictBelowInfinity,
    /// Stable, but `Re G(jw) <= d` at some frequency.
    Fails {
        /// A frequency where it fails, in most cases the worst one by the relative size of N \[rad/time\]. Where
        /// `Re G` touches d from above, the frequency of touching, rounded. Infinite where it fails nowhere else.
        frequency: f64,
        /// `Re G(jw) - d` at that frequency, at most 0 \[unit of G\].
        excess: f64,
    },
    /// The denominator has a root on the imaginary axis or to its right.
    Unstable,
}

impl Positivity {
    /// Whether the condition is satisfied at every finite frequency: [`Positivity::Strict`] or [`Positivity::StrictBelowInfinity`].
    pub fn holds(self) -> bool {
        matches!(self, Self::Strict | Self::StrictBelowInfinity)
    }

    /// Whether the condition holds with a positive margin at infinite frequency too: [`Positivity::Strict`].
    pub fn is_strict(self) -> bool {
        self == Self::Strict
    }
}

impl TransferFunction {
    /// Whether `Re G(jw) > d` at every frequency and G is stable; `d = 0` asks for positive realness. d is in the unit
    /// of G. See the head of `positive_real.rs`.
    ///
    /// ```
    /// use ct_lti::{Polynomial, Positivity, TransferFunction};
    ///
    /// // The model loop P^ over the true one P: is Re(P^/P) > 1/2?
    /// let p = Polynomial::new([1.0, 5.0, 100.0])?;
    /// let good = TransferFunction::new(Polynomial::new([0.8, 4.0, 60.0])?, p.clone())?;
    /// assert_eq!(good.exceeds(0.5)?, Positivity::Strict);
    /// let slow = TransferFunction::new(Polynomial::new([0.8, 4.0, 300.0])?, p)?;
    /// let Positivity::Fails { frequency, excess } = slow.exceeds(0.5)? else { panic!() };
    /// assert!(frequency > 0.05 && frequency < 0.1 && excess < 0.0);
    /// # Ok::<(), ct_lti::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::NotFinite`] for d.
    pub fn exceeds(&self, d: f64) -> Result<Positivity, Error> {
        finite("the bound of a real part", &[d])?;
        let (p1, p2) = (self.numerator(), self.denominator());
        if !p2.is_hurwitz() {
            return Ok(Positivity::Unstable);
        }
        let order = self.order();
        if positive_by_signs(p1, p2, d, order) {
            return Ok(Positivity::Strict);
        }
        // With time scaled so that the roots of P2 are about 1, the integers are short.
        let scale = scale(p2);
        let n = real_part(&Exact::new(p1.coefficients(), scale), p2, d, scale);
        if n.is_positive_from_zero() {
            return Ok(match n.degree() {
                Some(degree) if degree == order => Positivity::Strict,
                Some(degree) if degree + 1 == order => Positivity::StrictBelowInfinity,
                _ => Positivity::Fails {
                    frequency: f64::INFINITY,
                    excess: 0.0,
                },
            });
        }
        let frequency = libm::ldexp(libm::sqrt(witness(&n.rounded())), scale as i32);
        let excess = self.at_frequency(frequency).re - d;
        Ok(Positivity::Fails {
            frequency,
            excess: excess.min(0.0),
        })
    }
}

/// The power of 2 nearest to the roots' geometric mean.
pub(crate) fn scale(p: &Polynomial) -> i64 {
    let size = |c: f64| i64::from(libm::frexp(c).1);
    match p.degree() {
        Some(n) if n > 0 => (size(p.coefficient(0)) - size(p.leading())).div_euclid(n as i64),
        _ => 0,
    }
}

/// N in integers.
fn real_part(p1: &Exact, p2: &Polynomial, d: f64, scale: i64) -> Exact {
    let p2 = Exact::new(p2.coefficients(), scale);
    let ((e1, o1), (e2, o2)) = (p1.even_odd(), p2.even_odd());
    let real = e1.times(&e2).plus(&o1.times(&o2).times_x());
    let size = e2.times(&e2).plus(&o2.times(&o2).times_x());
    real.plus(&Exact::new(&[-d], 0).times(&size))
}

/// Whether every coefficient of N, up to the order, is above 0 beyond the rounding of `f64`.
fn positive_by_signs(p1: &Polynomial, p2: &Polynomial, d: f64, order: usize) -> bool {
    // With coefficients in this range, a product of three of them neither overflows nor underflows.
    let moderate = |c: &f64| *c == 0.0 || (1e-90..1e90).contains(&c.abs());
    let mut all = p1
        .coefficients()
        .iter()
        .chain(p2.coefficients())
        .chain([&d]);
    if !all.all(moderate) {
        return false;
    }
    (0..=order).all(|k| {
        // Coefficient of w^(2k) in Re (P1 - d P2) conj(P2): sum over i + j = 2k of (-1)^(i - k) p[i] c[j].
        let (mut sum, mut size) = (0.0, 0.0);
        for i in (2 * k).saturating_sub(order)..=order.min(2 * k) {
            let c = p2.coefficient(2 * k - i);
            let (a, b) = (p1.coefficient(i) * c, d * p2.coefficient(i) * c);
            sum += if (i + k) % 2 == 0 { a - b } else { b - a };
            size += a.abs() + b.abs();
        }
        sum > (2 * order + 6) as f64 * f64::EPSILON * size
    })
}

/// For a polynomial that is not positive on `[0, inf)`: the point with its lowest value relative to its terms.
fn witness(n: &[f64]) -> f64 {
    let relative = |x: f64| {
        // Reversed above 1, so that nothing overflows.
        let terms = |x: f64, c: &mut dyn Iterator<Item = &f64>| {
            c.fold((0.0, 0.0), |(sum, size): (f64, f64), c| {
                (sum * x + c, size * x + c.abs())
            })
        };
        let (sum, size) = if x > 1.0 {
            terms(1.0 / x, &mut n.iter())
        } else {
            terms(x, &mut n.iter().rev())
        };
        if size > 0.0 { sum / size } else { 0.0 }
    };
    let n_polynomial = Polynomial::trimmed(n.to_vec());
    // The lowest point is 0, a point without slope, or beyond Cauchy's bound of the roots.
    let leading = n_polynomial.leading().abs();
    let bound = n
        .iter()
        .fold(0.0_f64, |most, c| most.max(c.abs() / leading));
    let mut candidates = Vec::from([0.0]);
    if bound.is_finite() {
        candidates.push(2.0 * (1.0 + bound));
    }
    if let Ok(roots) = n_polynomial.derivative().roots() {
        candidates.extend(roots.iter().map(|z| z.re).filter(|x| *x > 0.0));
    }
    let lowest = candidates
        .into_iter()
        .map(|x| (x, relative(x)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    lowest.map_or(0.0, |(x, _)| x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cases far from the boundary are decided in floating point; only the others use long integers.
    #[test]
    fn signs_decide_what_is_clear() {
        let poly = |c: &[f64]| Polynomial::new(c).unwrap();
        // Re (1 + 2 s)/(1 + s) = (1 + 2 x)/(1 + x), from 1 to 2
        let (p1, p2) = (poly(&[1.0, 2.0]), poly(&[1.0, 1.0]));
        assert!(positive_by_signs(&p1, &p2, 0.0, 1));
        assert!(positive_by_signs(&p1, &p2, 0.999, 1));
        assert!(!positive_by_signs(&p1, &p2, 1.0, 1));
        assert!(!positive_by_signs(&p1, &p2, 1.5, 1));
    }
}
