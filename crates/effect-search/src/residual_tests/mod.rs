//! Tests of a residual, and the properties that noise does not have.

mod bands;
pub(crate) mod energy;
pub mod feedback;
pub(crate) mod first_order;
mod inputs;
mod reported;
mod spectral_line;
pub(crate) mod stationarity;
pub mod white;

use serde::{Deserialize, Serialize};

pub use self::inputs::InputDependence;
pub use self::reported::ResidualTests;
pub use self::spectral_line::{Line, strongest_line};

/// A property of a residual that noise does not have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum NotNoise {
    /// It depends on an input.
    Input {
        /// The input.
        input: String,
        /// The output.
        output: String,
    },
    /// It has a period.
    Period {
        /// The output.
        output: String,
        /// Its length \[s\].
        period: f64,
    },
    /// An abrupt change.
    Instant {
        /// The output.
        output: String,
        /// The record.
        record: String,
        /// From when \[s, the record's clock\].
        from: f64,
        /// Until when \[s\].
        to: f64,
    },
    /// It is larger in a part of the record than noise with its correlation would be: a temporary disturbance.
    Disturbance {
        /// The output.
        output: String,
        /// The record.
        record: String,
        /// From when \[s, the record's clock\].
        from: f64,
        /// Until when \[s\].
        to: f64,
    },
    /// From one row to the next the reading changes by a constant, and no set of effects explains as much.
    LevelShift {
        /// The output.
        output: String,
        /// The record.
        record: String,
        /// Time of the first row after the level shift \[s, the record's clock\].
        at: f64,
        /// Change of the reading.
        size: f64,
        /// Unit of the output.
        unit: String,
    },
    /// It depends on the model's output.
    Level {
        /// The output.
        output: String,
    },
    /// It is not stationary: its spectrum differs between parts of a record.
    Spectrum {
        /// The output.
        output: String,
        /// The record.
        record: String,
    },
    /// A smooth function of a signal or of time, at some port of the model, lowers it significantly.
    Function {
        /// Identifier of the function: `shape(T,u)`, `course(T)`.
        effect: String,
        /// Its variable: a state or an input, or `time`.
        variable: String,
    },
    /// Its correlation is not that of first-order noise: for example a disturbance in a band of frequencies, or physics that no candidate
    /// describes.
    Correlation {
        /// The output.
        output: String,
    },
    /// Its correlation time is so long that the records contain too few independent samples to call it noise.
    Slow {
        /// The output.
        output: String,
    },
}
