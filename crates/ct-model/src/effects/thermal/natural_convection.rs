//! `natural_convection(T,Ta)`: heat loss to air by natural convection.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "natural_convection",
    place: Place::BalanceAndSurrounding,
    text: r#"
model natural_convection
  input Real x;
  input Real a;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real exchange(unit="balance/port", min=0, max=10*balance/width) = 0 "exchange per unit of difference, where this is the visited range";
  output Real v(unit="balance") = -exchange*(x - a)*(abs(x - a)/width)^0.25;
end natural_convection;
"#,
    parameters: &[(
        "exchange",
        Role::Size,
        Starts::BalancesPerWidth(&[0.1, 0.5]),
    )],
    physics: "Heat is lost to air that rises along the surface: the loss is proportional to the temperature difference to the power of 1.25.",
    confused_with: &["radiation(T,Ta)", "varies_with(p,x)", "loss(x)"],
    confirm: "Turn the surface upside down or blow air along it: the loss changes.",
    symptoms: &["loses more when hot", "draught"],
};
