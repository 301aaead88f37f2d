//! ctid

mod error;
pub mod model_file;
mod names;
pub mod report;

pub use error::Error;
