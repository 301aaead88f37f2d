//! Sets of effects and their fits, the believed model first.

pub(crate) mod believed;
pub(crate) mod estimate;
pub(crate) mod joined;
pub(crate) mod node;
pub(crate) mod relations;
