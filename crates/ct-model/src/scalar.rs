//! Numbers that a simulation runs on: plain `f64`, or forward duals that carry exact derivatives.

#![allow(
    clippy::needless_range_loop,
    reason = "iterators over two or three arrays take many times as long to compile"
)]

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Number type of the simulator. Comparisons use [`Scalar::value`]: the value alone selects a branch, and the derivative is that of the
/// selected branch.
pub trait Scalar:
    Copy
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// How many derivatives it carries.
    const LANES: usize;
    /// A number without derivatives.
    fn constant(value: f64) -> Self;
    /// The `lane`-th variable itself: derivative one in its own lane. A `lane` at or beyond [`Scalar::LANES`] gives a constant.
    fn variable(value: f64, lane: usize) -> Self;
    /// The value, without derivatives.
    fn value(self) -> f64;
    /// The derivatives, [`Scalar::LANES`] of them.
    fn slopes(&self) -> &[f64];
    /// Square root; the argument must be positive.
    fn sqrt(self) -> Self;
    /// Exponential function.
    fn exp(self) -> Self;
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// Whether both have the same derivatives.
    fn same_derivatives(self, other: Self) -> bool;
    /// A number with this value that depends on others, given its partial derivatives with respect to them.
    fn with_slopes<const K: usize>(value: f64, of: [(Self, f64); K]) -> Self;

    /// The smaller of two by value; the first where they are equal.
    fn min(self, other: Self) -> Self {
        if other.value() < self.value() {
            other
        } else {
            self
        }
    }
    /// The larger of two by value; the first where they are equal.
    fn max(self, other: Self) -> Self {
        if other.value() > self.value() {
            other
        } else {
            self
        }
    }
}

impl Scalar for f64 {
    const LANES: usize = 0;
    #[inline]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline]
    fn variable(value: f64, _lane: usize) -> Self {
        value
    }
    #[inline]
    fn value(self) -> f64 {
        self
    }
    #[inline]
    fn slopes(&self) -> &[f64] {
        &[]
    }
    #[inline]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline]
    fn exp(self) -> Self {
        f64::exp(self)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }
    #[inline]
    fn same_derivatives(self, _other: Self) -> bool {
        true
    }
    #[inline]
    fn with_slopes<const K: usize>(value: f64, _of: [(Self, f64); K]) -> Self {
        value
    }
}

/// A value with `N` exact first derivatives, propagated by the chain rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub re: f64,
    /// Derivatives with respect to `N` chosen parameters.
    pub eps: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// `f(self)` with the value `re` and the derivative `slope` of `f`.
    #[inline(always)]
    fn chain(self, re: f64, slope: f64) -> Self {
        let mut eps = [0.0; N];
        for i in 0..N {
            eps[i] = self.eps[i] * slope;
        }
        Self { re, eps }
    }
}

impl<const N: usize> Scalar for Dual<N> {
    const LANES: usize = N;
    #[inline]
    fn constant(value: f64) -> Self {
        Self {
            re: value,
            eps: [0.0; N],
        }
    }
    #[inline]
    fn variable(value: f64, lane: usize) -> Self {
        let mut variable = Self::constant(value);
        if let Some(own) = variable.eps.get_mut(lane) {
            *own = 1.0;
        }
        variable
    }
    #[inline]
    fn value(self) -> f64 {
        self.re
    }
    #[inline]
    fn slopes(&self) -> &[f64] {
        &self.eps
    }
    #[inline]
    fn sqrt(self) -> Self {
        let root = self.re.sqrt();
        self.chain(root, 0.5 / root)
    }
    #[inline]
    fn exp(self) -> Self {
        let e = self.re.exp();
        self.chain(e, e)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.re.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    #[inline]
    fn same_derivatives(self, other: Self) -> bool {
        self.eps == other.eps
    }
    #[inline]
    fn with_slopes<const K: usize>(value: f64, of: [(Self, f64); K]) -> Self {
        let mut eps = [0.0; N];
        for (by, slope) in &of {
            for i in 0..N {
                eps[i] += by.eps[i] * slope;
            }
        }
        Self { re: value, eps }
    }
}

/// The operators build the result in one pass, by a loop: modifying a copy by value would cost a `memcpy` each, and closures for
/// `array::from_fn` most of the time to compile the crate.
macro_rules! operator {
    ($trait:ident, $method:ident, |$a:ident, $b:ident| $re:expr, |$i:ident| $eps:expr) => {
        #[allow(
            clippy::suspicious_arithmetic_impl,
            reason = "the product rule is a sum"
        )]
        impl<const N: usize> $trait for Dual<N> {
            type Output = Self;
            // The product rule is a sum.
            #[allow(clippy::suspicious_arithmetic_impl)]
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (&self, &other);
                let mut eps = [0.0; N];
                for $i in 0..N {
                    eps[$i] = $eps;
                }
                Self { re: $re, eps }
            }
        }
    };
}

operator!(Add, add, |a, b| a.re + b.re, |i| a.eps[i] + b.eps[i]);
operator!(Sub, sub, |a, b| a.re - b.re, |i| a.eps[i] - b.eps[i]);
operator!(Mul, mul, |a, b| a.re * b.re, |i| a.eps[i] * b.re
    + a.re * b.eps[i]);

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let re = self.re / other.re;
        let inverse = 1.0 / other.re;
        let mut eps = [0.0; N];
        for i in 0..N {
            eps[i] = (self.eps[i] - re * other.eps[i]) * inverse;
        }
        Self { re, eps }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.re, -1.0)
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self {
            re: self.re + other,
            eps: self.eps,
        }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        Self {
            re: self.re - other,
            eps: self.eps,
        }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self.chain(self.re * other, other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn function<T: Scalar>(x: T, y: T) -> T {
        let (sin, cos) = (x * y).sin_cos();
        (x * y + 2.0).sqrt() / (y - x * 0.5) - (-x).exp() * 3.0 + sin * x - cos * y
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let (x, y, h) = (0.7, 1.9, 1e-6);
        let exact = function(Dual::<2>::variable(x, 0), Dual::<2>::variable(y, 1));
        assert_eq!(exact.re.to_bits(), function(x, y).to_bits());
        let dx = (function(x + h, y) - function(x - h, y)) / (2.0 * h);
        let dy = (function(x, y + h) - function(x, y - h)) / (2.0 * h);
        assert_relative_eq!(exact.eps[0], dx, max_relative = 1e-8);
        assert_relative_eq!(exact.eps[1], dy, max_relative = 1e-8);
    }
}
