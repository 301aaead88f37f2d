//! The problem of a diagnosis, and the fit of the believed model.
//!
//! In this order: `problem.rs` and `problem_builder.rs` (plant, records, options), `check.rs` (what records of one problem must share),
//! `gaps.rs` (rows without an input are held or cut out), `believed.rs` (the fit from many starts), `control_loop.rs` (time constants and
//! stability of the fitted plant), `closed_loop.rs` (the loop simulated where it is known). `time_limit.rs` shares the time out to the phases of a search.

pub(crate) mod believed;
mod check;
pub(crate) mod closed_loop;
pub(crate) mod control_loop;
pub(crate) mod gaps;
mod problem;
mod problem_builder;
pub(crate) mod time_limit;

pub use self::{
    problem::{Options, Problem, Progress, TIME_LIMIT},
    problem_builder::ProblemBuilder,
};
