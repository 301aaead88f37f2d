//! Roots of a real polynomial, all at once, by Ehrlich's and Aberth's iteration.
//!
//! Equations: with the Newton step `N = P(z)/P'(z)`, `z -= N / (1 - N sum_j 1/(z - z_j))`. Starts lie on circles read
//! off the Newton polygon of `log |c|` (Bini), so roots of very different size are found alike; where `|z| > 1` the
//! reversed polynomial is evaluated, so nothing overflows. A root is left alone when `|P(z)|` is at the rounding error
//! of its own evaluation; then all are improved with P evaluated in twice the digits. Roots are conjugate in pairs, or
//! real, exactly.
//!
//! Accuracy: the roots of the coefficients as given, to some 1e-15 of themselves where they are simple. Coefficients
//! that were rounded before are another matter: **a root of multiplicity m is found to about `1e-16^(1/m)` only** (1e-8
//! for a double, 5e-6 for a triple), as m separate ones around it: those are the roots of the rounded coefficients.
//! Their mean is accurate. Ask [`Polynomial::is_hurwitz`], not the roots, whether all lie in the left half plane: that
//! is decided exactly.
//!
//! Cost: O(n^2) an iteration, 5 to 20 iterations; 2 to 7 us for order 4, 4 to 13 us for order 6, the more the closer the
//! roots.
//!
//! Reference: D. A. Bini, Numerical computation of polynomial zeros by means of Aberth's method, Numer. Algorithms 13
//! (1996).

use alloc::{vec, vec::Vec};
use core::f64::consts::TAU;

use num_complex::Complex64;

use crate::{Error, Polynomial};

const ITERATIONS: usize = 400;

const OUT_OF_RANGE: Error = Error::Overflow {
    what: "a root",
    mend: "scale the time so that the roots are near 1",
};

impl Polynomial {
    /// All its roots with their multiplicity, real ones with an imaginary part of exactly 0, the others in conjugate
    /// pairs, sorted by real part, then by imaginary part \[1/time\]. See the head of `roots.rs` for the accuracy, in
    /// short: full for simple roots, `1e-16^(1/m)` for those of multiplicity m. None for a constant.
    ///
    /// # Errors
    /// [`Error::ZeroPolynomial`], [`Error::NotFinite`] for coefficients that overflowed, [`Error::Overflow`] for a
    /// root beyond the range of `f64`, [`Error::NoConvergence`].
    pub fn roots(&self) -> Result<Vec<Complex64>, Error> {
        crate::error::finite("a polynomial", self.coefficients())?;
        if self.is_zero() {
            return Err(Error::ZeroPolynomial {
                what: "the polynomial whose roots are wanted",
            });
        }
        let zeros = self
            .coefficients()
            .iter()
            .take_while(|c| **c == 0.0)
            .count();
        let (coefficients, exponent) = normalised(&self.coefficients()[zeros..]);
        let ends = [coefficients.first(), coefficients.last()];
        if ends.contains(&Some(&0.0)) {
            return Err(OUT_OF_RANGE);
        }
        let mut roots = match coefficients.len() {
            0 | 1 => Vec::new(),
            2 => vec![Complex64::new(-coefficients[0] / coefficients[1], 0.0)],
            3 => quadratic(&coefficients).to_vec(),
            _ => aberth(&coefficients)?,
        };
        for z in &mut roots {
            *z = Complex64::new(libm::ldexp(z.re, exponent), libm::ldexp(z.im, exponent));
        }
        if roots.iter().any(|z| !z.re.is_finite() || !z.im.is_finite()) {
            return Err(OUT_OF_RANGE);
        }
        roots.resize(roots.len() + zeros, Complex64::new(0.0, 0.0));
        let by_part =
            |a: &Complex64, b: &Complex64| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im));
        roots.sort_by(by_part);
        Ok(roots)
    }
}

/// `c[i] 2^(e i)` over the largest of them, with e such that the outer two are of one size, by powers of 2 and so
/// without rounding: roots become those of the result times `2^e`.
fn normalised(c: &[f64]) -> (Vec<f64>, i32) {
    let n = c.len().saturating_sub(1);
    let size = |c: f64| libm::frexp(c).1;
    let e = match (c.first(), c.last()) {
        (Some(&first), Some(&last)) if n > 0 => (size(first) - size(last)).div_euclid(n as i32),
        _ => 0,
    };
    let sizes = c.iter().enumerate().filter(|(_, c)| **c != 0.0);
    let most = sizes
        .map(|(i, c)| size(*c) + e * i as i32)
        .max()
        .unwrap_or(0);
    let scaled = c
        .iter()
        .enumerate()
        .map(|(i, c)| libm::ldexp(*c, e * i as i32 - most));
    (scaled.collect(), e)
}

