//! Whether all roots of a polynomial lie in the open left half plane, by Routh's table.
//!
//! The table is computed in `f64` with a running bound of its own rounding errors. Where a leading entry is closer to
//! 0 than that bound, it is computed again in integers, so the answer is the one for the coefficients as given, always.
//! A zero in the first column or a whole row of zeros means roots on the axis or to its right, and is answered with
//! no; nothing is perturbed.
//!
//! Cost: O(n^2), 60 ns for n = 3, 150 ns for n = 10; the integers, needed only near the border, 300 ns for n = 3.
//!
//! Reference: E. J. Routh (1877), as in F. R. Gantmacher, The Theory of Matrices, volume 2, chapter XV.

use alloc::vec;

use crate::Polynomial;
use crate::exact::Exact;

impl Polynomial {
    /// Whether every root has a real part below 0, decided exactly for the coefficients as they are. A constant other
    /// than 0 has no roots: true. 0, or coefficients that are not finite: false.
    pub fn is_hurwitz(&self) -> bool {
        is_hurwitz(self.coefficients())
    }

    /// Whether every root has a real part below `-rate` \[1/time\], so that what it describes decays faster than
    /// `exp(-rate t)`. Decided exactly for the coefficients of `P(p - rate)`, which are rounded once.
    pub fn decays_faster_than(&self, rate: f64) -> bool {
        self.shifted(-rate).is_hurwitz()
    }
}

/// [`Polynomial::is_hurwitz`] for ascending coefficients, the last of them not zero. Allocates nothing up to a degree of
/// 31, unless the answer is so close that integers have to decide.
pub fn is_hurwitz(c: &[f64]) -> bool {
    if c.iter().any(|c| !c.is_finite()) {
        return false;
    }
    // Necessary, and enough up to the second order.
    let sign = c.last().copied().unwrap_or(0.0);
    if c.is_empty() || c.iter().any(|c| *c == 0.0 || (*c < 0.0) != (sign < 0.0)) {
        return false;
    }
    let routh = |c: &[f64]| {
        let half = c.len().div_ceil(2);
        if half <= ROW {
            let (mut above, mut row) = ([Bounded::default(); ROW], [Bounded::default(); ROW]);
            routh(c, &mut above[..half], &mut row[..c.len() - half])
        } else {
            let rows = || vec![Bounded::default(); half];
            routh(c, &mut rows(), &mut rows()[..c.len() - half])
        }
    };
    c.len() <= 3 || routh(c).unwrap_or_else(|| Exact::new(c, 0).is_hurwitz())
}

/// Entries of a row of Routh's table that need no allocation: up to a degree of 31.
const ROW: usize = 16;

/// A number and how far the exact one may be from it.
#[derive(Clone, Copy, Default)]
struct Bounded {
    value: f64,
    error: f64,
}

/// Routh's table, or none where rounding could decide. All coefficients have one sign; the rows have the lengths of the
/// table's first two.
fn routh<'a>(c: &[f64], mut above: &'a mut [Bounded], mut row: &'a mut [Bounded]) -> Option<bool> {
    // Products neither overflow nor lose digits below the smallest normal number.
    if c.iter().any(|c| !(1e-60..1e60).contains(&c.abs())) {
        return None;
    }
    for (i, c) in c.iter().rev().enumerate() {
        let row = if i % 2 == 0 { &mut *above } else { &mut *row };
        row[i / 2] = Bounded {
            value: c.abs(),
            error: 0.0,
        };
    }
    while !row.is_empty() {
        let (top, head) = (above[0], row[0]);
        if head.value.abs() <= 2.0 * head.error {
            return None;
        }
        if head.value < 0.0 {
            return Some(false);
        }
        let ratio = top.value / head.value;
        let ratio_error =
            (top.error + ratio * head.error) / (head.value - head.error) + f64::EPSILON * ratio;
        // In place: the row above becomes the row below.
        for i in 1..above.len() {
            let beside = row.get(i).copied().unwrap_or(Bounded {
                value: 0.0,
                error: 0.0,
            });
            let product = ratio * beside.value;
            let value = above[i].value - product;
            let error = above[i].error
                + ratio * beside.error
                + ratio_error * (beside.value.abs() + beside.error)
                + f64::EPSILON * (product.abs() + value.abs());
            // A little more covers the rounding of the bound itself.
            above[i - 1] = Bounded {
                value,
                error: 1.001 * error,
            };
        }
        let shorter = above.len() - 1;
        (above, row) = (row, &mut above[..shorter]);
    }
    Some(true)
}

#[cfg(test)]
mod tests {
    use alloc::vec;
    use alloc::vec::Vec;
    use num_complex::Complex64;

    use super::*;

    fn poly(c: &[f64]) -> Polynomial {
        Polynomial::new(c).unwrap()
    }

    #[test]
    fn by_hand() {
        assert!(poly(&[1.0, 3.0, 3.0, 1.0]).is_hurwitz());
        assert!(poly(&[-1.0, -3.0, -3.0, -1.0]).is_hurwitz());
        assert!(poly(&[7.0]).is_hurwitz());
        assert!(!poly(&[]).is_hurwitz());
        assert!(!poly(&[0.0, 1.0]).is_hurwitz());
        assert!(!poly(&[1.0, -1.0]).is_hurwitz());
        // p^3 + a p^2 + b p + c: a b > c.
        assert!(poly(&[5.9, 3.0, 2.0, 1.0]).is_hurwitz());
        assert!(!poly(&[6.1, 3.0, 2.0, 1.0]).is_hurwitz());
    }

