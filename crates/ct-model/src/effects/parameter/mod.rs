//! Parameters, and named flows, that are not constant.

mod drift;
mod step;
mod varies_with;

use super::Effect;

pub(super) const EFFECTS: [Effect; 3] = [drift::EFFECT, step::EFFECT, varies_with::EFFECT];
