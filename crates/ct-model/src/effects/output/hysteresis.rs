//! `hysteresis(y)`: the reading sticks.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "hysteresis",
    place: Place::Output,
    text: r#"
model hysteresis
  input Real y;
  constant Real width(unit="signal") = 1;
  parameter Real half_width(unit="port", min=0, max=0.5*width) = 0 "half of the play";
  output Real v(unit="port") = play(y, half_width);
end hysteresis;
"#,
    parameters: &[(
        "half_width",
        Role::Size,
        Starts::Widths(&[0.005, 0.03, 0.1]),
    )],
    physics: "The reading stays constant after each reversal until the measured quantity has moved by the width of the hysteresis.",
    confused_with: &["lag(y)", "backlash(u)", "quantisation(y)"],
    confirm: "Approach one value from above and from below: do the readings differ?",
    symptoms: &["sticky reading", "reading depends on the direction"],
};
