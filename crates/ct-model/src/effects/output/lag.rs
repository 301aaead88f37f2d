//! `lag(y)`: the reading follows with a time constant, like a lag of an input.

use crate::effects::{Effect, Place, input::lag};

pub(super) const EFFECT: Effect = Effect {
    place: Place::Output,
    physics: "The reading follows the measured quantity with a time constant: a sensor in a sleeve, a filter.",
    confused_with: &["lag(u)", "delay(y)", "hidden_state(x)"],
    confirm: "Expose the sensor to a sudden change and watch how the reading settles.",
    symptoms: &["slow sensor", "smooth reading", "reading lags behind"],
    ..lag::EFFECT
};
