//! Effects in the equation of a speed.

mod coulomb;
mod quadratic_drag;
mod stribeck;

use super::Effect;

pub(super) const EFFECTS: [Effect; 3] = [coulomb::EFFECT, stribeck::EFFECT, quadratic_drag::EFFECT];
