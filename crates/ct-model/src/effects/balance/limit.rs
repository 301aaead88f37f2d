//! `limit(x)`: the state stops at a bound.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "limit",
    place: Place::Balance,
    text: r#"
model limit
  input Real x;
  input Real rate;
  constant Real low(unit="signal") = 0;
  constant Real high(unit="signal") = 1;
  constant Real width(unit="signal") = 1;
  final parameter Real side(min=-1, max=1) = 1 "1: not above the bound, -1: not below it";
  parameter Real bound(unit="port", min=low - width, max=high + width) = high + width "where it stops";
  output Real v(unit="balance") = if side*(x - bound) >= 0 and side*rate > 0 then 0 else rate;
end limit;
"#,
    parameters: &[
        ("side", Role::Choice, Starts::Values(&[1.0, -1.0])),
        (
            "bound",
            Role::Threshold,
            Starts::Quantiles(&[0.97, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1, 0.03]),
        ),
    ],
    physics: "The state does not go beyond a bound: a rim, an end stop, a thermostat that cuts out.",
    confused_with: &["saturation(y)", "saturation(u)"],
    confirm: "Drive the state to the bound: does it overflow, hit a stop or cut out?",
    symptoms: &["overflows", "end stop", "stays at a value", "cuts out"],
};
