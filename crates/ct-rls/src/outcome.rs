//! What an update did with its sample.

/// Outcome of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Outcome {
    /// The sample was used.
    Updated,
    /// The sample was used; the trace of `P` is at its cap, so less was forgotten. With [`Directional`](crate::Directional): the
    /// regressor is too weak for the cap, so nothing was forgotten.
    Capped,
    /// The regressor is silent: nothing was forgotten.
    Silent,
    /// A signal is not finite or too large: the regressor is above 1e30, an output error above 1e100; or a step of any rule but
    /// [`ExactHold`](crate::ExactHold) would, or might, overflow. The sample was not used.
    NotFinite,
    /// `dt` is outside `0 < dt <= 1e30` s, or `eta dt` is above 300: nothing was done.
    BadStep,
    /// The regressor has a wrong length (run-time sizes only): nothing was done.
    BadSize,
    /// The run has stopped; the health gives the reason. The sample was not used.
    Stopped,
}

impl Outcome {
    /// Whether the estimates took the sample in.
    pub fn used(self) -> bool {
        matches!(self, Self::Updated | Self::Capped | Self::Silent)
    }

    pub(crate) fn reason(self) -> &'static str {
        match self {
            Self::Updated | Self::Capped | Self::Silent => "it was used",
            Self::NotFinite => {
                "a signal is NaN, infinite or too large (the regressor is above 1e30, an output error above 1e100); leave it out"
            }
            Self::BadStep => {
                "its step dt must be above 0 and at most 1e30 s, and eta dt, with the forgetting rate eta, at most 300; check its time"
            }
            Self::BadSize => "its regressor needs one entry for each parameter",
            Self::Stopped => "the estimator has stopped before; health() gives the reason",
        }
    }
}
