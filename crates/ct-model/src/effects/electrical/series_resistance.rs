//! `series_resistance(y,i)`: a resistance between the modelled voltage and the terminals.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "series_resistance",
    place: Place::Terminal,
    text: r#"
model series_resistance
  input Real y;
  input Real a;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real resistance(unit="balance/port", min=-10*balance/width, max=10*balance/width) = 0 "of a sign that the current's decides";
  output Real v(unit="balance") = y + resistance*a;
end series_resistance;
"#,
    parameters: &[(
        "resistance",
        Role::Size,
        Starts::BalancesPerWidth(&[0.05, -0.05]),
    )],
    physics: "Cables and contacts drop a voltage in proportion to the current.",
    confused_with: &["second_rc(y,i)", "input_to(u,x)"],
    confirm: "Measure the voltage at the terminals themselves, with leads that carry no current.",
    symptoms: &["voltage drops at once with the current", "bad contact"],
};
