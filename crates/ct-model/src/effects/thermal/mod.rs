//! Effects in the balance of a temperature, with a surrounding temperature.

mod evaporation;
mod natural_convection;
mod radiation;

use super::Effect;

pub(super) const EFFECTS: [Effect; 3] = [
    radiation::EFFECT,
    natural_convection::EFFECT,
    evaporation::EFFECT,
];
