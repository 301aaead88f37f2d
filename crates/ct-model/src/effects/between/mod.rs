//! Effects between two states, and between an input and another balance.

mod coupling;
mod input_to;

use super::Effect;

pub(super) const EFFECTS: [Effect; 2] = [coupling::EFFECT, input_to::EFFECT];
