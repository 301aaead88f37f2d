//! Whether bounds on `c^` keep the method convergent: `C^/A0 - d` strictly positive real for every `A0` of a box, decided exactly.
//!
//! With noise, `theta^` converges to the plant's parameters where `Re C^(jw)/A0(jw) > d` at every frequency, `d = gamma/(2 c)` for the
//! least-squares gain and 0 for a constant one (L. Ljung, T. Soderstrom, *Theory and Practice of Recursive Identification*, 1983;
//! [U] section 5 has 0 throughout).
//!
//! Equations: with `C = E_C + jw O_C`, `A = E + jw O` and `x = w^2` the condition is
//! ```text
//! E_C E + x O_C O - d (E^2 + x O^2) > 0
//! ```
//! At each frequency a box of coefficients makes `(E, O)` fill a rectangle, whose corners are Kharitonov's four polynomials at every
//! frequency. The left side is linear in `(E_C, O_C)` and, for `d >= 0`, concave in `(E, O)`: it is lowest at corners. So 16 pairs decide
//! for the whole of both boxes, and four polynomials for the stability of all `A0`; each by [`ct_lti::TransferFunction::exceeds`], exactly.
//!
//! For `d = 0`: n = 1, `c_1 >= 0`; n = 2, `c_2 >= 0` and `a_1 c_1 > (sqrt a_2 - sqrt c_2)^2`.
//!
//! Reference: V. L. Kharitonov, 1978; for the corners S. Dasgupta, *Kharitonov's theorem revisited*, Systems & Control Letters 11, 1988.

use ct_constrained::Bounds;
use ct_lti::{Polynomial, Positivity, TransferFunction};

use crate::{Derivatives, Error, Gain, StabilizedOe};

/// Result of the check of bounds on `c^`. [`Display`](core::fmt::Display) gives it in a sentence, which is the warning if the check fails.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use = "bounds outside such a set guarantee nothing: print this result, or look at hold()"]
pub enum FilterBounds<const N: usize> {
    /// `C^/A0 - d` is strictly positive real for every `c` and every plausible plant.
    PositiveReal,
    /// The transfer function is not positive real for these values, a corner of the two boxes.
    NotPositiveReal {
        /// `c_1` to `c_n`
        c: [f64; N],
        /// `a_1` to `a_n`
        a: [f64; N],
        /// A frequency where it fails, rad/s.
        frequency: f64,
        /// `Re C^/A0 - d` at this frequency.
        excess: f64,
        /// `d`
        above: f64,
    },
    /// A plausible plant is unstable: the corner `a_1` to `a_n`.
    PlantUnstable {
        /// `a_1` to `a_n`
        a: [f64; N],
    },
}

impl<const N: usize> FilterBounds<N> {
    /// Whether the bounds are such a set.
    pub fn hold(&self) -> bool {
        *self == Self::PositiveReal
    }
}

impl<const N: usize> core::fmt::Display for FilterBounds<N> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::PositiveReal => {
                write!(
                    f,
                    "the bounds on c are safe: C/A0 stays strictly positive real, with the margin that the gain needs, for every plausible plant"
                )
            }
            Self::NotPositiveReal {
                c,
                a,
                frequency,
                excess,
                above,
            } => write!(
                f,
                "the bounds on c do not guarantee convergence: with c = {c:?} and a plant a = {a:?}, Re C/A0 is {:.3} at {frequency:.3e} rad/s, not above {above}; narrow the bounds on c, or the plausible plants",
                excess + above
            ),
            Self::PlantUnstable { a } => write!(
                f,
                "the bounds on c guarantee nothing: the plausible plant a = {a:?} is unstable; narrow the plausible plants"
            ),
        }
    }
}

