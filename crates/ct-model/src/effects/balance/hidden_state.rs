//! `hidden_state(x)`: exchange with a store that is not measured. The store begins near the values that the state takes: one that begins far
//! away is a drift.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "hidden_state",
    place: Place::Balance,
    text: r#"
model hidden_state
  input Real x;
  constant Real first(unit="signal") = 0;
  constant Real balance(unit="balance") = 1;
  constant Real low(unit="signal") = 0;
  constant Real high(unit="signal") = 1;
  constant Real width(unit="signal") = 1;
  constant Real interval(unit="time") = 1;
  constant Real duration(unit="time") = 1;
  parameter Real exchange(unit="balance/port", min=0, max=100*balance/width) = 0 "exchange per unit of difference";
  parameter Real tau(unit="time", min=0.1*interval, max=20*duration) = 0.1*duration "time constant of the store";
  Real z(unit="port", start=first, min=low - width, max=high + width) "the store";
  output Real v(unit="balance") = exchange*(z - x);
equation
  tau*der(z) = x - z;
end hidden_state;
"#,
    parameters: &[
        (
            "exchange",
            Role::Size,
            Starts::BalancesPerWidth(&[0.1, 1.0]),
        ),
        (
            "tau",
            Role::Shape,
            Starts::Durations(&[0.003, 0.01, 0.03, 0.1, 0.3, 1.0]),
        ),
    ],
    physics: "The state exchanges with a second store that the model does not contain: a wall, a sleeve, a dead volume.",
    confused_with: &["lag(y)", "loss(x)", "lag(u)"],
    confirm: "Apply a step and wait: is there a fast response and then a slow one?",
    symptoms: &["two time constants", "long tail", "creeps after a step"],
};
