//! Errors of records, structures and estimates: each message names the object, the numbers that disagree and the correction, in one line.

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An invalid polynomial or step.
    #[error(transparent)]
    Lti(#[from] ct_lti::Error),
    /// A series that `ct-signals` refuses.
    #[error(transparent)]
    Signals(#[from] ct_signals::Error),
    /// No record was given.
    #[error("no record is given; give at least one")]
    NoRecord,
    /// n = 0.
    #[error("the plant has order n = 0; a plant needs at least one pole, n >= 1")]
    OrderZero,
    /// B of a larger degree than A.
    #[error("B of input {input} has degree {m} over A of degree {n}; choose m of at most {n}")]
    Improper {
        /// Number of the input, from 1.
        input: usize,
        /// Degree of A.
        n: usize,
        /// Degree of B.
        m: usize,
    },
    /// A structure without inputs.
    #[error("the structure has no input; give a degree m of B for each input")]
    NoInput,
    /// Vectors that should be of one length.
    #[error("{record}: {what} has {found} entries, but {expected} are needed")]
    Length {
        /// Name of the record.
        record: String,
        /// What was given.
        what: String,
        /// Entries that are needed.
        expected: usize,
        /// Entries that were given.
        found: usize,
    },
    /// A number that is none.
    #[error(
        "{record}: {what} is {value} at sample {index}; leave the sample out, or give a number"
    )]
    NotFinite {
        /// Name of the record.
        record: String,
        /// The signal in question.
        what: String,
        /// Index of the sample, from 0.
        index: usize,
        /// What was found.
        value: f64,
    },
    /// An output without any reading.
    #[error(
        "{record}: the output has no measured samples; give a part of the record that has some, or leave out the record"
    )]
    NoReading {
        /// Name of the record.
        record: String,
    },
    /// Times that do not rise.
    #[error("{record}: time goes from {before} to {after} at sample {index}; times have to rise")]
    Time {
        /// Name of the record.
        record: String,
        /// Index of the sample, from 0.
        index: usize,
        /// The time before.
        before: f64,
        /// The time at this sample.
        after: f64,
    },
    /// A setting outside its range.
    #[error("{what} is {value}, but must be {range}")]
    Setting {
        /// Name of the setting.
        what: &'static str,
        /// What was given.
        value: f64,
        /// Allowed range.
        range: &'static str,
    },
    /// A delay that leaves too few samples of a record.
    #[error(
        "{record}: a delay of up to {delay:?} leaves {left} of {samples} samples whose input is known, and {needed} are needed for {parameters} parameters; give a longer record, or a smaller largest delay"
    )]
    DelayTooLong {
        /// Name of the record.
        record: String,
        /// The largest delay.
        delay: f64,
        /// Samples after it.
        left: usize,
        /// Samples in the record.
        samples: usize,
        /// Samples that are needed.
        needed: usize,
        /// Number of parameters.
        parameters: usize,
    },
    /// A record that is too short by itself.
    #[error(
        "{record}: {samples} samples{} are too few, and at least {needed} are needed; leave the record out, or lower the orders",
        without(*.missing)
    )]
    TooShortRecord {
        /// Name of the record.
        record: String,
        /// Samples in it, missing readings of the output aside.
        samples: usize,
        /// Readings that are missing.
        missing: usize,
        /// Samples that are needed.
        needed: usize,
    },
    /// A B without coefficients.
    #[error("B of input {input} has no coefficient; give at least b_0")]
    NoNumerator {
        /// Number of the input, from 1.
        input: usize,
    },
    /// Too few samples.
    #[error(
        "{samples} samples{} are too few for {parameters} parameters: at least {needed} are needed; lower the orders, or give more",
        without(*.missing)
    )]
    TooShort {
        /// Samples in all records, missing readings of the output aside.
        samples: usize,
        /// Readings that are missing.
        missing: usize,
        /// Samples that are needed.
        needed: usize,
        /// Number of parameters.
        parameters: usize,
    },
    /// A delay together with a direct term.
    #[error(
        "the delay of input {input} cannot be estimated with m = n = {n}: the output would be discontinuous in the delay; choose m of at most {most}"
    )]
    DelayOfDirectTerm {
        /// Number of the input, from 1.
        input: usize,
        /// Degree of A and B.
        n: usize,
        /// Largest m.
        most: usize,
    },
    /// A signal that is constant.
    #[error(
        "{what} is constant at {value} in all records, so that nothing can be identified from it; record at least a step up and a step down"
    )]
    Constant {
        /// Name of the signal.
        what: String,
        /// Constant value of the signal.
        value: f64,
    },
    /// Unequal steps for a method that counts samples.
    #[error(
        "{record}: the times leave an even grid at sample {index}, with a step of {step} where the mean is {expected}; {what} counts in samples: resample the record, or take SRIVC in open loop"
    )]
    Uneven {
        /// Name of the record.
        record: String,
        /// Index of the sample, from 0.
        index: usize,
        /// The step to it.
        step: f64,
        /// The mean step.
        expected: f64,
        /// Method that needs even steps.
        what: &'static str,
    },
    /// A record in a loop together with one that is not.
    #[error(
        "{record}: this record has {found} that changes, and the first one has {first}; give all records of a loop their reference, or none"
    )]
    MixedLoops {
        /// Name of the record.
        record: String,
        /// Property of this record.
        found: &'static str,
        /// Property of the first record.
        first: &'static str,
    },
    /// No model of the input as a function of the reference was found.
    #[error(
        "{record}: {samples} samples give no stable model of the input from the reference, and without it there are no instruments in a loop; give at least {needed}, and a reference that changes often"
    )]
    NoLoopModel {
        /// Name of the record.
        record: String,
        /// Samples in it.
        samples: usize,
        /// Samples that the smallest model needs.
        needed: usize,
    },
    /// Equations without one solution.
    #[error(
        "{samples} samples do not determine {parameters} parameters: some have the same effect on the output; lower the orders, or move the inputs more"
    )]
    NotDetermined {
        /// Number of parameters.
        parameters: usize,
        /// Samples in all records.
        samples: usize,
    },
    /// A simulation that is not finite.
    #[error("{record}: the model diverges when it is simulated on its inputs alone")]
    Diverges {
        /// Name of the record.
        record: String,
    },
    /// No start gave a stable plant.
    #[error(
        "none of {tried} bandwidths of the first filter led to a stable plant; lower the orders, move the inputs more, or give another bandwidth"
    )]
    NoStart {
        /// Number of starts.
        tried: usize,
    },
}

/// Text about missing readings.
fn without(missing: usize) -> String {
    match missing {
        0 => String::new(),
        1 => " besides one whose reading is missing".to_owned(),
        missing => format!(" besides {missing} whose reading is missing"),
    }
}
