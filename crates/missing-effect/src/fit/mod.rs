//! One fit of the plant with a set of effects, and the start of a fit with one more effect.
//!
//! In this order: `node.rs` (a set with its fit), `noise_model.rs` (the autoregressive model of its residual), `criterion.rs` (when one set
//! is better than another), `plausible.rs` (what a fit says of the readings has to be in them); then the starts of one effect more:
//! `starts.rs`, `period.rs` and `hidden_step.rs` (parameters with many minima), `proposal.rs` (the starts with the largest predicted fall, and their fit),
//! `minima.rs` (other minima of a set). `series.rs` counts the outputs of all records. Nothing here knows what is to be diagnosed.

pub(crate) mod criterion;
pub(crate) mod hidden_step;
pub(crate) mod minima;
pub(crate) mod node;
pub(crate) mod noise_model;
pub(crate) mod period;
pub(crate) mod plausible;
pub(crate) mod proposal;
pub(crate) mod series;
pub(crate) mod starts;