/// The two roots of `c[0] + c[1] z + c[2] z^2`, without cancellation.
fn quadratic(c: &[f64]) -> [Complex64; 2] {
    let half = -0.5 * c[1] / c[2];
    let product = c[0] / c[2];
    // half^2 - product to working accuracy, also where they nearly cancel.
    let discriminant = fma_difference(half, half, product, 1.0);
    if discriminant < 0.0 {
        let im = libm::sqrt(-discriminant);
        return [Complex64::new(half, im), Complex64::new(half, -im)];
    }
    let large = half + libm::copysign(libm::sqrt(discriminant), half);
    let small = if large == 0.0 { 0.0 } else { product / large };
    [Complex64::new(large, 0.0), Complex64::new(small, 0.0)]
}

/// `a b - c d` by Kahan's rule.
fn fma_difference(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    let error = libm::fma(-c, d, cd);
    libm::fma(a, b, -cd) + error
}

/// `a/b`, also if the square of b overflows.
fn ratio(a: Complex64, b: Complex64) -> Complex64 {
    let size = b.re.abs().max(b.im.abs());
    (a / size) / (b / size)
}

/// Double-double number: the unevaluated sum of two numbers, with twice the digits of one.
#[derive(Clone, Copy)]
struct Double {
    high: f64,
    low: f64,
}

impl Double {
    /// `self x + y z`, to about the 30th digit.
    fn times_plus(self, x: f64, y: Self, z: f64) -> Self {
        let (a, b) = (self.high * x, y.high * z);
        let rounded = libm::fma(self.high, x, -a) + libm::fma(y.high, z, -b);
        let low = rounded + (self.low * x + y.low * z);
        let sum = Self::sum(a, b);
        Self::sum(sum.high, sum.low + low)
    }

    fn plus(self, c: f64) -> Self {
        let sum = Self::sum(self.high, c);
        Self::sum(sum.high, sum.low + self.low)
    }

    /// `a + b` and its rounding error (Knuth).
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let b_part = high - a;
        let low = (a - (high - b_part)) + (b - b_part);
        Self { high, low }
    }
}

/// The Newton step `P(z)/P'(z)`, or none where `P(z)` is at its rounding error. `fine` evaluates with twice the digits.
fn newton(c: &[f64], z: Complex64, fine: bool) -> Option<Complex64> {
    let n = c.len() - 1;
    let reversed = z.norm() > 1.0;
    let at = if reversed { z.inv() } else { z };
    let (mut slope, mut size) = (Complex64::new(0.0, 0.0), 0.0);
    let mut value = slope;
    let zero = Double {
        high: 0.0,
        low: 0.0,
    };
    let (mut re, mut im) = (zero, zero);
    let modulus = at.norm();
    for i in 0..=n {
        let c = c[if reversed { i } else { n - i }];
        slope = slope * at + value;
        size = size * modulus + c.abs();
        if fine {
            let (x, y) = (re, im);
            re = x.times_plus(at.re, y, -at.im).plus(c);
            im = x.times_plus(at.im, y, at.re);
            value = Complex64::new(re.high, im.high);
        } else {
            value = value * at + c;
        }
    }
    let precision = if fine {
        f64::EPSILON * f64::EPSILON
    } else {
        f64::EPSILON
    };
    if value.norm() <= 2.0 * n as f64 * precision * size {
        return None;
    }
    Some(if reversed {
        // P(z) = z^n Q(1/z): P'/P = (n - at Q'/Q)/z.
        z / (n as f64 - at * ratio(slope, value))
    } else {
        ratio(value, slope)
    })
}

fn aberth(c: &[f64]) -> Result<Vec<Complex64>, Error> {
    let mut roots = starts(c);
    let n = roots.len();
    let mut settle = |fine: bool, most: usize| {
        let mut open: Vec<bool> = vec![true; n];
        for _ in 0..most {
            for (i, open) in open.iter_mut().enumerate() {
                *open = *open && improve(c, &mut roots, i, fine);
            }
            if !open.contains(&true) {
                return true;
            }
        }
        false
    };
    // First to the rounding error of one evaluation.
    if !settle(false, ITERATIONS) {
        return Err(Error::NoConvergence {
            degree: n,
            iterations: ITERATIONS,
        });
    }
    // Then continue with twice the digits. Steps may alternate in the last digit of z for ever; this number of steps is always enough.
    settle(true, 30);
    Ok(conjugate(roots))
}

