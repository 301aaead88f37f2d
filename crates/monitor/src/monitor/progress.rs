//! What a monitor says of itself: its estimates, and how far it has come.

use serde::Serialize;

/// A parameter as it is tracked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// As it was learned.
    pub learned: f64,
    /// As it is now.
    pub value: f64,
    /// Half the width of the 95 % interval; `None` for one that is fixed.
    pub half_width: Option<f64>,
}

/// Where the monitor is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress {
    /// It learns, and has so many rows (or blocks of rows).
    Learning(usize),
    /// The learned model is watched: the largest score now and the threshold.
    Watching {
        /// The largest score, by magnitude.
        score: f64,
        /// What it has to pass.
        threshold: f64,
    },
    /// The model does not fit: the same.
    Alarmed {
        /// The largest score, by magnitude.
        score: f64,
        /// What it had to pass.
        threshold: f64,
    },
}

/// What is there to learn from, and what is needed at least before the next fit is tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gathered {
    /// Rows.
    pub rows: usize,
    /// From the first to the last \[s\].
    pub span: f64,
    /// Rows that are needed.
    pub rows_needed: usize,
    /// Slowest time constants that are needed.
    pub time_constants: f64,
    /// What these last \[s\], by the latest fit; `None` before the first.
    pub span_needed: Option<f64>,
}
