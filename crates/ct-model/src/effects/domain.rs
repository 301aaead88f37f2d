//! Which ports the effects of a domain have, from the units of states and readings.

use super::effect::Effect;
use super::port::Port;
use crate::spec::ModelSpec;

pub(super) fn ports(_spec: &ModelSpec, _effect: &Effect) -> Vec<Port> {
    Vec::new()
}
