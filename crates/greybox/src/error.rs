//! Errors of a fit.

use crate::Names;

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
    /// A parameter that the structure does not have.
    #[error("no parameter `{name}` in this model: it has {known}")]
    UnknownParameter {
        /// The name that was given.
        name: String,
        /// Names of the parameters.
        known: String,
    },
    /// A prior is not a finite number with a positive standard error within the bounds.
    #[error("{}", self.worded(&Names::LIBRARY))]
    Prior {
        /// The parameter.
        name: String,
        /// The value.
        value: f64,
        /// Standard error of the prior.
        std_error: f64,
        /// Smallest value of the fit.
        lower: f64,
        /// The largest.
        upper: f64,
    },
    /// A record has another number of outputs than the structure.
    #[error(
        "{record}: it has {given} outputs, but the model has {needed}: name as many columns as there are measured levels"
    )]
    Outputs {
        /// The record.
        record: String,
        /// Number in the record.
        given: usize,
        /// Number in the model.
        needed: usize,
    },
    /// A controller drives an input or reads an output that the model does not have.
    #[error(
        "a controller drives input {input} and reads output {output}, counted from 0: the model has not both of them"
    )]
    LoopSignals {
        /// The input.
        input: usize,
        /// The output.
        output: usize,
    },
    /// A controller reads an output that its command changes at once.
    #[error(
        "the loop cannot be simulated: {output} depends on {input} without a state in between, and the controller of {input} reads it"
    )]
    DirectTerm {
        /// The output.
        output: String,
        /// The input.
        input: String,
    },
    /// A record has another number of inputs than the model.
    #[error(
        "{record}: it has {given} inputs, but the model has {needed}: name a column for each of them"
    )]
    Inputs {
        /// The record.
        record: String,
        /// Number in the record.
        given: usize,
        /// Number in the model.
        needed: usize,
    },
    /// The least-squares problem has no solution.
    #[error(transparent)]
    Estimation(#[from] estimation::Error),
    /// Cancelled by [`Setup::stop`](crate::Setup::stop).
    #[error("stopped before it was done")]
    Stopped,
    /// The loop cannot be simulated without its reference.
    #[error("{}", self.worded(&Names::LIBRARY))]
    NoReference {
        /// The record.
        record: String,
    },
    /// The reference is constant.
    #[error(
        "{record}: the reference stays at {value}, so that nothing but noise moves the loop: take a record in which the set point changes"
    )]
    ConstantReference {
        /// The record.
        record: String,
        /// Constant value of the reference.
        value: f64,
    },
    /// A controller's command is held from sample to sample.
    #[error("{}", self.worded(&Names::LIBRARY))]
    CommandNotHeld {
        /// The record.
        record: String,
    },
}

impl Error {
    /// The message with the caller's names for what it has to change.
    #[must_use]
    pub fn worded(&self, names: &Names) -> String {
        match self {
            Self::Record(error) => error.worded(&names.records),
            Self::Structure(error) => error.worded(&names.plants),
            Self::Estimation(error) => error.worded(&names.records, names.known),
            Self::Prior {
                name,
                value,
                std_error,
                lower,
                upper,
            } => format!(
                "{} = [{value:?}, {std_error:?}]: the parameter lies between {lower:?} and {upper:?}; give a value there and a standard error above zero, in its unit",
                (names.prior)(name)
            ),
            Self::NoReference { record } => format!(
                "{record}: the record has no reference, which the controller needs: {}",
                names.reference
            ),
            Self::CommandNotHeld { record } => format!(
                "{record}: {} says that the command is linear between samples, but a controller holds it constant: {}",
                names.straight, names.held
            ),
            // These name nothing of the caller's.
            Self::NoRecord
            | Self::UnknownParameter { .. }
            | Self::Outputs { .. }
            | Self::LoopSignals { .. }
            | Self::DirectTerm { .. }
            | Self::Inputs { .. }
            | Self::Stopped
            | Self::ConstantReference { .. } => self.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NoFit;

    /// Every message that names something of the caller's.
    fn messages() -> [Error; 4] {
        [
            Error::Estimation(NoFit::NoFiniteStart { starts: 12 }),
            Error::Prior {
                name: "k".into(),
                value: 1.0,
                std_error: -1.0,
                lower: 0.0,
                upper: 2.0,
            },
            Error::NoReference {
                record: "a.csv".into(),
            },
            Error::CommandNotHeld {
                record: "a.csv".into(),
            },
        ]
    }

    /// A caller of the library has neither options nor a model file.
    #[test]
    fn by_themselves_messages_name_items_of_the_library() {
        for error in messages() {
            let said = error.to_string();
            let of_the_program = [
                "--",
                "hold =",
                "[columns]",
                "[known]",
                "[prior]",
                "[controller",
            ];
            assert!(!of_the_program.iter().any(|s| said.contains(s)), "{said}");
            assert_eq!(said, error.worded(&Names::LIBRARY));
        }
    }

    #[test]
    fn messages_have_the_names_of_the_caller() {
        let names = Names {
            known: " <known>",
            prior: |parameter| format!("<prior {parameter}>"),
            reference: "<reference>",
            straight: "<straight>",
            held: "<held>",
            ..Names::LIBRARY
        };
        let own = [
            "<known>",
            "<prior k> = [1.0, -1.0]",
            "<reference>",
            "<straight> says that the command is linear between samples, but a controller holds it constant: <held>",
        ];
        for (error, own) in messages().iter().zip(own) {
            assert!(error.worded(&names).contains(own), "{error}");
        }
    }
}
