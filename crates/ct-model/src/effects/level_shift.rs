//! `level_shift(y)`: from one row to the next the reading changes by a constant. A recalibration, a sensor that was moved or a changed cable
//! is no physics of the plant: a search does not use it as a candidate, but no set of effects is accepted that explains less.

use super::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "level_shift",
    place: Place::Output,
    text: r#"
model level_shift
  input Real y;
  constant Real begin(unit="time") = 0;
  constant Real duration(unit="time") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real size(unit="port", min=-5*width, max=5*width) = 0 "change of the reading";
  parameter Real since(unit="time", min=begin, max=begin + duration) = begin + 0.5*duration "when it changes";
  output Real v(unit="port") = y + (if time >= since then size else 0);
end level_shift;
"#,
    parameters: &[
        ("size", Role::Size, Starts::Widths(&[0.1])),
        ("since", Role::Shape, Starts::Times(&[0.5])),
    ],
    physics: "From one row to the next the reading changes by a constant.",
    confused_with: &["step(x)", "step(p)"],
    confirm: "Look into the log for that time: was the sensor moved, calibrated or replaced?",
    symptoms: &["the reading jumps"],
};
