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
    /// The simulation of the fitted model cannot go on.
    #[error("the simulation of the fitted model cannot go on")]
    NoSimulation,
    /// An experiment that cannot be proposed.
    #[error(transparent)]
    Design(#[from] crate::design::NoExperiment),
    /// The unit of the model's time is not positive.
    #[error("a unit of the model's time of {seconds} s: it has to be above zero and finite")]
    TimeUnit {
        /// The given number of seconds.
        seconds: f64,
    },
    /// The model is unstable and does not follow the records.
    #[error(
        "the model is unstable: a deviation grows by a factor of e in {growth_time:.3} s, and from the measured inputs {output} does not follow the record (error {error:.3e} {unit}, the readings vary by {varies:.3e} {unit}); cut the record into files of at most {longest:.3} s, in each of which the states begin anew"
    )]
    Unstable {
        /// The first output that does not follow.
        output: String,
        /// Unit of the output.
        unit: String,
        /// Root mean square of its error \[unit of the output\].
        error: f64,
        /// Standard deviation of its readings \[unit of the output\].
        varies: f64,
        /// Time in which a deviation grows by a factor of e \[s\].
        growth_time: f64,
        /// Length of records that can be simulated \[s\].
        longest: f64,
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
            | Self::NoSimulation
            | Self::Design(_)
            | Self::TimeUnit { .. }
            | Self::Unstable { .. }
            | Self::UnknownEffect { .. }
            | Self::NoStart { .. } => self.to_string(),
        }
    }
}
