//! Start values of a fit: regressions on filtered signals, which need no start themselves.
//!
//! | question | answer |
//! |---|---|
//! | Nothing is known but the orders | [`pipeline`]: a few candidates, the best first |
//! | One regression, with my filter | [`least_squares`], biased by noise; then [`instruments`], which is not |
//! | The best a regression can do | [`srivc`]; with a delay, an integrator, a model of the noise, or without the controller: the crate `rivc` |
//! | How well are the parameters known then? | [`standard_errors`] |
//! | Which bandwidth of the filter? | [`lambda_ladder`] |
//! | The paper's own first-order start | [`first_order`] |
//!
//! All work in open loop too (a controller of none): the instruments then are simulated from the measured u.

pub mod first_order;
mod ladder;
mod regression;
mod signals;
mod standard_errors;

pub use ladder::{Candidate, PipelineSettings, Stage, lambda_ladder, pipeline};
pub use regression::{Refinement, instruments, least_squares, srivc};
pub use standard_errors::standard_errors;
