//! Effects between what is measured and the reading, in the order of the chain.

mod delay;
mod drift;
mod hysteresis;
mod lag;
mod nonlinearity;
mod offset;
mod quantisation;
mod saturation;

use super::Effect;

/// A converter rounds last.
pub(super) const EFFECTS: [Effect; 8] = [
    lag::EFFECT,
    delay::EFFECT,
    nonlinearity::EFFECT,
    saturation::EFFECT,
    hysteresis::EFFECT,
    drift::EFFECT,
    offset::EFFECT,
    quantisation::EFFECT,
];
