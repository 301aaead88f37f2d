//! Handling of gaps in records.

use ct_signals::Gaps;
use serde::{Deserialize, Serialize};

/// An input is held through a gap of at most this part of the fastest time constant.
pub const LONGEST_HOLD: f64 = 0.1;

/// Handling of gaps in records.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MendedGaps {
    /// Rows and places.
    #[serde(flatten)]
    pub gaps: Gaps,
    /// The fastest time constant of the plant \[s\], by a first fit.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub time_constant: f64,
    /// The longest time for which an input would have been held \[s\].
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub limit: f64,
}
