//! `radiation(T,Ta)`: heat exchanged by radiation.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "radiation",
    place: Place::BalanceAndSurrounding,
    text: r#"
model radiation
  input Real x;
  input Real a;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  constant Real zero(unit="signal") = 273.15 "zero of the unit above absolute zero";
  constant Real reference(unit="signal") = 293.15;
  parameter Real exchange(unit="balance/port", min=0, max=10*balance/width) = 0 "exchange per unit of difference, at 20 degC";
  output Real v(unit="balance") = -exchange*reference/4*(((x + zero)/reference)^4 - ((a + zero)/reference)^4);
end radiation;
"#,
    parameters: &[(
        "exchange",
        Role::Size,
        Starts::BalancesPerWidth(&[0.1, 0.5]),
    )],
    physics: "Heat is lost by radiation: the loss is proportional to the difference of the fourth powers of the absolute temperatures.",
    confused_with: &["natural_convection(T,Ta)", "varies_with(p,x)", "loss(x)"],
    confirm: "Cover the surface with foil and repeat a hot run.",
    symptoms: &["loses more when hot", "cools faster at high temperature"],
};
