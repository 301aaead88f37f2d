//! `nonlinearity(u)`: a parabola over the visited range.

use crate::effects::{Effect, Place, Role, Starts};

pub(in crate::effects) const EFFECT: Effect = Effect {
    id: "nonlinearity",
    place: Place::Input,
    text: r#"
model nonlinearity
  input Real u;
  constant Real low(unit="signal") = 0;
  constant Real high(unit="signal") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real bend(unit="1", min=-2, max=2) = 0 "largest deviation from the straight line, as a share of the range";
  output Real v(unit="port") = u + bend*4*(u - low)*(high - u)/width;
end nonlinearity;
"#,
    parameters: &[(
        "bend",
        Role::Size,
        Starts::Values(&[0.05, -0.05, 0.2, -0.2]),
    )],
    physics: "The output of the actuator is not linear in the command: a parabola through both ends of the visited range.",
    confused_with: &["dead_zone(u)", "saturation(u)", "varies_with(p,u)"],
    confirm: "Hold the input at five levels over its range and plot the steady-state output.",
    symptoms: &["gain depends on the level", "curved characteristic"],
};
