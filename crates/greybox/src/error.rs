//! What can go wrong in a fit.

/// What can go wrong in a fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A record cannot be used.
    #[error(transparent)]
    Record(#[from] ct_signals::Error),
    /// The structure cannot be simulated.
    #[error(transparent)]
    Structure(#[from] plants::Error),
    /// No record was given.
    #[error("no record to fit: give at least one")]
    NoRecord,
    /// A parameter is named that the structure does not have.
    #[error("no parameter `{name}` in this model: it has {known}")]
    UnknownParameter {
        /// The name that was given.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// No start led anywhere.
    #[error(
        "none of {starts} starts gave a finite simulation: check the units of the data and the constants under [known]"
    )]
    NoFiniteStart {
        /// How many were tried.
        starts: usize,
    },
}