    #[test]
    fn zero_rows_and_zero_heads_are_no() {
        // (p^2 + 1)(p + 1): a row of zeros.
        assert!(!poly(&[1.0, 1.0, 1.0, 1.0]).is_hurwitz());
        // (p^2 + 1)^2 (p + 2)
        assert!(!poly(&[2.0, 1.0, 4.0, 2.0, 2.0, 1.0]).is_hurwitz());
        // p^5 + 2 p^4 + 2 p^3 + 4 p^2 + 11 p + 10: a zero head in a row that is not zero.
        assert!(!poly(&[10.0, 11.0, 4.0, 2.0, 2.0, 1.0]).is_hurwitz());
    }

    #[test]
    fn the_last_digit_decides() {
        // p^3 + a p^2 + b p + a b lies on the border for every a, b whose product is exact.
        let awkward = [(0.75, 0.3), (3.0, 1.0 / 3.0), (1e-20, 1e15), (7.0, 0.1)];
        let others = (1..500).map(|k| (libm::sqrt(f64::from(k)), libm::cbrt(f64::from(k) + 0.7)));
        for (a, b) in awkward.into_iter().chain(others) {
            let c: f64 = a * b;
            let exact = libm::fma(a, b, -c);
            for (c, rest) in [
                (c.next_down(), exact + (c - c.next_down())),
                (c, exact),
                (c.next_up(), exact - (c.next_up() - c)),
            ] {
                assert_eq!(
                    poly(&[c, b, a, 1.0]).is_hurwitz(),
                    rest > 0.0,
                    "{a} {b} {c}"
                );
            }
        }
    }

    #[test]
    fn many_roots_in_one_place() {
        for n in [5, 10, 20, 30] {
            assert!(poly(&[1.0, 1.0]).pow(n).is_hurwitz(), "{n}");
        }
        let mut roots = vec![Complex64::new(-1e-9, 1.0), Complex64::new(-1e-9, -1.0)];
        roots.extend((1..10).map(|k| Complex64::new(-f64::from(k), 0.0)));
        assert!(Polynomial::from_roots(&roots, 1.0).unwrap().is_hurwitz());
        for root in &mut roots[..2] {
            root.re = 1e-9;
        }
        assert!(!Polynomial::from_roots(&roots, 1.0).unwrap().is_hurwitz());
    }

    #[test]
    fn floats_and_integers_agree() {
        let mut decided = 0;
        for k in 0..4000_u32 {
            let digits = (0..5 + k % 4).map(|i| {
                let x = libm::sin(f64::from(k) * 12.9898 + f64::from(i) * 78.233) * 43758.5453;
                0.5 + 3.0 * (x - libm::floor(x))
            });
            let c: Vec<f64> = digits.collect();
            let exact = Exact::new(&c, 0).is_hurwitz();
            let rows = || vec![Bounded::default(); c.len().div_ceil(2)];
            if let Some(answer) = routh(&c, &mut rows(), &mut rows()[..c.len() / 2]) {
                decided += 1;
                assert_eq!(answer, exact, "{c:?}");
            }
        }
        assert!(decided > 3990, "{decided}");
    }

    /// Roots on the imaginary axis with integer coefficients: the rounded result depends on the unit of time, and must not be trusted.
    #[test]
    fn the_border_is_no_in_any_unit() {
        for k in 1..1500_u32 {
            let whole = |by: u32| f64::from(k * by % 97 + 1);
            let quadratic = |a: f64, b: f64| poly(&[b, a, 1.0]);
            let border = &quadratic(0.0, whole(31)) * &quadratic(whole(57), whole(73));
            let higher = &border * &quadratic(whole(19), whole(41));
            for p in [border, higher] {
                for unit in [1.0, libm::ldexp(1.0, -120), libm::ldexp(1.0, 120)] {
                    let c: Vec<f64> = p.coefficients().iter().map(|c| c * unit).collect();
                    assert!(!poly(&c).is_hurwitz(), "{c:?}");
                }
            }
        }
    }

    #[test]
    fn a_table_of_any_length() {
        for n in 29..40 {
            let p = poly(&[1.0, 1.0]).pow(n);
            assert!(p.is_hurwitz(), "{n}");
            // roots at +-j
            assert!(!(&p * &poly(&[1.0, 0.0, 1.0])).is_hurwitz(), "{n}");
        }
    }

    #[test]
    fn extreme_sizes() {
        // a p^3 + b p^2 + c p + d is Hurwitz where b c > a d, whatever the products do in f64.
        assert!(poly(&[1e-300, 1e250, 1e250, 1e-300]).is_hurwitz());
        assert!(poly(&[1e-300, 1e-290, 1e-290, 1e-300]).is_hurwitz());
        assert!(!poly(&[1e-290, 1e-300, 1e-300, 1e-290]).is_hurwitz());
        assert!(!poly(&[1e300, 1e-300, 1.0, 1.0]).is_hurwitz());
        assert!(poly(&[f64::from_bits(1), 1.0, 1.0, f64::MAX]).is_hurwitz());
        assert!(!poly(&[f64::MAX, 1.0, 1.0, 1.0]).is_hurwitz());
        let overflowed = &poly(&[1e300, 1.0]) * &poly(&[1e300, 1.0]);
        assert!(!overflowed.is_hurwitz());
    }

    #[test]
    fn decay_rate() {
        let p =
            Polynomial::from_roots(&[Complex64::new(-2.0, 0.0), Complex64::new(-3.0, 0.0)], 1.0);
        let p = p.unwrap();
        assert!(p.decays_faster_than(1.99));
        assert!(!p.decays_faster_than(2.01));
        assert!(!p.decays_faster_than(f64::NAN));
    }
}
