//! Effects in the equation of a speed.

mod coulomb;
mod cubic_stiffness;
mod end_stop;
mod quadratic_drag;
mod stribeck;

use super::Effect;

pub(super) const EFFECTS: [Effect; 5] = [
    coulomb::EFFECT,
    stribeck::EFFECT,
    quadratic_drag::EFFECT,
    cubic_stiffness::EFFECT,
    end_stop::EFFECT,
];
