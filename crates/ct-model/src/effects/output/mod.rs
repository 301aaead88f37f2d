//! Effects between what is measured and the reading, in the order of the chain.

mod drift;
mod hysteresis;
mod lag;
mod nonlinearity;
mod offset;
mod quantisation;
mod saturation;

use super::Effect;

/// A converter rounds last.
pub(super) const EFFECTS: [Effect; 7] = [
    lag::EFFECT,
    nonlinearity::EFFECT,
    saturation::EFFECT,
    hysteresis::EFFECT,
    drift::EFFECT,
    offset::EFFECT,
    quantisation::EFFECT,
];
