//! Hold: the course of a signal between two samples.

/// Hold: the course of a signal between two samples. Sampling is exact for a signal with this course.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Hold {
    /// `u[k]` is held from `t[k]` to `t[k+1]`: the output of a D/A converter.
    #[default]
    Zero,
    /// A straight line from `u[k]` to `u[k+1]`: the better guess for a signal that was measured.
    First,
}

/// The past of a filter or a simulation before its first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Start {
    /// All states are 0. Correct if the process was at rest at time 0; otherwise the filtered signal starts with a step at the first
    /// sample.
    #[default]
    Zero,
    /// The first sample was held for all earlier times. Correct if the process was at rest at its operating point.
    Rest,
}
