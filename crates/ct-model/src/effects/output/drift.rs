//! `drift(y)`: the sensor's zero drifts.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "drift",
    place: Place::Output,
    text: r#"
model drift
  input Real y;
  constant Real begin(unit="time") = 0;
  constant Real duration(unit="time") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real change(unit="port", min=-5*width, max=5*width) = 0 "change of the zero over the record";
  output Real v(unit="port") = y + change*(time - begin)/duration;
end drift;
"#,
    parameters: &[("change", Role::Size, Starts::Widths(&[0.05, -0.05]))],
    physics: "The sensor's zero moves in proportion to time.",
    confused_with: &["drift(p)", "gain_drift(u)", "step(x)"],
    confirm: "Check the sensor's zero before and after a run.",
    symptoms: &["reading creeps", "zero drifts"],
};
