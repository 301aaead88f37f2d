//! Interface of every recursive estimator.

use crate::Error;
use crate::outcome::Outcome;

/// A recursive estimator of `theta` in `y = theta' phi`, or of something that contains it.
pub trait RecursiveEstimator {
    /// One sample of the signals.
    type Sample;
    /// The estimates.
    type Theta: ?Sized;
    /// Type of the covariance matrix.
    type Covariance;
    /// Reason why a run has stopped.
    type Error;

    /// Advances the estimates by `dt` seconds (above 0) over which `sample` is held.
    ///
    /// Never panics and never spoils the estimates: a sample that cannot be used leaves them as they are,
    /// and [`Innovation::outcome`] says why.
    fn update(&mut self, sample: &Self::Sample, dt: f64) -> Innovation;

    /// The estimates, in the order of the regressor.
    fn theta(&self) -> &Self::Theta;

    /// The matrix `P`, symmetric.
    fn covariance(&self) -> Self::Covariance;

    /// State of the estimator. The call solves an eigenvalue problem: use it only now and then.
    ///
    /// # Errors
    /// Why the run has stopped, where it has.
    fn health(&self) -> Result<Health, Self::Error>;
}

/// Result of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Innovation {
    /// `eps = y - theta^' phi` before the update, unit of y.
    pub epsilon: f64,
    /// `s = phi' P phi` before the update; a value of `gamma h s` above 1 means a large update.
    pub s: f64,
    /// Whether and how the sample was used.
    pub outcome: Outcome,
}

impl Innovation {
    /// The innovation if the sample was used; the reason as an error if it was rejected, for `?`.
    ///
    /// # Errors
    /// [`Error::Refused`]; the estimates are as before the sample.
    pub fn accepted(self) -> Result<Self, Error> {
        if self.outcome.used() {
            Ok(self)
        } else {
            Err(Error::Refused {
                outcome: self.outcome,
            })
        }
    }

    pub(crate) fn unused(epsilon: f64, outcome: Outcome) -> Self {
        Self {
            epsilon,
            s: f64::NAN,
            outcome,
        }
    }
}

/// Numerical state of an estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Health {
    /// Smallest eigenvalue of the information matrix `P^-1`, unit of `1/theta^2`: the information on the least well determined combination
    /// of parameters. With persistent excitation it stays above a positive bound.
    pub excitation: f64,
    /// Smallest pivot of `P = U D U'`, unit of `theta^2`: above 0 where `P` is positive definite.
    pub smallest_pivot: f64,
    /// Trace of `P`, unit of `theta^2`; it grows as `e^{eta t}` in wind-up.
    pub trace: f64,
    /// Samples used since the start.
    pub used: u64,
    /// Samples that could not be used since the start.
    pub unused: u64,
    /// Steps in which the cap on the trace limited forgetting, since the start.
    pub capped: u64,
    /// Steps without forgetting because the regressor was silent, since the start.
    pub silent: u64,
}
