//! `delay(y)`: the reading is late, like a dead time of an input.

use crate::effects::{Effect, Place, input::delay};

pub(super) const EFFECT: Effect = Effect {
    place: Place::Output,
    physics: "The reading is that of a dead time earlier: a sample that flows to an analyser, a sensor further down the pipe, a network.",
    confused_with: &["lag(y)", "delay(u)"],
    confirm: "Change what the sensor measures suddenly, and measure the time until the reading moves.",
    symptoms: &["late reading", "analyser answers late", "sampling line"],
    ..delay::EFFECT
};
