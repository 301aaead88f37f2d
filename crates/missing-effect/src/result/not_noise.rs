//! Structure of a residual that noise does not explain.

use serde::{Deserialize, Serialize};

/// A property of a residual that noise does not have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum NotNoise {
    /// The residual depends on the command.
    Input {
        /// The output, by its name.
        output: String,
        /// The record, by its name.
        record: String,
    },
    /// The residual has a period.
    Period {
        /// The output, by its name.
        output: String,
        /// The record, by its name.
        record: String,
        /// Length of the period \[s\], positive.
        period: f64,
    },
    /// The residual changes abruptly: a jump or a short pulse.
    Instant {
        /// The output, by its name.
        output: String,
        /// The record, by its name.
        record: String,
        /// Begin of the change \[s, the record's time\].
        from: f64,
        /// End of the change \[s, the record's time\]; equal to `from` if the change lasts.
        to: f64,
    },
    /// The residual depends on the level of the model.
    Level {
        /// The output, by its name.
        output: String,
        /// The record, by its name.
        record: String,
    },
    /// The residual drifts: its correlation time exceeds the slowest time constant of the model, so such noise can imitate any effect.
    Slow {
        /// The output, by its name.
        output: String,
        /// Integral of the autocorrelation of the noise over positive lags \[s\]; not finite if the noise model is not stationary.
        #[serde(deserialize_with = "effect_search::not_finite::number")]
        correlation_time: f64,
        /// The slowest time constant of the process \[s\].
        #[serde(deserialize_with = "effect_search::not_finite::number")]
        time_constant: f64,
    },
}

impl NotNoise {
    /// Name of the output whose residual has the property.
    #[must_use]
    pub fn output(&self) -> &str {
        match self {
            Self::Input { output, .. }
            | Self::Period { output, .. }
            | Self::Instant { output, .. }
            | Self::Level { output, .. }
            | Self::Slow { output, .. } => output,
        }
    }

    /// Name of the record whose residual has the property; `None` for a drift, which is a property of all records together.
    #[must_use]
    pub fn record(&self) -> Option<&str> {
        match self {
            Self::Input { record, .. }
            | Self::Period { record, .. }
            | Self::Instant { record, .. }
            | Self::Level { record, .. } => Some(record),
            Self::Slow { .. } => None,
        }
    }
}
