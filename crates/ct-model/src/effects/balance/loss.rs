//! `loss(x)`: a loss in proportion to the state.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "loss",
    place: Place::Balance,
    text: r#"
model loss
  input Real x;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real coefficient(unit="balance/port", min=-10*balance/width, max=10*balance/width) = 0 "loss per unit of the state";
  output Real v(unit="balance") = -coefficient*x;
end loss;
"#,
    parameters: &[(
        "coefficient",
        Role::Size,
        Starts::BalancesPerWidth(&[0.05, -0.02]),
    )],
    physics: "Something is lost in proportion to the state: to the room, by friction, by decay.",
    confused_with: &["constant(x)", "varies_with(p,x)", "hidden_state(x)"],
    confirm: "Let the state decay from a high value with all inputs off, and compare the time constant.",
    symptoms: &["decays too fast", "loses more when high"],
};
