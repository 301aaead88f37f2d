//! `quadratic_drag(v)`: drag with the square of the speed.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "quadratic_drag",
    place: Place::Motion,
    text: r#"
model quadratic_drag
  input Real x;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real drag(unit="balance", min=0, max=20*balance) = 0 "drag at a speed of the visited range";
  output Real v(unit="balance") = -drag*(x/width)*abs(x/width);
end quadratic_drag;
"#,
    parameters: &[("drag", Role::Size, Starts::Balances(&[0.1, 0.5]))],
    physics: "Drag of air or liquid: a force against the motion, in proportion to the square of the speed.",
    confused_with: &["loss(x)", "varies_with(p,x)"],
    confirm: "Let it coast from a high speed: it slows down fast at high speed and ever more slowly at low speed.",
    symptoms: &["slower than expected at high speed", "fan", "air drag"],
};
