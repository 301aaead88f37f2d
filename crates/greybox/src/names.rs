//! How messages name what a caller gave.

/// Names, in messages, of what a caller may change in a fit.
///
/// [`Display`](std::fmt::Display) of an error has [`Names::LIBRARY`]; a program or a binding hands its own names to
/// [`Error::worded`](crate::Error::worded).
#[derive(Debug, Clone, Copy)]
pub struct Names {
    /// Names in errors of the records.
    pub records: ct_signals::Names,
    /// Names in errors of the plant.
    pub plants: plants::Names,
    /// Where the constants of a model are given, after "the constants" and with a blank; empty for nothing.
    pub known: &'static str,
    /// The prior of a parameter.
    pub prior: fn(parameter: &str) -> String,
    /// How a record gets its reference, as a clause.
    pub reference: &'static str,
    /// The setting by which a command is linear between samples.
    pub straight: &'static str,
    /// How a command is held, or the controller left out, as a clause.
    pub held: &'static str,
}

impl Names {
    /// Names of this crate.
    pub const LIBRARY: Self = Self {
        records: ct_signals::Names::LIBRARY,
        plants: plants::Names::LIBRARY,
        known: "",
        prior: |parameter| format!("prior of {parameter}"),
        reference: "put it into `Record::references`",
        straight: "`Hold::First`",
        held: "take `Hold::Zero`, or leave out the controller",
    };
}
