//! Roots of a real polynomial, all at once, by Ehrlich's and Aberth's iteration.
//!
//! Equations: with the Newton step `N = P(z)/P'(z)`, `z -= N / (1 - N sum_j 1/(z - z_j))`. Starts lie on circles read
//! off the Newton polygon of `log |c|` (Bini), so roots of very different size are found alike; where `|z| > 1` the
//! reversed polynomial is evaluated, so nothing overflows. A root is left alone when `|P(z)|` is at the rounding error
//! of its own evaluation. Roots are conjugate in pairs, or real, exactly.
//!
//! Accuracy: that of roots of coefficients off by some 1e-16 of themselves: about `1e-16 |z| cond` for a simple root.
//! **A root of multiplicity m is found to about `1e-16^(1/m)` only** (1e-8 for a double, 5e-6 for a triple), as m
//! separate ones around it: no method that sees rounded coefficients does better. Their mean is accurate. Ask
//! [`Polynomial::is_hurwitz`], not the roots, whether all lie in the left half plane: that is decided exactly.
//!
//! Cost: O(n^2) an iteration, 5 to 20 iterations.
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
                what: "the polynomial whose roots are asked for",
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

/// The Newton step `P(z)/P'(z)`, or none where `P(z)` is at its rounding error.
fn newton(c: &[f64], z: Complex64) -> Option<Complex64> {
    let n = c.len() - 1;
    let zero = Complex64::new(0.0, 0.0);
    let reversed = z.norm_sqr() > 1.0;
    let at = if reversed { z.inv() } else { z };
    let (mut value, mut slope, mut size) = (zero, zero, 0.0);
    let modulus = at.norm();
    let mut step = |c: f64| {
        slope = slope * at + value;
        value = value * at + c;
        size = size * modulus + c.abs();
    };
    if reversed {
        c.iter().for_each(|c| step(*c));
    } else {
        c.iter().rev().for_each(|c| step(*c));
    }
    if value.norm() <= 2.0 * n as f64 * f64::EPSILON * size {
        return None;
    }
    Some(if reversed {
        // P(z) = z^n Q(1/z): P'/P = (n - at Q'/Q)/z.
        z / (n as f64 - at * (slope / value))
    } else {
        value / slope
    })
}

fn aberth(c: &[f64]) -> Result<Vec<Complex64>, Error> {
    let mut roots = starts(c);
    let n = roots.len();
    let mut open: Vec<bool> = vec![true; n];
    for _ in 0..ITERATIONS {
        for i in 0..n {
            if !open[i] {
                continue;
            }
            let z = roots[i];
            let Some(step) = newton(c, z) else {
                open[i] = false;
                continue;
            };
            let repulsion: Complex64 = (0..n)
                .filter(|&j| j != i && roots[j] != z)
                .map(|j| (z - roots[j]).inv())
                .sum();
            let mut change = step / (Complex64::new(1.0, 0.0) - step * repulsion);
            if !(change.re.is_finite() && change.im.is_finite()) {
                // P'(z) = 0, or the denominator: leave the spot, by a step that has no symmetry.
                change = z * Complex64::new(3e-3, 7e-3) + Complex64::new(1e-300, 0.0);
            }
            roots[i] = z - change;
            if change.norm() <= 0.25 * f64::EPSILON * z.norm() {
                open[i] = false;
            }
        }
        if open.iter().all(|open| !open) {
            return Ok(conjugate(roots));
        }
    }
    Err(Error::NoConvergence {
        degree: n,
        iterations: ITERATIONS,
    })
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
            // The offset keeps the starts off the real axis, where the iteration would stay.
            let angle = TAU * (j as f64 / count as f64 + k as f64 / c.len() as f64) + 0.7;
            starts.push(Complex64::from_polar(radius, angle));
        }
    }
    starts
}

/// Each root beside the one that is nearest to its conjugate, itself included: real, or a pair.
fn conjugate(mut open: Vec<Complex64>) -> Vec<Complex64> {
    let mut roots = Vec::with_capacity(open.len());
    // Those farthest from the axis first: they cannot be mistaken for real ones.
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
