//! `evaporation(T,Ta)`: heat loss by evaporation.
//!
//! **Reference**: F. W. Murray, J. Applied Meteorology 6 (1967) 203-204 (the vapour pressure of water in its Magnus form,
//! `6.1078 hPa exp(17.27 t/(t + 237.3))`, t in degC).

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "evaporation",
    place: Place::BalanceAndSurrounding,
    text: r#"
model evaporation
  input Real x;
  input Real a;
  constant Real balance(unit="balance") = 1;
  constant Real middle(unit="signal") = 0;
  constant Real zero(unit="signal") = 273.15 "zero of the unit above absolute zero";
  constant Real pole(unit="signal") = 35.85 "temperature in the Magnus form, above absolute zero";
  constant Real rise(unit="signal") = 4098 "the vapour pressure rises by the share rise/(T - pole)^2 per degree";
  parameter Real flow_at_middle(unit="balance", min=0, max=10*balance) = 0 "loss to dry air where the temperature is in the middle of its range";
  parameter Real humidity(unit="1", min=0, max=1) = 0.5 "relative humidity of the air";
  Real at_middle = rise/(middle + zero - pole);
  output Real v(unit="balance") = -flow_at_middle*(exp(at_middle - rise/(x + zero - pole)) - humidity*exp(at_middle - rise/(a + zero - pole)));
end evaporation;
"#,
    parameters: &[
        ("flow_at_middle", Role::Size, Starts::Balances(&[0.05, 0.3])),
        ("humidity", Role::Shape, Starts::Values(&[0.3, 0.8])),
    ],
    physics: "Water evaporates and takes heat with it, in proportion to the difference of the vapour pressures at the surface and in the air, which rise steeply with temperature.",
    confused_with: &["radiation(T,Ta)", "varies_with(p,x)"],
    confirm: "Cover the surface with a lid or a film of oil, and repeat a hot run.",
    symptoms: &["loses much more when hot", "steam", "level sinks"],
};
