//! `backlash(u)`: play, or stiction, of the actuator.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "backlash",
    place: Place::Input,
    text: r#"
model backlash
  input Real u;
  constant Real width(unit="signal") = 1;
  final parameter Real jump(min=0, max=1) = 0 "0: play; 1: stiction, which moves by steps of twice the half-width";
  parameter Real half_width(unit="port", min=0, max=0.5*width) = 0 "half of the play, or of the step by which it moves";
  parameter Real begin(min=-1, max=1) = 0 "position within the band when the record begins; 0: at the command, -1 and 1: at an end";
  output Real v(unit="port") = stick_slip(u, half_width, jump, begin);
end backlash;
"#,
    parameters: &[
        ("jump", Role::Choice, Starts::Values(&[0.0, 1.0])),
        // With stiction, the cost has a visible minimum only near the true width.
        (
            "half_width",
            Role::Threshold,
            Starts::Widths(&[
                0.012, 0.016, 0.022, 0.03, 0.04, 0.054, 0.073, 0.098, 0.13, 0.18, 0.24, 0.33,
            ]),
        ),
        ("begin", Role::Begin, Starts::Values(&[0.0])),
    ],
    physics: "After each reversal the command has to cross a backlash before the actuator follows (worn gears), or the actuator sticks until the command has moved far enough, and then jumps (a valve's stem).",
    confused_with: &["dead_zone(u)", "lag(u)", "hysteresis(y)"],
    confirm: "Reverse the input in small steps and count those that change nothing. Then move it in small steps in one direction: with stiction it stands still and then jumps.",
    symptoms: &[
        "play",
        "stiction",
        "no answer to small reversals",
        "slack",
        "sticks and jumps",
    ],
};
