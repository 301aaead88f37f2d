//! The search of sets of effects, and the confirmation of their effects with the noise model of the best set's residual.
//!
//! `find.rs` calls, in this order: `growth.rs` (sets grown from one size to the next) with `pairs.rs` (joint scores of all pairs) and
//! `residual_kind.rs` (whether a set leaves anything to explain), `floating.rs` (larger sets), `confirm.rs` (backward elimination) with
//! `swap.rs` (one effect in another's place). `scores.rs` and `rankings.rs` report the single effects.

pub(crate) mod confirm;
pub(crate) mod find;
mod floating;
pub(crate) mod growth;
mod pairs;
pub(crate) mod rankings;
mod residual_kind;
pub(crate) mod scores;
pub(crate) mod swap;
