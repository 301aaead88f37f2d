//! State variable filters: a filtered signal and its derivatives, without numerical differentiation.
//!
//! Model: with a Hurwitz polynomial E of degree n, `x_f = E(0)/E(p) x`, and `p^i x_f` for i = 0 to n. For
//! `E = (p + lambda)^n` this is the filter `lambda^n/(p + lambda)^n`.
//!
//! Why: a model `A(p) y = B(p) u` holds for the filtered signals as it does for the signals themselves, `A y_f = B u_f`,
//! if both go through the same E (Baysse, Carrillo, Habbadi, (22), (23) for order one). The derivatives of y_f and u_f are available,
//! while those of y and u are not.
//!
//! Equations: states `z[i] = p^i x_f` for i < n in controllable canonical form, and the highest derivative from the
//! filter's own equation, `p^n x_f = (E(0) (x - z[0]) - sum_{i >= 1} e[i] z[i])/e[n]`.
//!
//! Accuracy: sampled exactly under the hold, so exact for a signal that is held or runs on lines. For a measured,
//! smooth one use [`Hold::First`]: the error is that of the line between samples and falls with the square of the
//! step. **Use the same E for all signals of a regression, but for each the hold it has.** A held input that is treated as linear, or the
//! reverse, is shifted by half a step.
//!
//! Choice of lambda: 2 to 10 times the bandwidth of what is identified; a lower value suppresses the fast dynamics, a
//! higher one passes noise, by `lambda^i` in the i-th derivative.
//!
//! Cost: n^2 products a sample, 20 to 30 ns for n = 2 to 6; a new step 0.6 to 3 us. Nothing is allocated after
//! construction.

#[cfg(feature = "serde")]
mod saved;

use alloc::{vec, vec::Vec};

use crate::error::finite;
use crate::sampling::{OUT_OF_RANGE, Sampler};
use crate::{Error, Hold, Polynomial, Start, StateSpace, TransferFunction};

/// Gives a filtered signal and its derivatives, 0 to n, at each sample.
///
/// ```
/// use ct_lti::{Hold, StateVariableFilter};
///
/// // 1/(1 + p/2)^2 of a ramp: a ramp again, later by the two time constants of 1/2.
/// let mut filter = StateVariableFilter::with_bandwidth(2, 2.0, Hold::First)?;
/// let mut time = 0.0;
/// filter.update(3.0 * time, 0.0)?;
/// for step in [0.5, 1.0, 0.7].into_iter().cycle().take(60) {
///     time += step;
///     filter.update(3.0 * time, step)?;
/// }
/// let [value, slope, curvature] = filter.derivatives() else { unreachable!() };
/// assert!((value - 3.0 * (time - 1.0)).abs() < 1e-12);
/// assert!((slope - 3.0).abs() < 1e-12 && curvature.abs() < 1e-12);
/// # Ok::<(), ct_lti::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct StateVariableFilter {
    denominator: Polynomial,
    sampler: Sampler,
    start: Start,
    input: Option<f64>,
    /// `p^i x_f` for i = 0 to n; the first n are the states.
    derivatives: Vec<f64>,
}

impl StateVariableFilter {
    /// `E(0)/E(p)`, for any Hurwitz polynomial E of degree 1 or more; its scale does not matter. It starts from zero,
    /// see [`StateVariableFilter::starting`].
    ///
    /// # Errors
    /// [`Error::Order`] for a constant, [`Error::NotHurwitz`], [`Error::Overflow`].
    pub fn new(denominator: &Polynomial, hold: Hold) -> Result<Self, Error> {
        let what = "the denominator of a state variable filter";
        let denominator = denominator.clone().checked(what)?;
        let n = match denominator.degree() {
            Some(n) if n > 0 => n,
            _ => {
                return Err(Error::Order {
                    what,
                    needed: 1,
                    found: 0,
                });
            }
        };
        if !denominator.is_hurwitz() {
            let rightmost = denominator.roots()?.last().map_or(0.0, |z| z.re);
            return Err(Error::NotHurwitz {
                what,
                real_part: rightmost,
            });
        }
        let dc = Polynomial::from(denominator.coefficient(0));
        let system = StateSpace::controllable(&TransferFunction::new(dc, denominator.clone())?)?;
        // The gain is applied to the input, so that the states are the derivatives themselves.
        let gain = denominator.coefficient(0) / denominator.leading();
        let b: Vec<f64> = system.b().iter().map(|b| b * gain).collect();
        Ok(Self {
            sampler: Sampler::new(system.a(), &b, hold),
            start: Start::Zero,
            input: None,
            derivatives: vec![0.0; n + 1],
            denominator,
        })
    }

    /// `lambda^order/(p + lambda)^order`, lambda in \[1/time\].
    ///
    /// # Errors
    /// [`Error::NotPositive`] for lambda, [`Error::Order`] for an order of 0, [`Error::Overflow`].
    pub fn with_bandwidth(order: usize, lambda: f64, hold: Hold) -> Result<Self, Error> {
        if !(lambda.is_finite() && lambda > 0.0) {
            return Err(Error::NotPositive {
                what: "the bandwidth lambda of a state variable filter",
                value: lambda,
            });
        }
        let factor = Polynomial::trimmed(vec![lambda, 1.0]);
        Self::new(&factor.pow(order), hold)
    }

    /// The same filter with the given past before its first sample.
    #[must_use]
    pub fn starting(mut self, start: Start) -> Self {
        self.start = start;
        self
    }

    /// n: the highest derivative that is given.
    pub fn order(&self) -> usize {
        self.derivatives.len() - 1
    }

    /// E.
    pub fn denominator(&self) -> &Polynomial {
        &self.denominator
    }

    /// Takes the signal at the next sample, `step` after the last one \[time\], and gives
    /// [`StateVariableFilter::derivatives`] there. The first sample only starts the filter: no step leads to it, and
    /// `step` is ignored.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::Step`], [`Error::Overflow`]. After an error everything is as before the call.
    pub fn update(&mut self, signal: f64, step: f64) -> Result<&[f64], Error> {
        finite("the signal", &[signal])?;
        let n = self.order();
        let e = self.denominator.coefficients();
        let (states, highest) = self.derivatives.split_at_mut(n);
        match self.input {
            Some(last) => self.sampler.advance(states, last, signal, step)?,
            None => {
                states.fill(0.0);
                states[0] = match self.start {
                    Start::Zero => 0.0,
                    Start::Rest => signal,
                };
            }
        }
        let rest: f64 = e[1..n].iter().zip(&states[1..]).map(|(e, z)| e * z).sum();
        let derivative = (e[0] * (signal - states[0]) - rest) / e[n];
        if !derivative.is_finite() {
            match self.input {
                Some(_) => self.sampler.undo(states),
                None => states.fill(0.0),
            }
            return Err(OUT_OF_RANGE);
        }
        highest[0] = derivative;
        self.input = Some(signal);
        Ok(&self.derivatives)
    }

    /// `p^i x_f` at the last sample, for i = 0 to n: n + 1 entries \[signal/time^i\]. Where the signal jumps, the
    /// highest is the one after the jump. All 0 before the first sample.
    pub fn derivatives(&self) -> &[f64] {
        &self.derivatives
    }

    /// Forgets all samples.
    pub fn reset(&mut self) {
        self.derivatives.fill(0.0);
        self.input = None;
    }
}
