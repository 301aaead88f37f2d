//! `drift(p)`: a parameter changes over the record.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "drift",
    place: Place::Parameter,
    text: r#"
model drift
  input Real p;
  constant Real begin(unit="time") = 0;
  constant Real duration(unit="time") = 1;
  parameter Real rate(unit="1", min=-0.95, max=5) = 0 "relative change over the record";
  output Real v(unit="value") = p*(1 + rate*(time - begin)/duration);
end drift;
"#,
    parameters: &[("rate", Role::Size, Starts::Values(&[0.1, -0.1]))],
    physics: "The parameter changes in proportion to time: by fouling, wear, warming up.",
    confused_with: &["step(p)", "gain_drift(u)", "drift(y)"],
    confirm: "Repeat the same experiment at the beginning and at the end of a run.",
    symptoms: &["changes over time", "fouls", "clogs", "ages"],
};
