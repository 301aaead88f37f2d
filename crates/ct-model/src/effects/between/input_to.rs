//! `input_to(u,x)`: an input that also acts on another balance.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "input_to",
    place: Place::InputAndBalance,
    text: r#"
model input_to
  input Real u;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real gain(unit="balance/port", min=-10*balance/width, max=10*balance/width) = 0 "what the input adds, per unit";
  output Real v(unit="balance") = gain*u;
end input_to;
"#,
    parameters: &[("gain", Role::Size, Starts::BalancesPerWidth(&[0.1, -0.1]))],
    physics: "The input acts on this balance too: heat that spills over, a force on a neighbour, sun on a wall.",
    confused_with: &["coupling(x1,x2)", "constant(x)"],
    confirm: "Step this input alone, and watch the state that it should not reach.",
    symptoms: &["reacts to the wrong input", "cross-talk"],
};
