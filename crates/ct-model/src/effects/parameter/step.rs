//! `step(p)`: a parameter changes at an unknown time.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "step",
    place: Place::Parameter,
    text: r#"
model step
  input Real p;
  constant Real begin(unit="time") = 0;
  constant Real duration(unit="time") = 1;
  parameter Real change(unit="1", min=-1, max=5) = 0 "relative change";
  parameter Real since(unit="time", min=begin, max=begin + duration) = begin + 0.5*duration "when it changes";
  output Real v(unit="value") = p*(1 + (if time >= since then change else 0));
end step;
"#,
    parameters: &[
        ("change", Role::Size, Starts::Values(&[0.1, -0.1])),
        (
            "since",
            Role::Shape,
            Starts::Times(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]),
        ),
    ],
    physics: "From some time on the parameter has another value: a part was replaced, blocked, opened or has broken.",
    confused_with: &["drift(p)", "step(x)"],
    confirm: "Look into the log for that time: what was changed?",
    symptoms: &["different since", "sudden change", "blocked", "broken"],
};
