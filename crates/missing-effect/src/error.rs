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
    /// The controller and the fitted plant do not make a stable loop.
    #[error(
        "controller: the loop of gain = {gain}, integral_time = {integral_time} s and the fitted plant is unstable (an oscillation or drift grows by {:.2} % a sample): check the sign and the unit of the gain, and that integral_time is in seconds",
        100.0 * (radius - 1.0)
    )]
    UnstableLoop {
        /// Proportional gain \[input/output\].
        gain: f64,
        /// Integral time \[s\].
        integral_time: f64,
        /// Largest magnitude of the sampled loop's eigenvalues.
        radius: f64,
    },
}
