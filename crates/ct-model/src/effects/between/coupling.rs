//! `coupling(x1,x2)`: a flow in proportion to a difference.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "coupling",
    place: Place::States,
    text: r#"
model coupling
  input Real x1;
  input Real x2;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real conductance(unit="balance/port", min=-10*balance/width, max=10*balance/width) = 0 "flow per unit of difference";
  output Real v(unit="balance") = conductance*(x1 - x2);
end coupling;
"#,
    parameters: &[(
        "conductance",
        Role::Size,
        Starts::BalancesPerWidth(&[0.05, 0.3]),
    )],
    physics: "A flow from one state to the other in proportion to their difference: a leak between vessels, a thermal bridge.",
    confused_with: &["loss(x)", "varies_with(p,x)"],
    confirm: "Hold one state and change the other: does the first one follow?",
    symptoms: &["follows its neighbour", "thermal bridge", "leak between"],
};
