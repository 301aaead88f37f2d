//! Shared parts of the tests: simulated rigs, servers and programs that are run, measured records, statistical bounds.

pub mod as_text;
pub mod blind;
pub mod coverage;
pub mod design_cases;
pub mod draw;
pub mod fuzz;
pub mod http;
pub mod library;
pub mod measured;
pub mod onset;
pub mod outside;
pub mod program;
mod rig;
pub mod three_tanks;

pub use self::rig::{Drive, Rig};
