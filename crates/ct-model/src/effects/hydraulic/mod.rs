//! Effects at the levels of tanks. What else a tank may lack is in the catalogue under a general name: laminar outflow is `loss(h)`, a tank
//! beside it `coupling(h1,h2)` or `hidden_state(h)`, an overflow that is lost `limit(h)`.

mod leak_at_height;
mod overflow;

use super::Effect;

pub(super) const EFFECTS: [Effect; 2] = [leak_at_height::EFFECT, overflow::EFFECT];
