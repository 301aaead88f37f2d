//! `evaporation(T,Ta)`: heat loss by evaporation.

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
  constant Real rise(unit="signal") = 17 "the vapour pressure of water rises by a factor of e";
  parameter Real flow_at_middle(unit="balance", min=0, max=10*balance) = 0 "loss where the temperature is in the middle of its range";
  output Real v(unit="balance") = -flow_at_middle*(exp((x - middle)/rise) - exp((a - middle)/rise));
end evaporation;
"#,
    parameters: &[("flow_at_middle", Role::Size, Starts::Balances(&[0.05, 0.3]))],
    physics: "Water evaporates and takes heat with it, in proportion to the difference of the vapour pressures, which rise steeply with temperature.",
    confused_with: &["radiation(T,Ta)", "varies_with(p,x)"],
    confirm: "Cover the surface with a lid or a film of oil, and repeat a hot run.",
    symptoms: &["loses much more when hot", "steam", "level sinks"],
};
