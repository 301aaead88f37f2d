//! Polynomials with coefficients that are integers times one power of 2: every `f64` is such a number, so what is
//! decided about them is decided about the coefficients as given, without rounding.
//!
//! Rows of a Routh table and terms of a Sturm chain are freed of their common divisor, which keeps them as short as
//! subresultants are.

use alloc::{vec, vec::Vec};

use num_bigint::{BigInt, BigUint, Sign};

/// `sum_i c[i] 2^exponent x^i`, without trailing zeros.
#[derive(Debug, Clone)]
pub(crate) struct Exact {
    pub(crate) c: Vec<BigInt>,
    exponent: i64,
}

/// `mantissa * 2^exponent`, for a finite number.
fn decoded(value: f64) -> (i64, i64) {
    let bits = value.to_bits();
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (mantissa, exponent) = match (bits >> 52) & 0x7ff {
        0 => (fraction, -1074),
        e => (fraction | (1 << 52), e as i64 - 1075),
    };
    (if value < 0.0 { -mantissa } else { mantissa }, exponent)
}

impl Exact {
    /// `sum_i c[i] (2^scale p)^i`, for finite coefficients.
    pub(crate) fn new(c: &[f64], scale: i64) -> Self {
        let parts = c.iter().enumerate().map(|(i, c)| {
            let (mantissa, exponent) = decoded(*c);
            (mantissa, exponent + scale * i as i64)
        });
        let parts: Vec<(i64, i64)> = parts.collect();
        let used = parts.iter().filter(|(mantissa, _)| *mantissa != 0);
        let exponent = used.map(|(_, exponent)| *exponent).min().unwrap_or(0);
        let shifted = parts.iter().map(|&(mantissa, e)| match mantissa {
            0 => BigInt::ZERO,
            _ => BigInt::from(mantissa) << (e - exponent) as u64,
        });
        Self {
            c: shifted.collect(),
            exponent,
        }
        .trimmed()
    }

    fn trimmed(mut self) -> Self {
        while self.c.last().is_some_and(|c| c.sign() == Sign::NoSign) {
            self.c.pop();
        }
        self
    }

    /// `(E, O)` with `P(jw) = E(w^2) + jw O(w^2)`.
    pub(crate) fn even_odd(&self) -> (Self, Self) {
        let part = |first: usize| {
            let every = self.c.iter().skip(first).step_by(2).enumerate();
            Self {
                c: every
                    .map(|(i, c)| if i % 2 == 0 { c.clone() } else { -c })
                    .collect(),
                exponent: self.exponent,
            }
            .trimmed()
        };
        (part(0), part(1))
    }

    /// `x P(x)`.
    pub(crate) fn times_x(mut self) -> Self {
        if !self.c.is_empty() {
            self.c.insert(0, BigInt::ZERO);
        }
        self
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut c = vec![BigInt::ZERO; (self.c.len() + other.c.len()).saturating_sub(1)];
        for (i, a) in self.c.iter().enumerate() {
            for (j, b) in other.c.iter().enumerate() {
                c[i + j] += a * b;
            }
        }
        Self {
            c,
            exponent: self.exponent + other.exponent,
        }
        .trimmed()
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        let exponent = self.exponent.min(other.exponent);
        let at = |p: &Self, i: usize| match p.c.get(i) {
            Some(c) => c << (p.exponent - exponent) as u64,
            None => BigInt::ZERO,
        };
        let n = self.c.len().max(other.c.len());
        Self {
            c: (0..n).map(|i| at(self, i) + at(other, i)).collect(),
            exponent,
        }
        .trimmed()
    }

    pub(crate) fn degree(&self) -> Option<usize> {
        self.c.len().checked_sub(1)
    }

    /// Coefficients over a common power of 2, the largest between 1/2 and 1, each to half a unit of its last digit.
    pub(crate) fn rounded(&self) -> Vec<f64> {
        let most = self.c.iter().map(BigInt::bits).max().unwrap_or(0);
        let number = |c: &BigInt| {
            // The 64 leading bits, the last of them set where bits were dropped, round as all of them would.
            let drop = c.bits().saturating_sub(64);
            let head = c.magnitude() >> drop;
            let lost = drop > 0
                && c.magnitude()
                    .trailing_zeros()
                    .is_some_and(|zeros| zeros < drop);
            let head = head.iter_u64_digits().next().unwrap_or(0) | u64::from(lost);
            let back = drop as i64 - most as i64;
            let size = libm::ldexp(head as f64, back.max(-5000) as i32);
            if c.sign() == Sign::Minus { -size } else { size }
        };
        self.c.iter().map(number).collect()
    }

