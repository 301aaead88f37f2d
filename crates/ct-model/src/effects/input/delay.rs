//! `delay(u)`: dead time.

use crate::effects::{Effect, Place, Role, Starts};

pub(in crate::effects) const EFFECT: Effect = Effect {
    id: "delay",
    place: Place::Input,
    text: r#"
model delay_effect
  input Real u;
  constant Real duration(unit="time") = 1;
  parameter Real dead_time(unit="time", min=0, max=0.5*duration) = 0 "dead time";
  output Real v(unit="port") = delay(u, dead_time);
end delay_effect;
"#,
    parameters: &[(
        "dead_time",
        Role::Size,
        Starts::Intervals(&[0.5, 1.5, 4.5, 10.5, 25.5]),
    )],
    physics: "The input acts a dead time later: transport through a pipe or on a belt, a computer, a network.",
    confused_with: &["lag(u)", "delay(y)", "lag(y)"],
    confirm: "Apply a step of the input and measure the time until the output responds.",
    symptoms: &["dead time", "reacts late", "nothing happens at first"],
};
