//! Report of a monitor: its estimates, and its progress.

use serde::Serialize;

/// A parameter as it is tracked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Learned value.
    pub learned: f64,
    /// Present value.
    pub value: f64,
    /// Half the width of the 95 % interval; `None` for one that is fixed.
    pub half_width: Option<f64>,
}

/// Phase of the monitor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress {
    /// The monitor learns, and has collected this number of rows (or blocks of rows).
    Learning(usize),
    /// Monitoring: the largest present score and its threshold.
    Watching {
        /// The largest score, by magnitude.
        score: f64,
        /// Threshold of the score.
        threshold: f64,
    },
    /// The model does not fit: score and threshold.
    Alarmed {
        /// The largest score, by magnitude.
        score: f64,
        /// Threshold of the score.
        threshold: f64,
    },
}

/// Rows collected for learning, and the minimum for the next attempt of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gathered {
    /// Rows.
    pub rows: usize,
    /// Time from the first to the last row \[s\].
    pub span: f64,
    /// Required number of rows.
    pub rows_needed: usize,
    /// Required number of slowest time constants.
    pub time_constants: f64,
    /// Required time span \[s\] according to the latest fit; `None` before the first.
    pub span_needed: Option<f64>,
}
