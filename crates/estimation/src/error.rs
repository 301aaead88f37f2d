//! Errors of a fit.

/// Error of a fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A series cannot be used.
    #[error(transparent)]
    Series(#[from] ct_signals::Error),
    /// No start gave a finite simulation.
    #[error(
        "none of {starts} starts gave a finite simulation: check the units of the data and the constants under [known]"
    )]
    NoFiniteStart {
        /// Number of starts.
        starts: usize,
    },
}
