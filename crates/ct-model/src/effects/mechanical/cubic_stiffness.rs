//! `cubic_stiffness(v,x)`: a spring that hardens or softens.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "cubic_stiffness",
    place: Place::Spring,
    text: r#"
model cubic_stiffness
  input Real x;
  constant Real balance(unit="balance") = 1;
  constant Real low(unit="signal") = 0;
  constant Real high(unit="signal") = 1;
  constant Real middle(unit="signal") = 0;
  constant Real width(unit="signal") = 1;
  parameter Real force(unit="balance", min=-100*balance, max=100*balance) = 0 "back to the rest, at a distance as large as the visited range";
  parameter Real rest(unit="port", min=low - width, max=high + width) = middle "position without this force";
  output Real v(unit="balance") = -force*((x - rest)/width)^3;
end cubic_stiffness;
"#,
    parameters: &[
        ("force", Role::Size, Starts::Balances(&[0.3, -0.3])),
        ("rest", Role::Shape, Starts::Range(&[0.3, 0.5, 0.7])),
    ],
    physics: "A spring that hardens or softens: a force back to a position, or away from it, in proportion to the cube of the distance.",
    confused_with: &["end_stop(v,x)", "nonlinearity(y)", "varies_with(p,x)"],
    confirm: "Load it with known weights on both sides of its position at rest, and plot the position against the weight.",
    symptoms: &[
        "hardening spring",
        "softening spring",
        "stiffer at large amplitude",
        "resonance shifts with the amplitude",
    ],
};
