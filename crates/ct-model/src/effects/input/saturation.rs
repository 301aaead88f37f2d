//! `saturation(u)`: more of the input has no more effect.

use crate::effects::{Effect, Place, Role, Starts};

pub(in crate::effects) const EFFECT: Effect = Effect {
    id: "saturation",
    place: Place::Input,
    text: r#"
model saturation
  input Real u;
  constant Real low(unit="signal") = 0;
  constant Real high(unit="signal") = 1;
  constant Real width(unit="signal") = 1;
  final parameter Real side(min=-1, max=1) = 1 "1: not above the limit, -1: not below it, 0: neither above it nor below minus it";
  parameter Real limit(unit="port", min=low - width, max=high + width) = high + width "limit of what takes effect";
  output Real v(unit="port") = if side*side < 0.5 then min(max(u, -abs(limit)), abs(limit)) else if side*(u - limit) > 0 then limit else u;
end saturation;
"#,
    parameters: &[
        ("side", Role::Choice, Starts::Sides),
        (
            "limit",
            Role::Threshold,
            Starts::Quantiles(&[0.97, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1, 0.03]),
        ),
    ],
    physics: "The actuator cannot give more than a limit, or less than one, within the range of the command; or its limit is the same in both directions.",
    confused_with: &["nonlinearity(u)", "limit(x)"],
    confirm: "Step the input near the end of its range: does the plant still respond?",
    symptoms: &[
        "no more above a value",
        "clipped",
        "full power reached early",
    ],
};
