//! Fits a plant to records by simulation error: bounds, many starts, exact sensitivities, a noise model,
//! and uncertainty that is right.

mod clock;
mod error;
mod feedback;
mod fit;
mod levenberg_marquardt;
mod many_starts;
mod marginal;
mod noise_factor;
mod reading_grid;
mod reading_step;
mod sandwich;
mod setup;
mod starts;
mod time_limit;
mod triangle;

pub use clock::common_clock;
pub use error::Error;
pub use feedback::{LinearPlant, Replay, replay};
pub use fit::{
    Fit, FitOptions, Start, coloured, fit, fit_from, fit_initial_levels, fit_onward, noise_of,
    prewhitened,
};
pub use levenberg_marquardt::{Stop, Stopping};
pub use many_starts::{keep_best_simulated, with_other_speeds};
pub use reading_grid::{ReadingGrid, reading_grid};
pub use reading_step::exact_reading_step;
pub use sandwich::{Robust, robust};
pub use setup::{LoopRun, Rows, Setup, Simulated, at_rest, commands};
pub use starts::{random_starts, starts_around};
pub use time_limit::TimeLimit;
pub use triangle::Triangle;
