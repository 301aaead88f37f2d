//! Acceptance: whether the effects that the search confirmed explain the data.
//!
//! In this order: `ambiguity.rs` compares them with simpler explanations: coloured noise alone, a level shift of the reading
//! (`level_shift.rs`), a random walk (`random_walk.rs`). `acceptance.rs` tests how much they explain and whether the residual is noise,
//! with `ladder.rs` (the intermediate models, one effect after the other) and `groups.rs` (effects that cannot be distinguished). If they
//! do not explain the error, `partial.rs` looks for a partial explanation, also for a sticking valve (`sticking.rs`). `rounding.rs` finds
//! the resolution of a converter in the readings.

pub(crate) mod acceptance;
pub(crate) mod ambiguity;
mod groups;
mod ladder;
mod level_shift;
pub(crate) mod partial;
mod random_walk;
pub(crate) mod rounding;
pub(crate) mod sticking;
