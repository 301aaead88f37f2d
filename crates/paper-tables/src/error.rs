//! Errors of the computation of the tables: each message names the argument, the numbers that disagree and the correction, in one line.

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Too few runs for the 5 to 95 % range of [`udink::study`](crate::udink::study).
    #[error("runs is {runs}, but the 5 to 95 % range needs {fewest} or more; 200 is usual")]
    TooFewRunsForRange {
        /// Runs that were asked for.
        runs: usize,
        /// [`udink::FEWEST`](crate::udink::FEWEST).
        fewest: usize,
    },
    /// Too few runs for the variances of [`baysse::study`](crate::baysse::study).
    #[error("runs is {runs}, but variances need {fewest} or more")]
    TooFewRunsForVariance {
        /// Runs that were asked for.
        runs: usize,
        /// [`baysse::FEWEST`](crate::baysse::FEWEST).
        fewest: usize,
    },
    /// A noise with too few values for the run.
    #[error("the noise has {values} values, but the run needs {needed}; draw as many")]
    ShortNoise {
        /// Values that were given.
        values: usize,
        /// Number of values that are needed: the steps of the run plus one.
        needed: usize,
    },
    /// Steps over which the error is differenced.
    #[error("the span of the differences is {span} steps, but can be 3 or 5")]
    Span {
        /// [`Settings::span`](crate::udink::Settings::span) as it was given.
        span: usize,
    },
    /// A reference signal that `ct-signals` refuses.
    #[error(transparent)]
    Signals(#[from] ct_signals::Error),
    /// A tank that `plants` refuses.
    #[error(transparent)]
    Plant(#[from] plants::Error),
    /// A recursive estimator with invalid settings.
    #[error(transparent)]
    Estimator(#[from] stabilized_oe::Error),
    /// A filter that `ct-lti` refuses.
    #[error(transparent)]
    Linear(#[from] ct_lti::Error),
    /// A loop, or a fit to it.
    #[error(transparent)]
    Loop(#[from] fcloe::Error),
}

impl From<ct_rls::Error> for Error {
    fn from(error: ct_rls::Error) -> Self {
        Self::Estimator(error.into())
    }
}

impl From<ct_constrained::Error> for Error {
    fn from(error: ct_constrained::Error) -> Self {
        Self::Estimator(error.into())
    }
}
