//! `overflow(h1,h2)`: liquid over the rim flows into the tank below, or a share of it; what misses that tank is lost. Both
//! equations are balances of volume, or the tanks have equal cross-sections.

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
  parameter Real share(min=0, max=1) = 1 "of the spill that reaches the tank below";
  output Real v(unit="balance") = steepness*balance*max((x1 - rim)/width, 0);
  output Real w(unit="balance") = share*v;
end overflow;
"#,
    parameters: &[
        (
            "rim",
            Role::Threshold,
            Starts::Quantiles(&[0.97, 0.9, 0.8, 0.65, 0.5, 0.35]),
        ),
        ("share", Role::Shape, Starts::Values(&[1.0, 0.5])),
    ],
    physics: "The tank is full: further inflow spills over the rim; all of it or a share reaches the tank below.",
    confused_with: &["limit(h)", "saturation(y)", "leak_at_height(h)"],
    confirm: "Fill the upper tank and watch whether it overflows.",
    symptoms: &["overflows", "spills into the tank below"],
};
