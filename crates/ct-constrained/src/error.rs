//! Errors of constraints: each message contains the numbers that disagree and the correction.

/// All errors of this crate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An error of the recursive least-squares estimator inside.
    #[error(transparent)]
    Rls(#[from] ct_rls::Error),
    /// The weights of the data are not those of least squares, so constraints would bias the estimates.
    #[error(
        "gamma is {gamma} with c = {c}, but with constraints the criterion is minimised only for gamma = c; take gamma = {c}, or with_free_gamma, which minimises no criterion"
    )]
    GammaNotWeight {
        /// Gain of the Riccati equation.
        gamma: f64,
        /// Weight of the output error.
        c: f64,
    },
    /// A row's gamma is not its weight, so that the criterion would not be minimised.
    #[error(
        "gamma of the row is {gamma} with the weight {weight}, but the criterion is minimised only for gamma = {weight}; take that, or with_free_gamma, which minimises no criterion"
    )]
    RowGammaNotWeight {
        /// The row's entry of Gamma.
        gamma: f64,
        /// Weight of the row.
        weight: f64,
    },
    /// A value of gamma with which the Lyapunov function could grow.
    #[error(
        "gamma of the row is {gamma} with the weight {weight}, but must be at least 0 and below twice the weight, {}, or the Lyapunov function can grow", 2.0 * weight
    )]
    Gamma {
        /// The value that was given.
        gamma: f64,
        /// The row's weight.
        weight: f64,
    },
    /// An inequality row with a gamma.
    #[error(
        "gamma of an inequality row is {gamma}, but must be 0: with another the Lyapunov function can grow, and dQ/dt is discontinuous at every crossing"
    )]
    PenaltyGamma {
        /// The value that was given.
        gamma: f64,
    },
    /// A coefficient, the right-hand side or the violation of a row is not finite.
    #[error("{what} of the row is {value}, but must be finite")]
    NotFinite {
        /// `a coefficient`, `chi` or `the violation`.
        what: &'static str,
        /// The value that was given.
        value: f64,
    },
    /// The row is beyond the range of the estimator.
    #[error(
        "{what} of the row is {value:e}, but must be at most {limit:e}; divide f and chi by the same number, or choose other units"
    )]
    TooLarge {
        /// `the length of f` or `chi`.
        what: &'static str,
        /// Value of the coefficient.
        value: f64,
        /// The largest that is taken.
        limit: f64,
    },
    /// The weight of a row is negative or not finite.
    #[error(
        "the weight of the row is {weight}, but must be at least 0 and finite; take 0 to switch the row off"
    )]
    Weight {
        /// The value that was given.
        weight: f64,
    },
    /// A time constant or a step of a filter that is not above 0.
    #[error("{what} of the filter is {value} s, but must be above 0 and finite")]
    FilterTime {
        /// `the time constant` or `the step`.
        what: &'static str,
        /// The value that was given.
        value: f64,
    },
    /// The row does not exist.
    #[error("row {index} does not exist: there are {rows} rows, counted from 0")]
    NoSuchRow {
        /// The index that was given.
        index: usize,
        /// Number of rows.
        rows: usize,
    },
    /// The lower bound of a parameter is above the upper one, or a bound is NaN.
    #[error(
        "parameter {index} is bounded below by {lower} and above by {upper}; the lower bound must not be above the upper one"
    )]
    Bounds {
        /// Index of the parameter, from 0.
        index: usize,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// The projection found no point that obeys all rows.
    #[error(
        "no estimate satisfies all rows: row {row} is violated by {violation} where the others are satisfied; drop a row that contradicts the others, or one of two that are nearly parallel"
    )]
    NoCommonPoint {
        /// The row, from 0; of a box, the parameter.
        row: usize,
        /// Violation, in the unit of chi.
        violation: f64,
    },
}
