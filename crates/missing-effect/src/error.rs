//! Errors of a diagnosis.

use greybox::Names;

/// Error of a diagnosis.
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
    /// An experiment that cannot be proposed.
    #[error(transparent)]
    Design(#[from] crate::design::NoExperiment),
    /// A record has other outputs than the first one.
    #[error(
        "{record}: output {output} is {column}, but in {first} it is {needed}: give every record the same outputs in the same order"
    )]
    OtherOutput {
        /// The record.
        record: String,
        /// Number of the output, from one.
        output: usize,
        /// The record's column, or that it is missing.
        column: String,
        /// The first record.
        first: String,
        /// The first record's column, or that it is missing.
        needed: String,
    },
    /// The controller reads an output that does not exist.
    #[error("controller: it reads output {output}, but the model has {outputs}: name one of these")]
    ControlledOutput {
        /// Number of the output, from one.
        output: usize,
        /// Number of outputs.
        outputs: usize,
    },
    /// The loop of the controller and the fitted plant is unstable.
    #[error(
        "controller: the loop of {controller} and the fitted plant is unstable (its output grows {} a sample): check the sign and the unit of the gain, and that integral_time is in seconds",
        growth(*radius)
    )]
    UnstableLoop {
        /// Settings of the controller, as [`plants::controller::Controller::describe`] writes them.
        controller: String,
        /// Largest magnitude of the sampled loop's eigenvalues.
        radius: f64,
    },
}

impl Error {
    /// The message with the caller's names for what it has to change.
    #[must_use]
    pub fn worded(&self, names: &Names) -> String {
        match self {
            Self::Signals(error) => error.worded(&names.records),
            Self::Structure(error) => error.worded(&names.plants),
            Self::Fit(error) => error.worded(names),
            Self::Design(_)
            | Self::OtherOutput { .. }
            | Self::ControlledOutput { .. }
            | Self::UnstableLoop { .. } => self.to_string(),
        }
    }
}

/// Growth from one sample to the next, in short words.
fn growth(radius: f64) -> String {
    if radius < 2.0 {
        format!("by {:.2} %", 100.0 * (radius - 1.0))
    } else if radius < 1000.0 {
        format!("{radius:.1} times")
    } else {
        "more than a thousand times".to_string()
    }
}
