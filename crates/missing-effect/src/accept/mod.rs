//! Acceptance: whether the effects that the search confirmed explain the data.
//!
//! In this order: `doubt.rs` compares them with what would do in their place: coloured noise alone, one jump of the reading (`jump.rs`), a
//! random walk (`random_walk.rs`). `judge.rs` asks what they explain and what they leave, with `trail.rs` (the models on the way, one
//! effect after the other) and `groups.rs` (what cannot be distinguished). Where they are not the answer, `partial.rs` looks for a part of
//! it, a valve that sticks among them (`sticking.rs`). `rounding.rs` reads rounding by a converter from the readings.

pub(crate) mod doubt;
mod groups;
pub(crate) mod judge;
mod jump;
pub(crate) mod partial;
mod random_walk;
pub(crate) mod rounding;
pub(crate) mod sticking;
mod trail;
