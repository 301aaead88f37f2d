//! Effects between a current and a voltage that is read.

mod second_rc;
mod series_resistance;

use super::Effect;

pub(super) const EFFECTS: [Effect; 2] = [series_resistance::EFFECT, second_rc::EFFECT];
