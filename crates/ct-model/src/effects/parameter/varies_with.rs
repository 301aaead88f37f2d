//! `varies_with(p,x)`: a parameter depends on a state or an input.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "varies_with",
    place: Place::ParameterAndSignal,
    text: r#"
model varies_with
  input Real p;
  input Real x;
  constant Real middle(unit="signal") = 0;
  constant Real width(unit="signal") = 1;
  parameter Real change(unit="1", min=-3, max=3) = 0 "relative change over the visited range";
  output Real v(unit="value") = p*(1 + change*(x - middle)/width);
end varies_with;
"#,
    parameters: &[(
        "change",
        Role::Size,
        Starts::Values(&[0.1, -0.1, 0.4, -0.4]),
    )],
    physics: "The parameter is not constant but rises or falls with the signal: a conductivity with the temperature, an area with the level.",
    confused_with: &["nonlinearity(u)", "nonlinearity(y)", "loss(x)"],
    confirm: "Estimate the parameter from records at a low and at a high value of the signal.",
    symptoms: &["depends on the operating point", "right at one level only"],
};
