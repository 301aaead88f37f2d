//! `quantisation(y)`: the converter's steps are coarse.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "quantisation",
    place: Place::Output,
    text: r#"
model quantisation
  input Real y;
  constant Real width(unit="signal") = 1;
  parameter Real step(unit="port", min=0, max=width) = 0 "distance of two readings";
  output Real v(unit="port") = quantise(y, step);
end quantisation;
"#,
    parameters: &[("step", Role::Threshold, Starts::Widths(&[0.01, 0.03, 0.1]))],
    physics: "The reading is rounded to steps that are larger than the noise.",
    confused_with: &["hysteresis(y)"],
    confirm: "List the values that the readings take: are they multiples of one step?",
    symptoms: &["stairs", "few different values", "coarse resolution"],
};
