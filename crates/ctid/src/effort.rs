//! Time limit of a search.

use std::time::Duration;

use clap::ValueEnum;
use serde::Deserialize;

/// A limit on the time of a search.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EffortLevel {
    /// 5 s
    Quick,
    /// 40 s
    #[default]
    Normal,
    /// 10 min
    Thorough,
}

impl EffortLevel {
    /// The limit.
    #[must_use]
    pub fn limit(self) -> Duration {
        match self {
            Self::Quick => Duration::from_secs(5),
            Self::Normal => missing_effect::TIME_LIMIT,
            Self::Thorough => Duration::from_secs(600),
        }
    }
}

/// A limit in words: `40 s`, `10 min`.
pub(crate) fn limit_text(seconds: f64) -> String {
    if seconds >= 120.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{seconds:.0} s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_in_order_and_said_as_the_help_says_them() {
        let limits = EffortLevel::value_variants()
            .iter()
            .map(|level| level.limit());
        assert!(limits.clone().is_sorted());
        for (level, limit) in EffortLevel::value_variants().iter().zip(limits) {
            let value = level.to_possible_value().expect("none is skipped");
            let help = value.get_help().map(ToString::to_string);
            assert_eq!(help, Some(limit_text(limit.as_secs_f64())));
        }
    }
}
