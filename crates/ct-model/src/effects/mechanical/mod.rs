//! Effects in the equation of a speed.

mod coulomb;
mod end_stop;
mod quadratic_drag;
mod stribeck;

use super::Effect;

pub(super) const EFFECTS: [Effect; 4] = [
    coulomb::EFFECT,
    stribeck::EFFECT,
    quadratic_drag::EFFECT,
    end_stop::EFFECT,
];
