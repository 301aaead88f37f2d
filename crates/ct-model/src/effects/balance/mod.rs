//! Effects in the equation of a state.

mod constant;
mod hidden_state;
mod limit;
mod loss;
mod periodic;
mod step;

use super::Effect;

/// What stops the state last: it has to know everything else.
pub(super) const EFFECTS: [Effect; 6] = [
    constant::EFFECT,
    loss::EFFECT,
    step::EFFECT,
    periodic::EFFECT,
    hidden_state::EFFECT,
    limit::EFFECT,
];
