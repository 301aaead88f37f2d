//! Whether the recursive estimator converges: the condition on its filter, decided exactly.
//!
//! Condition (Baysse, Carrillo, Habbadi, (14)): with `P = A S + B R` of the true plant and `P^ = A^ S + B^ R` of the filter `S/P^` after
//! the sensitivities,
//! ```text
//! Re (P^/P)(jw) > 1/2   for all w, infinity included;   P Hurwitz.
//! ```
//! Decided by a Sturm sequence of a polynomial in `x = w^2`, see [`TransferFunction::exceeds`]. If R has an integrator, the condition
//! requires `b0^ > b0/2` (w = 0), and for `m < n` or a strictly proper R/S `an^ > an/2` (w infinite): a start may be too large by a factor
//! of two or much more, but not too small by a factor of two.
//!
//! The condition is sufficient for the recursion with a fixed filter, and far from necessary. A filter that is updated with the estimates
//! approaches it. The batch fit does not need it.

use ct_lti::{Polynomial, Positivity, TransferFunction};
use serde::{Deserialize, Serialize};

use crate::{ClosedLoop, Controller, Error, PlantModel};

/// Result of condition (14) for one filter and one plant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Result of the condition.
    pub verdict: Verdict,
    /// The smallest `Re (P^/P)(jw)` over all frequencies; NaN where P is not Hurwitz.
    pub least: f64,
    /// Frequency of the minimum \[rad/time\]; infinite if it is the limit at high frequencies, NaN if P is not Hurwitz.
    pub frequency: f64,
}

/// Result of condition (14), and its severity if it fails; a greater value is worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// `Re (P^/P) > 1/2` at every frequency: the recursion converges with this filter.
    Holds,
    /// `Re (P^/P)` falls to 1/2 or below, but stays above 0: the recursion usually converges, without guarantee.
    Positive,
    /// `Re (P^/P)` is 0 or negative at some frequency: data at that frequency move the estimates in the wrong direction.
    Negative,
    /// P itself is not Hurwitz, so the loop is unstable.
    Unstable,
}

impl Condition {
    /// With the filter's P^ and the plant's P.
    ///
    /// # Errors
    /// [`Error::Lti`] for `P = 0`, a P^ of a higher degree, or numbers out of range.
    pub fn new(filter: &Polynomial, truth: &Polynomial) -> Result<Self, Error> {
        let ratio = TransferFunction::new(filter.clone(), truth.clone())?;
        let verdict = match ratio.exceeds(0.5)? {
            Positivity::Unstable => {
                return Ok(Self {
                    verdict: Verdict::Unstable,
                    least: f64::NAN,
                    frequency: f64::NAN,
                });
            }
            // At infinite frequency the condition needs a positive margin too.
            Positivity::Strict => Verdict::Holds,
            _ if ratio.exceeds(0.0)?.is_strict() => Verdict::Positive,
            _ => Verdict::Negative,
        };
        let (frequency, least) = ratio.least_real_part()?;
        Ok(Self {
            verdict,
            least,
            frequency,
        })
    }

    /// The condition for the filter of an estimate, with `truth` as the true plant.
    ///
    /// # Errors
    /// As [`Condition::new`], and those of [`ClosedLoop::new`].
    pub fn between(
        estimate: &PlantModel,
        truth: &PlantModel,
        controller: &Controller,
    ) -> Result<Self, Error> {
        Self::new(
            ClosedLoop::new(estimate, controller)?.characteristic(),
            ClosedLoop::new(truth, controller)?.characteristic(),
        )
    }

    /// Whether the condition is satisfied.
    pub fn holds(&self) -> bool {
        self.verdict == Verdict::Holds
    }
}

/// `P^/P - 1/2` on a logarithmic grid of frequencies, for a plot: `(w, real part, imaginary part)`. The condition is satisfied if the whole
/// curve is to the right of 0. The grid covers the roots of both polynomials and two decades beyond.
///
/// # Errors
/// [`Error::Lti`], as [`Condition::new`].
pub fn locus(
    filter: &Polynomial,
    truth: &Polynomial,
    points: usize,
) -> Result<Vec<(f64, f64, f64)>, Error> {
    let ratio = TransferFunction::new(filter.clone(), truth.clone())?;
    let mut roots = ratio.poles()?;
    roots.extend(ratio.zeros()?);
    let sizes = roots.iter().map(|z| z.norm()).filter(|w| *w > 0.0);
    let (low, high) = sizes.fold((f64::INFINITY, 0.0_f64), |(a, b), w| (a.min(w), b.max(w)));
    if high == 0.0 {
        return Ok(Vec::new());
    }
    let (low, high) = ((low / 100.0).ln(), (high * 100.0).ln());
    let last = points.saturating_sub(1).max(1) as f64;
    let at = |k: usize| {
        let w = (low + (high - low) * k as f64 / last).exp();
        let z = ratio.at_frequency(w);
        (w, z.re - 0.5, z.im)
    };
    Ok((0..points).map(at).collect())
}
