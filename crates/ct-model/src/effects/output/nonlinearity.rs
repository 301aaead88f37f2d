//! `nonlinearity(y)`: the sensor's characteristic is not linear.

use crate::effects::{Effect, Place, input::nonlinearity};

pub(super) const EFFECT: Effect = Effect {
    place: Place::Output,
    physics: "The reading is not linear in the measured quantity: a parabola through both ends of the visited range.",
    confused_with: &["varies_with(p,x)", "saturation(y)", "nonlinearity(u)"],
    confirm: "Compare the sensor with a reference at both ends and in the middle of its range.",
    symptoms: &["calibration error", "right at the ends, wrong between them"],
    ..nonlinearity::EFFECT
};
