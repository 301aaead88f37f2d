//! Errors of a monitor.

/// Reason why no monitor can be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The plant and its effects are incompatible.
    #[error(transparent)]
    Structure(#[from] plants::Error),
    /// An effect that is a function of the time since a record began.
    #[error(
        "{effect} is a function of the time since the record began, but a monitored plant has no such start time: remove it; the monitor searches for it itself"
    )]
    ByClock {
        /// The effect.
        effect: String,
    },
    /// A plant with two pumps.
    #[error(
        "plant {plant} has two pumps, but a row has one command only: the monitor supports plants with one pump"
    )]
    TwoPumps {
        /// The plant.
        plant: &'static str,
    },
    /// A measured disturbance in the model.
    #[error(
        "the model has a measured disturbance, and a row of the monitor has one input: delete the disturbance and its column"
    )]
    Disturbance,
    /// A user's own model that depends on time explicitly.
    #[error(
        "the model uses `time`, and a monitored plant has no start time: give what follows the clock as an input"
    )]
    Time,
    /// A user's own model without parameters that are fitted.
    #[error(
        "the model has no parameter that is fitted: declare one of them as `parameter`, so that it can be learned and tracked"
    )]
    NoParameters,
    /// A setting is outside its range.
    #[error("{setting} is {value}, but has to be {range}")]
    Setting {
        /// Name of the setting.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// Allowed range.
        range: &'static str,
    },
    /// A state from another version.
    #[error(
        "the state has version {found}, but this program reads version {known}: start without this state"
    )]
    Version {
        /// The version of the state.
        found: u32,
        /// The version that is read.
        known: u32,
    },
    /// A state of another model.
    #[error(
        "the state belongs to another model: {differences}; use another state file, or delete this one to start again"
    )]
    OtherModel {
        /// The differences, with the names of the model file.
        differences: String,
    },
    /// A state with inconsistent numbers.
    #[error("the state is damaged: {what}; delete it to start again")]
    Damaged {
        /// Inconsistency.
        what: String,
    },
}

/// Reason why a row or one of its readings is not used ([`RowResult::lost`](crate::RowResult::lost)). A row that is not used does not change the
/// monitor, except for the count of times that go back.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotUsed {
    /// A value is not finite.
    #[error("{value} is not a finite number")]
    NotFinite {
        /// `time`, `input` or `output`.
        column: &'static str,
        /// Index of the input or output, from zero.
        at: usize,
        /// The value.
        value: f64,
    },
    /// A value whose powers overflow.
    #[error("{value:e} is too large to compute with: below {limit:e}")]
    TooLarge {
        /// `time`, `input` or `output`.
        column: &'static str,
        /// Index of the input or output, from zero.
        at: usize,
        /// The value.
        value: f64,
        /// Limit of the absolute value.
        limit: f64,
    },
    /// A command far outside the range of this pump: simulated, it would make the model useless for hours.
    #[error("{value} is beyond the command's full range, input_range = {range}")]
    BeyondRange {
        /// The value.
        value: f64,
        /// The full range.
        range: f64,
    },
    /// A reading that a sensor of this tank cannot give, even with a large error.
    #[error("{value} is far above the tank, tank_height = {height}")]
    AboveTank {
        /// The value.
        value: f64,
        /// The height.
        height: f64,
    },
    /// The time of the row before.
    #[error("the time {time} s is repeated from the row before")]
    Repeated {
        /// The time \[s\].
        time: f64,
    },
    /// A time before that of the row before.
    #[error("the time goes back from {previous} s to {time} s")]
    Backward {
        /// The time \[s\].
        time: f64,
        /// The time before \[s\].
        previous: f64,
    },
}

impl NotUsed {
    /// Index of the input or output in question, from zero.
    #[must_use]
    pub fn at(&self) -> usize {
        match self {
            Self::NotFinite { at, .. } | Self::TooLarge { at, .. } => *at,
            _ => 0,
        }
    }

    /// Name of the column in question: `time`, `input` or `output`.
    #[must_use]
    pub fn column(&self) -> &'static str {
        match self {
            Self::NotFinite { column, .. } | Self::TooLarge { column, .. } => column,
            Self::BeyondRange { .. } => "input",
            Self::AboveTank { .. } => "output",
            Self::Repeated { .. } | Self::Backward { .. } => "time",
        }
    }
}
