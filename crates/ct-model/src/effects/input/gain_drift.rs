//! `gain_drift(u)`: the actuator's gain changes over the record.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "gain_drift",
    place: Place::Input,
    text: r#"
model gain_drift
  input Real u;
  constant Real begin(unit="time") = 0;
  constant Real duration(unit="time") = 1;
  parameter Real rate(unit="1", min=-0.95, max=5) = 0 "relative change over the record";
  output Real v(unit="port") = u*(1 + rate*(time - begin)/duration);
end gain_drift;
"#,
    parameters: &[("rate", Role::Size, Starts::Values(&[0.1, -0.1]))],
    physics: "The gain of the actuator changes in proportion to time: the actuator wears or warms up, or its supply changes.",
    confused_with: &["drift(p)", "drift(y)", "step(p)"],
    confirm: "Repeat the same step of the input at the beginning and at the end of a run.",
    symptoms: &["gets weaker over time", "drifts", "ages"],
};
