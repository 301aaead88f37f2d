//! `lag(u)`: the actuator follows the command with a time constant.
//!
//! Below half an interval between rows a lag differs from a smaller one only by how late it is: there the filter keeps that time constant,
//! and a share of the input goes past it, so that the mean delay is the time constant. At zero all of it does, and the derivative there is
//! right.

use crate::effects::{Effect, Place, Role, Starts};

pub(in crate::effects) const EFFECT: Effect = Effect {
    id: "lag",
    place: Place::Input,
    text: r#"
model lag
  input Real u;
  constant Real interval(unit="time") = 1;
  constant Real duration(unit="time") = 1;
  constant Real shortest(unit="time") = 0.5*interval;
  parameter Real tau(unit="time", min=0, max=duration) = 0 "time constant";
  Real x(unit="port");
  output Real v(unit="port") = u + min(tau/shortest, 1)*(x - u);
initial equation
  x = u;
equation
  max(tau, shortest)*der(x) = u - x;
end lag;
"#,
    parameters: &[("tau", Role::Size, Starts::Intervals(&[1.0, 5.0, 25.0]))],
    physics: "The actuator follows the command with a time constant: it has to spin up, warm up or travel.",
    confused_with: &["delay(u)", "lag(y)", "backlash(u)"],
    confirm: "Apply a step of the input and watch the actuator: does it reach its final position at once?",
    symptoms: &["sluggish", "reacts slowly", "answers late and softly"],
};
