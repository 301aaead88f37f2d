//! Errors of settings and runs: each message contains the numbers that disagree and the correction.

/// Errors of this crate, and the reasons why a run has stopped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Error of the estimator of one block.
    #[error(transparent)]
    Rls(#[from] ct_rls::Error),
    /// Error of the bounds.
    #[error(transparent)]
    Constrained(#[from] ct_constrained::Error),
    /// Error of a filter or of the check of positive realness.
    #[cfg(feature = "alloc")]
    #[error(transparent)]
    Lti(#[from] ct_lti::Error),
    /// The model to start from is not stable.
    #[error(
        "A^ = 1 + a_1 s + .. + a_n s^n to start from is not Hurwitz, a_n = {highest}: the model runs in parallel and must be stable; start from real poles, a = (1 + s T)^n, if nothing is known"
    )]
    StartNotHurwitz {
        /// The highest coefficient that was given.
        highest: f64,
    },
    /// An entry of a constant gain is out of range.
    #[error("c_lambda lambda[{index}] is {value}, but must be 0 to 1e40; 0 for none")]
    Lambda {
        /// Index of the entry of `(theta, c)`, from 0.
        index: usize,
        /// The value that was given.
        value: f64,
    },
    /// The blocks of a sum of gains have two values of `c_p`.
    #[error(
        "c is {theta} for theta and {filter} for the error filter, but a sum of gains has one c_p; put the ratio into P(0) and lambda"
    )]
    TwoGains {
        /// Weight of theta's block.
        theta: f64,
        /// Weight of the filter's block.
        filter: f64,
    },
    /// A row that contains no information about any parameter.
    #[error(
        "all coefficients of the row with chi = {chi} are 0, in theta and in c; give one that is not, or weight 0 to switch a row off"
    )]
    ZeroRow {
        /// Right-hand side of the row.
        chi: f64,
    },
    /// The estimates to start from lie outside their bounds.
    #[error("{what}(0)[{index}] is {value}, outside its bounds {lower} to {upper}; start inside")]
    StartOutside {
        /// `theta` or `c`.
        what: &'static str,
        /// Index of the entry, from 0.
        index: usize,
        /// The value that was given.
        value: f64,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// A state of the model that is not finite.
    #[error("the model's state {index} is {value}; give a finite one, 0 for rest")]
    ModelState {
        /// Index of the derivative of the output, from 0.
        index: usize,
        /// The value that was given.
        value: f64,
    },
    /// The model's output overflows. The estimates before the step are kept.
    #[error(
        "the model's output became {value} over a step of {dt} s; use ExactHold, shorten the step, or bound theta more closely"
    )]
    ModelDiverged {
        /// Value that was reached.
        value: f64,
        /// The step, s.
        dt: f64,
    },
    /// A box of plausible A0 in which a coefficient may be 0 or negative.
    #[error(
        "a_{index} of the plausible plants reaches from {lower} to {upper}, but must be above 0 throughout; no stable plant has another sign"
    )]
    Plausible {
        /// Index of the coefficient, from 1.
        index: usize,
        /// Lower end.
        lower: f64,
        /// Upper end.
        upper: f64,
    },
}
