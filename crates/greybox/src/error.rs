//! Errors of a fit.

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
    #[error(
        "[prior] {name} = [{value:?}, {std_error:?}]: the parameter lies between {lower:?} and {upper:?}; give a value there and a standard error above zero, in its unit"
    )]
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
    #[error(
        "{record}: the record holds no reference, which a controller follows: name its column as reference in the model file, under [columns] or, for a model of your own, under its [controller.INPUT]"
    )]
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
    #[error(
        "{record}: hold = \"first\" says that the command runs in straight lines, but a controller holds it: write hold = \"zero\", or delete [controller]"
    )]
    CommandNotHeld {
        /// The record.
        record: String,
    },
}