/// Whether `C/A0 - above` is strictly positive real for every `c` in its bounds and every `A0 = 1 + a_1 s + .. + a_n s^n` with `a` in
/// `plausible`; `above` at least 0. Finite bounds: an infinite one never holds.
///
/// # Errors
/// [`Error::Plausible`], [`Error::Lti`] for an `above` that is not finite.
pub fn check_filter_bounds<const N: usize>(
    filter: &Bounds<N>,
    plausible: &Bounds<N>,
    above: f64,
) -> Result<FilterBounds<N>, Error> {
    for i in 0..N {
        let (lower, upper) = (plausible.lower()[i], plausible.upper()[i]);
        if !(lower > 0.0 && upper.is_finite()) {
            return Err(Error::Plausible {
                index: i + 1,
                lower,
                upper,
            });
        }
    }
    for corner in 0..4 {
        let a = kharitonov(plausible, corner);
        if !polynomial(&a)?.is_hurwitz() {
            return Ok(FilterBounds::PlantUnstable { a });
        }
    }
    for pair in 0..16 {
        let (c, a) = (
            kharitonov(filter, pair / 4),
            kharitonov(plausible, pair % 4),
        );
        let fails = |frequency, excess| FilterBounds::NotPositiveReal {
            c,
            a,
            frequency,
            excess,
            above,
        };
        if c.iter().any(|c| !c.is_finite()) {
            return Ok(fails(f64::INFINITY, f64::NEG_INFINITY));
        }
        let found = TransferFunction::new(polynomial(&c)?, polynomial(&a)?)?.exceeds(above)?;
        match found {
            Positivity::Fails { frequency, excess } => return Ok(fails(frequency, excess)),
            Positivity::Unstable => return Ok(FilterBounds::PlantUnstable { a }),
            _ => {}
        }
    }
    Ok(FilterBounds::PositiveReal)
}

/// `a_1` to `a_n` of one of Kharitonov's polynomials, `corner` from 0 to 3: the even part at its top or bottom for every frequency, and
/// the odd part.
fn kharitonov<const N: usize>(bounds: &Bounds<N>, corner: usize) -> [f64; N] {
    core::array::from_fn(|i| {
        let power = i + 1;
        // (jw)^power = +-w^power or +-jw^power, + for power mod 4 of 0 and 1
        let positive = power % 4 < 2;
        let top = if power % 2 == 0 {
            corner & 1
        } else {
            corner >> 1
        } == 1;
        if top == positive {
            bounds.upper()[i]
        } else {
            bounds.lower()[i]
        }
    })
}

/// `1 + c_1 s + .. + c_n s^n`
fn polynomial<const N: usize>(c: &[f64; N]) -> Result<Polynomial, Error> {
    let coefficients: alloc::vec::Vec<f64> =
        core::iter::once(1.0).chain(c.iter().copied()).collect();
    Ok(Polynomial::new(coefficients)?)
}

impl<const N: usize, const P: usize, G: Gain<N, P>, D: Derivatives<N>, const R: usize>
    StabilizedOe<N, P, G, D, R>
{
    /// [`check_filter_bounds`] of this estimator's bounds on `c^` and its gain's `gamma/(2 c)`, for plants that are plausible.
    ///
    /// # Errors
    /// [`Error::Plausible`].
    pub fn check_filter_bounds(&self, plausible: &Bounds<N>) -> Result<FilterBounds<N>, Error> {
        check_filter_bounds(
            self.filter_bounds(),
            plausible,
            self.gain().positive_above(),
        )
    }

    /// As [`with_filter_bounds`](Self::with_filter_bounds), with the result of [`check_filter_bounds`](Self::check_filter_bounds).
    ///
    /// # Errors
    /// [`Error::StartOutside`], [`Error::Plausible`].
    pub fn with_filter_bounds_for(
        self,
        bounds: Bounds<N>,
        plausible: &Bounds<N>,
    ) -> Result<(Self, FilterBounds<N>), Error> {
        let bounded = self.with_filter_bounds(bounds)?;
        let checked = bounded.check_filter_bounds(plausible)?;
        Ok((bounded, checked))
    }
}
