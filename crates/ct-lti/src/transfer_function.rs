//! Transfer functions `G = B/A` of one input and one output, proper.
//!
//! Common poles and zeros are not cancelled in a series connection.

use alloc::vec::Vec;

use num_complex::Complex64;

use crate::{Error, Polynomial, StateSpace};

/// `B(p)/A(p)` with `deg B <= deg A`. Coefficients stay as given: `A` may be monic, or start with 1 as in
/// `A = 1 + a1 p + ..`, or neither.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    numerator: Polynomial,
    denominator: Polynomial,
}

impl TransferFunction {
    /// `numerator/denominator`.
    ///
    /// # Errors
    /// [`Error::ZeroPolynomial`] for a denominator of 0, [`Error::Improper`], [`Error::Overflow`] for coefficients
    /// that overflowed.
    pub fn new(numerator: Polynomial, denominator: Polynomial) -> Result<Self, Error> {
        let numerator = numerator.checked("the numerator of a transfer function")?;
        let denominator = denominator.checked("the denominator of a transfer function")?;
        let Some(order) = denominator.degree() else {
            return Err(Error::ZeroPolynomial {
                what: "the denominator",
            });
        };
        match numerator.degree() {
            Some(degree) if degree > order => Err(Error::Improper {
                numerator: degree,
                denominator: order,
            }),
            _ => Ok(Self {
                numerator,
                denominator,
            }),
        }
    }

    /// `b/a` from ascending coefficients: `[K]` over `[1, tau]` for a first-order lag.
    ///
    /// # Errors
    /// As [`TransferFunction::new`], and [`Error::NotFinite`].
    pub fn from_coefficients(numerator: &[f64], denominator: &[f64]) -> Result<Self, Error> {
        Self::new(Polynomial::new(numerator)?, Polynomial::new(denominator)?)
    }

    /// B.
    pub fn numerator(&self) -> &Polynomial {
        &self.numerator
    }

    /// A.
    pub fn denominator(&self) -> &Polynomial {
        &self.denominator
    }

    /// Degree of A: the number of states.
    pub fn order(&self) -> usize {
        self.denominator.degree().unwrap_or(0)
    }

    /// Gain at infinite frequency: the share of a step of the input that appears at the output at once.
    pub fn direct_term(&self) -> f64 {
        self.numerator.coefficient(self.order()) / self.denominator.leading()
    }

    /// Roots of A, see [`Polynomial::roots`] \[1/time\].
    ///
    /// # Errors
    /// Those of [`Polynomial::roots`].
    pub fn poles(&self) -> Result<Vec<Complex64>, Error> {
        self.denominator.roots()
    }

    /// Roots of B, none for `B = 0` \[1/time\].
    ///
    /// # Errors
    /// Those of [`Polynomial::roots`].
    pub fn zeros(&self) -> Result<Vec<Complex64>, Error> {
        if self.numerator.is_zero() {
            return Ok(Vec::new());
        }
        self.numerator.roots()
    }

    /// Whether all poles have a real part below 0, decided exactly; see [`Polynomial::is_hurwitz`].
    pub fn is_stable(&self) -> bool {
        self.denominator.is_hurwitz()
    }

    /// `G(0)`; `None` if there is a pole at 0.
    pub fn dc_gain(&self) -> Option<f64> {
        let a = self.denominator.coefficient(0);
        (a != 0.0).then(|| self.numerator.coefficient(0) / a)
    }

    /// `G(jw)` at the angular frequency w \[rad/time\]; the direct term for an infinite one. Not finite on a pole.
    pub fn at_frequency(&self, w: f64) -> Complex64 {
        let (a, b) = (&self.denominator, &self.numerator);
        if w.abs() <= 1.0 {
            return b.at_frequency(w) / a.at_frequency(w);
        }
        // P(jw) = (jw)^n Q(1/(jw)) with the coefficients reversed: powers of a large frequency would overflow.
        let n = self.order();
        let reversed = |p: &Polynomial| {
            Polynomial::trimmed((0..=n).map(|i| p.coefficient(n - i)).collect())
                .at_frequency(-1.0 / w)
        };
        reversed(b) / reversed(a)
    }

    /// `self * next`: the output of self drives next.
    ///
    /// # Errors
    /// [`Error::Overflow`].
    pub fn series(&self, next: &Self) -> Result<Self, Error> {
        Self::new(
            &self.numerator * &next.numerator,
            &self.denominator * &next.denominator,
        )
    }

    /// `self + other`: one input drives both, the outputs are added.
    ///
    /// # Errors
    /// [`Error::Overflow`].
    pub fn parallel(&self, other: &Self) -> Result<Self, Error> {
        let numerator =
            &(&self.numerator * &other.denominator) + &(&other.numerator * &self.denominator);
        Self::new(numerator, &self.denominator * &other.denominator)
    }

    /// `self/(1 + self*back)`: negative feedback, from the reference to the output of self. For a loop of a plant
    /// `B/A` and a controller `R/S` it has the denominator `A S + B R`.
    ///
    /// # Errors
    /// [`Error::AlgebraicLoop`] where the direct terms leave the loop without a solution, [`Error::Overflow`].
    pub fn feedback(&self, back: &Self) -> Result<Self, Error> {
        let determinant = loop_determinant(self.direct_term(), back.direct_term())?;
        let denominator =
            &(&self.denominator * &back.denominator) + &(&self.numerator * &back.numerator);
        let order = self.order() + back.order();
        if denominator.degree() != Some(order)
            && denominator.coefficients().iter().all(|c| c.is_finite())
        {
            return Err(Error::AlgebraicLoop {
                forward: self.direct_term(),
                backward: back.direct_term(),
                determinant,
            });
        }
        Self::new(&self.numerator * &back.denominator, denominator)
    }

    /// The output at `times` after a step of the input from 0 to 1 at time 0, from rest: exact at each, to rounding.
    /// 0 before the step; the direct term at time 0.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::Overflow`] where an unstable one has grown out of range.
    pub fn step_response(&self, times: &[f64]) -> Result<Vec<f64>, Error> {
        StateSpace::controllable(self)?.step_response(times)
    }
}

/// `1 + forward*backward`, which must not be 0.
pub(crate) fn loop_determinant(forward: f64, backward: f64) -> Result<f64, Error> {
    let determinant = libm::fma(forward, backward, 1.0);
    if determinant == 0.0 || !determinant.is_finite() {
        return Err(Error::AlgebraicLoop {
            forward,
            backward,
            determinant,
        });
    }
    Ok(determinant)
}
