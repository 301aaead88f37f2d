//! Fits a plant to records by simulation error: bounds, many starts, exact sensitivities, a noise model,
//! and uncertainty that is right.

mod error;
mod fit;
mod levenberg_marquardt;
mod setup;
mod starts;
mod triangle;

pub use error::Error;
pub use fit::{Fit, FitOptions, coloured, fit, fit_from, fit_initial_levels};
pub use levenberg_marquardt::{Stop, Stopping};
pub use setup::{Setup, Simulated};
pub use starts::random_starts;
pub use triangle::Triangle;
