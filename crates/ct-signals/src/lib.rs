//! Records of sampled signals, what happens between samples, excitations, noise and residual tests.

mod ar;
mod columns;
mod csv_file;
mod error;
pub mod excitation;
pub mod noise;
mod record;
pub mod residual_tests;
mod unit;

pub use ar::{ArModel, Whitener};
pub use columns::Columns;
pub use csv_file::read_csv;
pub use error::Error;
pub use record::{Hold, MIN_ROWS, ROWS_PER_PARAMETER, Record, Signal};
