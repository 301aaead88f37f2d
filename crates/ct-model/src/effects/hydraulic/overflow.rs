//! `overflow(h1,h2)`: water over the rim flows into the tank below.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "overflow",
    place: Place::TankAndTankBelow,
    text: r#"
model overflow
  input Real x1;
  constant Real balance(unit="balance") = 1;
  constant Real high(unit="signal") = 1;
  constant Real low(unit="signal") = 0;
  constant Real width(unit="signal") = 1;
  constant Real steepness = 300 "spill one width above the rim, in largest terms of the balance";
  parameter Real rim(unit="port", min=low - width, max=high + width) = high + width "height of the rim";
  output Real v(unit="balance") = steepness*balance*max((x1 - rim)/width, 0);
end overflow;
"#,
    parameters: &[(
        "rim",
        Role::Threshold,
        Starts::Quantiles(&[0.97, 0.9, 0.8, 0.65, 0.5, 0.35]),
    )],
    physics: "The tank is full: further inflow spills over the rim, into the tank below.",
    confused_with: &["limit(h)", "saturation(y)", "leak_at_height(h)"],
    confirm: "Fill the upper tank and watch whether it overflows.",
    symptoms: &["overflows", "spills into the tank below"],
};
