//! `saturation(y)`: the sensor's range ends.

use crate::effects::{Effect, Place, input::saturation};

pub(super) const EFFECT: Effect = Effect {
    place: Place::Output,
    physics: "The reading stays at the end of the sensor's range while the measured quantity changes further.",
    confused_with: &["limit(x)", "nonlinearity(y)"],
    confirm: "Look for long runs of one value at an end of the readings; measure by other means there.",
    symptoms: &["clipped reading", "sensor at its end", "flat top"],
    ..saturation::EFFECT
};
