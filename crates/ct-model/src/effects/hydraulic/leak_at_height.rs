//! `leak_at_height(h)`: a hole in the wall, above the outlet. Torricelli's law, with laminar flow for heads below a hundredth of the
//! visited range: an infinite slope would make the derivative with respect to the height depend on the steps.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "leak_at_height",
    place: Place::Level,
    text: r#"
model leak_at_height
  input Real x;
  constant Real balance(unit="balance") = 1;
  constant Real low(unit="signal") = 0;
  constant Real high(unit="signal") = 1;
  constant Real width(unit="signal") = 1;
  parameter Real leak(unit="balance", min=0, max=20*balance) = 0 "outflow through it with the visited range above it";
  parameter Real height(unit="port", min=low - width, max=high) = 0.5*(low + high) "of the hole";
  Real head = max((x - height)/width, 0);
  output Real v(unit="balance") = -leak*head/sqrt(head + 0.0001);
end leak_at_height;
"#,
    parameters: &[
        ("leak", Role::Size, Starts::Balances(&[0.1, 0.5])),
        (
            "height",
            Role::Shape,
            Starts::Quantiles(&[0.9, 0.75, 0.5, 0.25, 0.1]),
        ),
    ],
    physics: "A hole in the wall or a second outlet: liquid above its height leaves according to Torricelli's law.",
    confused_with: &["limit(h)", "varies_with(p,h)", "loss(h)"],
    confirm: "Fill the tank with the outlet closed: does the level fall, and where does it stop?",
    symptoms: &[
        "leaks above a level",
        "empties faster when full",
        "hole in the wall",
    ],
};
