//! `sticking(y)`: the reading of a level is too high after high levels.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "sticking",
    place: Place::LevelReading,
    text: r#"
model sticking
  input Real y;
  constant Real low(unit="signal") = 0;
  constant Real width(unit="signal") = 1;
  parameter Real step(unit="port", min=0, max=0.1*width) = 0 "by how much the reading is too high";
  parameter Real drop(unit="port", min=low + 0.02*width, max=low + 0.9*width) = low + 0.4*width "level at which a falling reading drops back";
  parameter Real rise(unit="port", min=0.02*width, max=width) = 0.25*width "how far above it the reading sticks in full";
  Real rising = min(max((y - drop)/rise, 0), 1);
  Real falling = min(max((y - drop)/(0.015*width), 0), 1);
  output Real v(unit="port") = y + step*stay_between(rising, max(rising, falling));
end sticking;
"#,
    parameters: &[
        ("step", Role::Size, Starts::Widths(&[0.03])),
        (
            "drop",
            Role::Shape,
            Starts::Range(&[
                0.06, 0.13, 0.2, 0.27, 0.34, 0.41, 0.48, 0.55, 0.62, 0.69, 0.76, 0.83,
            ]),
        ),
        ("rise", Role::Shape, Starts::Widths(&[0.25])),
    ],
    physics: "After high levels the reading stays too high by a step, and drops back when the level falls.",
    confused_with: &["hysteresis(y)", "lag(y)"],
    confirm: "Look for sudden drops of the reading while the level falls steadily.",
    symptoms: &["sticks after high levels", "drops back suddenly"],
};
