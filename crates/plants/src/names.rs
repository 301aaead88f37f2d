//! How messages name what a caller gave.

/// Names, in messages, of what a caller may change in a plant and of where it finds the effects.
///
/// [`Display`](std::fmt::Display) of an error has [`Names::LIBRARY`]; a program or a binding hands its own names to
/// [`Error::worded`](crate::Error::worded).
#[derive(Debug, Clone, Copy)]
pub struct Names {
    /// A clause that says where the plants on which an effect acts are listed.
    pub plants_of: fn(effect: &str) -> String,
    /// Where the effects that the model may have are listed: in brackets after a blank, or empty.
    pub effects: &'static str,
    /// A clause that says how to give the command of the second pump.
    pub second_command: &'static str,
}

impl Names {
    /// Names of this crate.
    pub const LIBRARY: Self = Self {
        plants_of: |_| "`EffectInfo::sites` says where it acts".to_string(),
        effects: " (`Structure::candidates` lists them)",
        second_command: "give the range of its command, `Scales::input_2`",
    };
}