/// One iteration of one root; returns whether another iteration is worthwhile.
fn improve(c: &[f64], roots: &mut [Complex64], i: usize, fine: bool) -> bool {
    let z = roots[i];
    let Some(step) = newton(c, z, fine) else {
        return false;
    };
    let one = Complex64::new(1.0, 0.0);
    let others = roots.iter().filter(|other| **other != z);
    let repulsion: Complex64 = others.map(|other| ratio(one, z - other)).sum();
    let mut change = step / (one - step * repulsion);
    if !(change.re.is_finite() && change.im.is_finite()) {
        // P'(z) = 0, or the denominator is 0: move away by a step without symmetry.
        change = z * Complex64::new(3e-3, 7e-3) + Complex64::new(1e-300, 0.0);
    }
    roots[i] = z - change;
    change.norm() > 2.0 * f64::EPSILON * z.norm()
}

/// Starts on circles whose radii are the slopes of the upper hull of `(i, log |c[i]|)`.
fn starts(c: &[f64]) -> Vec<Complex64> {
    let logs: Vec<f64> = c.iter().map(|c| libm::log(c.abs())).collect();
    let mut hull: Vec<usize> = Vec::new();
    for (i, _) in c.iter().enumerate().filter(|(_, c)| **c != 0.0) {
        while let [.., a, b] = hull[..] {
            let slope = |from: usize, to: usize| (logs[to] - logs[from]) / (to - from) as f64;
            if slope(a, b) > slope(b, i) {
                break;
            }
            hull.pop();
        }
        hull.push(i);
    }
    let mut starts = Vec::with_capacity(c.len() - 1);
    for (k, pair) in hull.windows(2).enumerate() {
        let count = pair[1] - pair[0];
        let radius = libm::exp((logs[pair[0]] - logs[pair[1]]) / count as f64);
        for j in 0..count {
            // The offset keeps the starts off the real axis, because iterates on the axis stay on it.
            let angle = TAU * (j as f64 / count as f64 + k as f64 / c.len() as f64) + 0.7;
            starts.push(Complex64::from_polar(radius, angle));
        }
    }
    starts
}

/// Pairs each root with the root nearest to its conjugate. A root that is paired with itself is real.
fn conjugate(mut open: Vec<Complex64>) -> Vec<Complex64> {
    let mut roots = Vec::with_capacity(open.len());
    // Roots with the largest imaginary part first: they cannot be mistaken for real ones.
    open.sort_by(|a, b| a.im.abs().total_cmp(&b.im.abs()));
    while let Some(z) = open.pop() {
        let partner = (0..open.len())
            .map(|i| (i, (open[i] - z.conj()).norm()))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|&(_, distance)| distance < 2.0 * z.im.abs());
        match partner {
            Some((i, _)) => {
                let mean = (z + open.swap_remove(i).conj()) * 0.5;
                roots.extend([mean, mean.conj()]);
            }
            None => roots.push(Complex64::new(z.re, 0.0)),
        }
    }
    roots
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The circles of the starts have the sizes of the roots, wherever these lie far apart.
    #[test]
    fn starts_have_the_sizes_of_the_roots() {
        // two roots of the size e^2 and one of e^3: the hull of the coefficients has the slopes -2 and -3
        let c = [1.0, 0.0, libm::exp(-4.0), libm::exp(-7.0)];
        let sizes: Vec<f64> = starts(&c).iter().map(|z| libm::log(z.norm())).collect();
        for (size, expected) in sizes.iter().zip([2.0, 2.0, 3.0]) {
            assert!((size - expected).abs() < 1e-12, "{sizes:?}");
        }
        // (s + 1e-3)(s + 1e3)
        let sizes: Vec<f64> = starts(&[1.0, 1000.001, 1.0])
            .iter()
            .map(|z| z.norm())
            .collect();
        for (size, expected) in sizes.iter().zip([1e-3, 1e3]) {
            assert!((size / expected - 1.0).abs() < 1e-5, "{sizes:?}");
        }
    }
}
