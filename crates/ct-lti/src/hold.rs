//! What a signal does between two samples.

/// What a signal does between two samples. Sampling is exact for a signal that does just that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Hold {
    /// `u[k]` stands from `t[k]` to `t[k+1]`: what a D/A converter puts out.
    #[default]
    Zero,
    /// A straight line from `u[k]` to `u[k+1]`: the better guess for a signal that was measured.
    First,
}

/// The past of a filter or a simulation before its first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Start {
    /// All states are 0. Right where the process was at rest at 0; otherwise a jump at the first sample.
    #[default]
    Zero,
    /// The first sample has stood forever. Right where the process was at rest at its operating point.
    Rest,
}
