//! `dead_zone(u)`: nothing happens below a threshold.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "dead_zone",
    place: Place::Input,
    text: r#"
model dead_zone
  input Real u;
  constant Real high(unit="signal") = 1;
  constant Real low(unit="signal") = 0;
  parameter Real threshold(unit="port", min=0, max=max(abs(low), abs(high))) = 0 "size of the input below which nothing happens";
  output Real v(unit="port") = u - min(max(u, -threshold), threshold);
end dead_zone;
"#,
    parameters: &[(
        "threshold",
        Role::Threshold,
        Starts::Magnitudes(&[0.1, 0.3, 0.5, 0.75]),
    )],
    physics: "The actuator does nothing until the command exceeds a threshold, of either sign: friction, a valve's overlap, a pump's starting voltage.",
    confused_with: &["constant(x)", "nonlinearity(u)", "backlash(u)"],
    confirm: "Raise the input slowly from zero and note where something begins to happen.",
    symptoms: &[
        "does not react to small commands",
        "starts late",
        "sticks at zero",
    ],
};
