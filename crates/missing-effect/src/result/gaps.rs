//! Handling of gaps in records.

use ct_signals::{Gaps, duration};
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
    #[serde(deserialize_with = "crate::result::number")]
    pub time_constant: f64,
    /// The longest time for which an input would have been held \[s\].
    #[serde(deserialize_with = "crate::result::number")]
    pub limit: f64,
}

impl MendedGaps {
    /// One sentence; `None` without gaps.
    #[must_use]
    pub fn sentence(&self) -> Option<String> {
        let Gaps {
            rows,
            places,
            held,
            cut,
            unused,
            longest_hold,
        } = self.gaps;
        let count = |count: usize, one: &str, several: &str| match count {
            1 => format!("1 {one}"),
            count => format!("{count} {several}"),
        };
        if places == 0 {
            return (unused > 0).then(|| {
                format!(
                    "{} not used: an input is not known there.",
                    count(unused, "row is", "rows are")
                )
            });
        }
        let mut text = match rows {
            0 => format!(
                "Samples of an input are missing in {}",
                count(places, "place", "places")
            ),
            rows => format!(
                "{} missing in {}",
                count(rows, "row is", "rows are"),
                count(places, "place", "places")
            ),
        };
        if held > 0 {
            text += &format!(
                "; the input is held through {held} of them, for at most {}",
                duration(longest_hold)
            );
        }
        if cut > 0 {
            text += &format!(
                "; the simulation restarts after {cut}, where the input would have to be held longer than {:.0} % of the fastest time constant ({})",
                100.0 * LONGEST_HOLD,
                duration(self.time_constant)
            );
        }
        if unused > 0 {
            text += &format!("; {} not used", count(unused, "row is", "rows are"));
        }
        Some(text + ".")
    }
}
