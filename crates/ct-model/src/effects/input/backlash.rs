//! `backlash(u)`: play, or stiction, of the actuator.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "backlash",
    place: Place::Input,
    text: r#"
model backlash
  input Real u;
  constant Real width(unit="signal") = 1;
  parameter Real half_width(unit="port", min=0, max=0.5*width) = 0 "half of the play";
  output Real v(unit="port") = play(u, half_width);
end backlash;
"#,
    parameters: &[(
        "half_width",
        Role::Size,
        Starts::Widths(&[0.01, 0.05, 0.15]),
    )],
    physics: "After each reversal the command has to cross a backlash before the actuator follows: worn gears, a valve's stem that sticks.",
    confused_with: &["dead_zone(u)", "lag(u)", "hysteresis(y)"],
    confirm: "Reverse the input in small steps and count those that change nothing.",
    symptoms: &["play", "stiction", "no answer to small reversals", "slack"],
};
