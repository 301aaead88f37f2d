//! `second_rc(y,i)`: one more pair of resistance and capacitance.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "second_rc",
    place: Place::Terminal,
    text: r#"
model second_rc
  input Real y;
  input Real a;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  constant Real interval(unit="time") = 1;
  constant Real duration(unit="time") = 1;
  parameter Real resistance(unit="balance/port", min=-10*balance/width, max=10*balance/width) = 0 "of a sign that the current's decides";
  parameter Real tau(unit="time", min=0.1*interval, max=20*duration) = 0.1*duration "time constant";
  Real w(unit="port", start=0, fixed=true) "the current as the pair sees it";
  output Real v(unit="balance") = y + resistance*w;
equation
  tau*der(w) = a - w;
end second_rc;
"#,
    parameters: &[
        (
            "resistance",
            Role::Size,
            Starts::BalancesPerWidth(&[0.05, -0.05]),
        ),
        (
            "tau",
            Role::Shape,
            Starts::Durations(&[0.003, 0.01, 0.03, 0.1, 0.3]),
        ),
    ],
    physics: "A voltage builds up behind the current with a separate time constant: slow diffusion next to a fast reaction.",
    confused_with: &["series_resistance(y,i)", "hidden_state(x)", "lag(y)"],
    confirm: "Switch the current off and watch the voltage recover: are there two time constants?",
    symptoms: &["voltage recovers slowly", "two time constants"],
};
