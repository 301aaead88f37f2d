//! Errors of settings and runs: each message contains the numbers that disagree and the correction.

use crate::outcome::Outcome;

/// All errors of this crate, and the reasons why a run has stopped.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// `c` is no positive number, or above 1e40.
    #[error(
        "c is {c}, but the weight of the output error must be above 0 and at most 1e40; take 1 where nothing else is known"
    )]
    Weight {
        /// The value that was given.
        c: f64,
    },
    /// `gamma` lies outside `0 <= gamma < 2 c`, where the Lyapunov function need not decrease.
    #[error(
        "gamma is {gamma} with c = {c}, but estimates converge only for 0 <= gamma < 2 c = {}; take gamma = c", 2.0 * c
    )]
    Gamma {
        /// The value that was given.
        gamma: f64,
        /// The weight of the output error.
        c: f64,
    },
    /// `eta` is negative or not finite.
    #[error(
        "eta is {eta} 1/s, but the forgetting rate must be at least 0 and finite; take 0 for no forgetting, or the inverse of the memory in seconds"
    )]
    Forgetting {
        /// The value that was given, 1/s.
        eta: f64,
    },
    /// A forgetting factor per step outside (0, 1], or its step not above 0.
    #[error(
        "lambda is {lambda} over a step of {dt} s, but a forgetting factor has to be above 0 and at most 1, and a step above 0; take for example 0.98"
    )]
    Lambda {
        /// Forgetting factor per step, no unit.
        lambda: f64,
        /// The step, s.
        dt: f64,
    },
    /// `P(0)` is not symmetric.
    #[error(
        "P(0) is not symmetric: entry ({row}, {column}) is {above} and entry ({column}, {row}) is {below}; give one value to both"
    )]
    NotSymmetric {
        /// Row of the entry above the diagonal, from 0.
        row: usize,
        /// Column of that entry, from 0.
        column: usize,
        /// The entry above the diagonal.
        above: f64,
        /// The entry below it.
        below: f64,
    },
    /// `P(0)` is not positive definite, within rounding.
    #[error(
        "P(0) is not positive definite: pivot {index} is {pivot} where the diagonal is {diagonal}; use a diagonal of 10 to 1000 times the squared size of each parameter"
    )]
    NotPositiveDefinite {
        /// Index of the pivot of `P = U D U'`, from 0.
        index: usize,
        /// Value of the pivot; it has to exceed the rounding error of the diagonal.
        pivot: f64,
        /// The diagonal entry of `P(0)` in the same place.
        diagonal: f64,
    },
    /// An entry of `theta(0)` is not finite.
    #[error("theta(0)[{index}] is {value}; take 0 where nothing is known")]
    Theta {
        /// Index of the parameter, from 0.
        index: usize,
        /// The value that was given.
        value: f64,
    },
    /// An intensity of the random walk is negative, not finite, or above 1e60.
    #[error(
        "the intensity of parameter {index} is {value}, but must be at least 0 and at most 1e60, in its unit squared per second; take 0 for a constant parameter"
    )]
    Intensity {
        /// Which parameter, from 0.
        index: usize,
        /// The value that was given.
        value: f64,
    },
    /// A guard's setting is not a number in its range.
    #[error("{guard} is {value}, but must be {range}")]
    Guard {
        /// `trace_limit` or `silent_below`.
        guard: &'static str,
        /// The value that was given.
        value: f64,
        /// The allowed range.
        range: &'static str,
    },
    /// `P(0)` is above the cap on its own trace.
    #[error(
        "the trace of P(0) is {trace}, above trace_limit = {limit}; raise the limit or lower P(0)"
    )]
    TraceAboveLimit {
        /// Trace of `P(0)`.
        trace: f64,
        /// The cap.
        limit: f64,
    },
    /// `theta(0)`, `P(0)` and the regressor have different sizes (run-time sizes only).
    #[error(
        "{what} has {found} entries a side, but {expected} parameters are estimated; give it that size"
    )]
    Size {
        /// The quantity with the wrong size.
        what: &'static str,
        /// Actual size.
        found: usize,
        /// The number of parameters.
        expected: usize,
    },
    /// A sample that was not used; the estimates are as before it.
    #[error("the sample was refused and changed nothing: {}", outcome.reason())]
    Refused {
        /// Why.
        outcome: Outcome,
    },
    /// A step of Euler's rule too long for the gain: `P` would have lost its definiteness. The estimates from before that step are kept.
    #[error(
        "Euler's rule stopped: gamma h phi'P phi is {gain} but must stay below 1 + eta h = {limit} to keep P positive definite; use ExactHold, shorten the step of {dt} s, or lower P(0)"
    )]
    EulerLimit {
        /// `gamma h phi' P phi`, no unit.
        gain: f64,
        /// `1 + eta h`, no unit.
        limit: f64,
        /// The step, s.
        dt: f64,
    },
    /// `P` is no longer positive definite, because of a long step or of rounding. The estimates before the step are kept.
    #[error(
        "{integrator} stopped: pivot {index} of P became {pivot} over a step of {dt} s; use ExactHold, shorten the step, or lower P(0)"
    )]
    LostDefiniteness {
        /// Name of the integrator.
        integrator: &'static str,
        /// Index of the pivot of `P = U D U'`, from 0.
        index: usize,
        /// Its value.
        pivot: f64,
        /// The step, s.
        dt: f64,
    },
}
