//! What can go wrong in a diagnosis.

/// What can go wrong in a diagnosis.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The data or the noise model.
    #[error(transparent)]
    Signals(#[from] ct_signals::Error),
    /// The plant or an effect.
    #[error(transparent)]
    Structure(#[from] plants::Error),
    /// The fit.
    #[error(transparent)]
    Fit(#[from] greybox::Error),
}
