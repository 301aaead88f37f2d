//! `offset(y)`: the sensor's zero is wrong.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "offset",
    place: Place::Output,
    text: r#"
model offset
  input Real y;
  constant Real width(unit="signal") = 1;
  parameter Real error(unit="port", min=-5*width, max=5*width) = 0 "error of the zero";
  output Real v(unit="port") = y + error;
end offset;
"#,
    parameters: &[("error", Role::Size, Starts::Widths(&[0.05, -0.05]))],
    physics: "The reading has a constant error.",
    confused_with: &["constant(x)"],
    confirm: "Read the sensor where the measured quantity is known: empty, at rest, in ice water.",
    symptoms: &["wrong zero", "reads too high", "reads too low"],
};
