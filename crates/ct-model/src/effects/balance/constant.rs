//! `constant(x)`: an unknown constant flow.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "constant",
    place: Place::Balance,
    text: r#"
model constant_flow
  constant Real balance(unit="balance") = 1;
  parameter Real amount(unit="balance", min=-10*balance, max=10*balance) = 0 "what flows in all the time";
  output Real v(unit="balance") = amount;
end constant_flow;
"#,
    parameters: &[("amount", Role::Size, Starts::Balances(&[0.05, -0.05]))],
    physics: "A constant flow into or out of the balance is missing in the model: a leak, a load, a source.",
    confused_with: &["offset(y)", "dead_zone(u)", "loss(x)"],
    confirm: "Switch all inputs off and watch whether the state still changes.",
    symptoms: &["leak", "base load", "never quite balances"],
};