    /// Whether every root has a real part below 0: Routh's table in integers. False for 0.
    pub(crate) fn is_hurwitz(&self) -> bool {
        let Some(leading) = self.c.last() else {
            return false;
        };
        let sign = if leading.sign() == Sign::Minus { -1 } else { 1 };
        let row = |first: usize| -> Vec<BigInt> {
            self.c
                .iter()
                .rev()
                .skip(first)
                .step_by(2)
                .map(|c| c * sign)
                .collect()
        };
        let (mut above, mut row) = (row(0), row(1));
        while !row.is_empty() {
            // Zero here: a root on the axis, or beyond it. A row of zeros: roots that lie symmetric to 0.
            if row[0].sign() != Sign::Plus {
                return false;
            }
            let next = (1..above.len()).map(|i| {
                let beside = row.get(i).map(|beside| &above[0] * beside);
                &row[0] * &above[i] - beside.unwrap_or_default()
            });
            let next = primitive(next.collect());
            above = row;
            row = next;
        }
        true
    }

    /// Whether the polynomial is above 0 on all of `[0, inf)`: Sturm's chain in integers.
    pub(crate) fn is_positive_from_zero(&self) -> bool {
        let (Some(first), Some(last)) = (self.c.first(), self.c.last()) else {
            return false;
        };
        if first.sign() != Sign::Plus || last.sign() != Sign::Plus {
            return false;
        }
        // Descartes: without a change of sign there is no positive root.
        if self.c.iter().all(|c| c.sign() != Sign::Minus) {
            return true;
        }
        let (mut at_zero, mut at_infinity) = (Variations::default(), Variations::default());
        let slopes = self.c.iter().enumerate().skip(1);
        let mut a = primitive(self.c.clone());
        let mut b = primitive(slopes.map(|(i, c)| c * i).collect());
        at_zero.see(&a[0]);
        at_infinity.see(&a[a.len() - 1]);
        while let (Some(first), Some(last)) = (b.first(), b.last()) {
            at_zero.see(first);
            at_infinity.see(last);
            let rest = negative_remainder(a, &b);
            a = b;
            b = rest;
        }
        // The number of different roots in (0, inf), whatever their multiplicity.
        at_zero.count == at_infinity.count
    }
}

/// Changes of sign along a chain, zeros left out.
#[derive(Default)]
struct Variations {
    last: Option<Sign>,
    count: usize,
}

impl Variations {
    fn see(&mut self, value: &BigInt) {
        let sign = value.sign();
        if sign == Sign::NoSign {
            return;
        }
        self.count += usize::from(self.last.is_some_and(|last| last != sign));
        self.last = Some(sign);
    }
}

/// A positive multiple of `-(a mod b)`, for b not 0.
fn negative_remainder(mut a: Vec<BigInt>, b: &[BigInt]) -> Vec<BigInt> {
    let Some(leading) = b.last() else {
        return Vec::new();
    };
    let size = BigInt::from(leading.magnitude().clone());
    while a.len() >= b.len() {
        let Some(top) = a.pop() else { break };
        let top = if leading.sign() == Sign::Minus {
            -top
        } else {
            top
        };
        let shift = a.len() + 1 - b.len();
        for (i, a) in a.iter_mut().enumerate() {
            *a *= &size;
            if let Some(b) = i.checked_sub(shift).and_then(|i| b.get(i)) {
                *a -= &top * b;
            }
        }
        while a.last().is_some_and(|a| a.sign() == Sign::NoSign) {
            a.pop();
        }
    }
    primitive(a.iter().map(|a| -a).collect())
}

/// The polynomial divided by the greatest common divisor of its coefficients.
fn primitive(c: Vec<BigInt>) -> Vec<BigInt> {
    let mut divisor = BigUint::ZERO;
    for c in &c {
        divisor = gcd(divisor, c.magnitude().clone());
    }
    if divisor.bits() <= 1 {
        return c;
    }
    let divisor = BigInt::from(divisor);
    c.iter().map(|c| c / &divisor).collect()
}

/// Stein's rule: shifts and subtractions.
fn gcd(mut a: BigUint, mut b: BigUint) -> BigUint {
    let (Some(i), Some(j)) = (a.trailing_zeros(), b.trailing_zeros()) else {
        return a + b;
    };
    a >>= i;
    b >>= j;
    while let Some(zeros) = b.trailing_zeros() {
        b >>= zeros;
        if a > b {
            core::mem::swap(&mut a, &mut b);
        }
        b -= &a;
    }
    a << i.min(j)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half a unit of the last digit plus a small amount is rounded up, also if the small amount is beyond the 64 leading bits.
    #[test]
    fn what_is_dropped_counts_where_a_half_is_rounded() {
        let rounded = |c: u128| {
            let exact = Exact {
                c: vec![BigInt::from(c)],
                exponent: 0,
            };
            exact.rounded()[0]
        };
        let (one, half) = (1_u128 << 100, 1_u128 << 47);
        let up = 0.5 + f64::EPSILON / 2.0;
        // a half alone goes to the even digit
        assert_eq!(rounded(one + half), 0.5);
        for more in [1, 1 << 36, 1 << 37, (1 << 37) + 1, (1 << 38) - 1] {
            assert_eq!(rounded(one + half + more), up, "{more:x}");
            assert_eq!(rounded(one + half - more), 0.5, "{more:x}");
        }
    }
}
