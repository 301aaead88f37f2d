#![doc = include_str!("../README.md")]

mod clock;
mod dynamics;
mod error;
mod feedback;
mod fit;
mod ideal;
mod many_starts;
mod model_observer;
mod model_setup;
mod model_starts;
mod names;
mod not_determined;
mod output_noise;
mod prediction;
mod reading_grid;
mod reading_step;
mod setup;
mod starts;
mod steady_state;
mod time_limit;

pub use clock::common_clock;
pub use error::Error;
pub use estimation::{
    Error as NoFit, Fit, Noise, Robust, Rows, Signature, Start, Stop, Stopping, Triangle,
    moved_by_weighting,
};
pub use feedback::{LinearPlant, Replay, replay, spectral_radius};
pub use fit::{
    FitOptions, coloured, fit, fit_from, fit_initial_levels, fit_onward, noise_of, prewhitened,
    robust,
};
pub use ideal::{IdealRecords, NotIdeal, ideal_records};
pub use many_starts::{keep_best_simulated, with_other_speeds};
pub use model_setup::{LoopController, ModelSetup, SimulatedLoop};
pub use names::Names;
pub use not_determined::not_determined;
pub use prediction::{FitUncertainty, InitialStates, output_errors};
pub use reading_grid::{ReadingGrid, reading_grid};
pub use reading_step::{exact_reading_step, possible_reading_steps};
pub use setup::{LoopRun, PriorValue, Setup, Simulated, at_rest, commands, weighted_rms};
pub use starts::{levels_from_readings, random_starts, starts_around};
pub use steady_state::steady_state;
pub use time_limit::TimeLimit;
