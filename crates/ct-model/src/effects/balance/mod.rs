//! Effects in the equation of a state.

mod constant;
mod hidden_state;
pub(super) mod limit;
mod loss;
mod periodic;
mod step;

use super::Effect;

/// Effects that limit a state come last: they need the complete right-hand side.
pub(super) const EFFECTS: [Effect; 6] = [
    constant::EFFECT,
    loss::EFFECT,
    step::EFFECT,
    periodic::EFFECT,
    hidden_state::EFFECT,
    limit::EFFECT,
];
