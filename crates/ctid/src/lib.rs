//! ctid

mod atomic;
pub mod catalogue;
pub mod edit;
mod error;
pub mod look;
pub mod model_file;
mod names;
mod numbers;
pub mod report;

pub use error::Error;
