//! Effects between an input and the model, in the order of the chain.

mod backlash;
mod dead_zone;
pub(super) mod delay;
mod gain_drift;
pub(super) mod lag;
pub(super) mod nonlinearity;
pub(super) mod saturation;

use super::Effect;

/// A delay comes first, because it delays known inputs; it commutes with all other effects but a drift.
pub(super) const EFFECTS: [Effect; 7] = [
    delay::EFFECT,
    nonlinearity::EFFECT,
    dead_zone::EFFECT,
    saturation::EFFECT,
    gain_drift::EFFECT,
    backlash::EFFECT,
    lag::EFFECT,
];
