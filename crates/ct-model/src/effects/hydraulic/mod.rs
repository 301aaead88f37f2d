//! Effects at the levels of tanks. Other effects of tanks have general names in the catalogue: laminar outflow is `loss(h)`, a neighbouring
//! tank `coupling(h1,h2)` or `hidden_state(h)`, an overflow that is lost `limit(h)`.

mod curved_reading;
mod leak_at_height;
mod overflow;
mod sticking;

use super::Effect;

pub(super) const EFFECTS: [Effect; 4] = [
    leak_at_height::EFFECT,
    overflow::EFFECT,
    curved_reading::EFFECT,
    sticking::EFFECT,
];
