//! `curved_reading(y)`: the sensor of a level is right when the tank is empty and at the highest level. Unlike `nonlinearity(y)`, whose
//! ends are those of the visited range, it has its zero where the level has.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "curved_reading",
    place: Place::LevelReading,
    text: r#"
model curved_reading
  input Real y;
  constant Real high(unit="signal") = 1;
  parameter Real bend(unit="1", min=-0.5, max=0.5) = 0 "curvature: above zero the reading bends upwards";
  output Real v(unit="port") = y + bend*y*(y/high - 1);
end curved_reading;
"#,
    parameters: &[(
        "bend",
        Role::Size,
        Starts::Values(&[0.02, -0.02, 0.2, -0.2]),
    )],
    physics: "The reading of the level is not linear: it is right when the tank is empty and at the highest level.",
    confused_with: &["nonlinearity(y)", "offset(y)", "nonlinearity(u)"],
    confirm: "Compare the sensor with a rule at five levels: are the differences largest in the middle?",
    symptoms: &["calibration error", "right when empty and full"],
};
