//! Says which physical effect a model of measured data is missing: the program `ctid`, as a library.
//!
//! | what | where |
//! |---|---|
//! | the command line | [`run`], [`Cli`] |
//! | the model file | [`model_file`]; its effects are edited by [`edit`] |
//! | records and model, read and checked | [`input`] |
//! | a missing term as a file | [`term_file`] |
//! | the next experiment | [`mod@design`] |
//! | a model on new inputs | [`mod@simulate`] |
//! | a user's own model, without the command line | [`own_model`] |
//! | the tour | [`tour`] |
//! | monitoring of rows as they arrive | [`mod@monitor`] |
//! | linear models from a record, as text | [`mod@identify`] |
//! | the page | [`mod@serve`] |
//! | what a person reads | [`terminal`], [`catalogue`], [`report`] |
//! | findings in sentences | [`sentences`] |
//! | what is written, and what is not overwritten | [`output`] |
//!
//! The algorithms are in the crates below, the search in `missing-effect`, linear models in `linear-identification`, the papers' tables in
//! `paper-tables`; here is only what surrounds them.

mod atomic;
pub mod catalogue;
mod check;
mod column_errors;
mod commands;
mod csv_text;
pub mod design;
pub mod edit;
pub mod effort;
mod error;
mod findings;
mod finish;
mod generic;
pub mod identify;
pub mod input;
mod interrupt;
pub mod look;
mod message_names;
pub mod model_file;
pub mod monitor;
mod names;
pub mod output;
pub mod own_model;
mod plot;
mod program;
pub mod progress;
pub mod report;
pub mod sentences;
pub mod serve;
mod signature;
pub mod simulate;
mod symptoms;
mod tables;
pub mod term_file;
pub mod terminal;
pub mod tour;

pub use commands::{Cli, run};
pub use error::{Error, one_line};
pub use message_names::MessageNames;
use missing_effect::numbers;
pub use program::program;
