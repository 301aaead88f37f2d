//! `limit(x)`: the state stops at a bound.

use crate::effects::domain::Quantity;
use crate::effects::{Effect, EffectText, Place, Role, Starts};

pub(in crate::effects) const EFFECT: Effect = Effect {
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

/// The effect in the terms of the state's physical domain.
pub(in crate::effects) fn text_of(state: Quantity) -> EffectText {
    let (physics, confirm) = match state {
        Quantity::Level => (
            "The level does not go beyond a bound: the tank overflows at a rim or an outlet.",
            "Fill the tank to the bound: does it overflow?",
        ),
        Quantity::Position => (
            "The position does not go beyond a bound: an end stop.",
            "Move it to the bound by hand: does it hit a stop?",
        ),
        Quantity::Temperature => (
            "The temperature does not go beyond a bound: a thermostat or a cut-out switches, or the material melts or boils.",
            "Heat or cool it to the bound: does a thermostat or a cut-out switch?",
        ),
        Quantity::Other => (
            "The state does not go beyond a bound: it is limited, or switched off there.",
            "Drive the state to the bound: does it stay there, or is something switched off?",
        ),
    };
    EffectText { physics, confirm }
}
