//! Errors of a search.

use greybox::Names;

/// Error of a search.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The data or the noise model.
    #[error(transparent)]
    Signals(#[from] ct_signals::Error),
    /// The fit.
    #[error(transparent)]
    Fit(#[from] greybox::Error),
    /// Least squares.
    #[error(transparent)]
    Estimation(#[from] estimation::Error),
    /// A candidate of the user's own.
    #[error("candidates.{0}")]
    Own(#[from] ct_model::effects::OwnError),
    /// Effects that exclude each other.
    #[error(transparent)]
    Apply(#[from] ct_model::effects::ApplyError),
    /// The simulation of the fitted model.
    #[error(transparent)]
    Simulation(#[from] ct_model::NoSolution),
    /// An experiment that cannot be proposed.
    #[error(transparent)]
    Design(#[from] crate::design::NoExperiment),
    /// The unit of the model's time is not positive.
    #[error("a unit of the model's time of {seconds} s: it has to be above zero and finite")]
    TimeUnit {
        /// The given number of seconds.
        seconds: f64,
    },
    /// An effect of the model file that cannot act in the model.
    #[error("effect {id} cannot act in this model")]
    UnknownEffect {
        /// Identifier of the effect.
        id: String,
    },
    /// With an effect of the model file, the model cannot be simulated.
    #[error(
        "with {id} the simulation fails from every start of its parameters: give its parameters better start values, or remove it"
    )]
    NoStart {
        /// Identifier of the effect.
        id: String,
    },
}

impl Error {
    /// The message with the caller's names for what it has to change.
    #[must_use]
    pub fn worded(&self, names: &Names) -> String {
        match self {
            Self::Signals(error) => error.worded(&names.records),
            Self::Fit(error) => error.worded(names),
            Self::Estimation(error) => error.worded(&names.records, names.known),
            Self::Own(_)
            | Self::Apply(_)
            | Self::Simulation(_)
            | Self::Design(_)
            | Self::TimeUnit { .. }
            | Self::UnknownEffect { .. }
            | Self::NoStart { .. } => self.to_string(),
        }
    }
}
