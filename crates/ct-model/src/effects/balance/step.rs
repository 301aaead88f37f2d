//! `step(x)`: a flow that begins at an unknown time.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "step",
    place: Place::Balance,
    text: r#"
model step
  constant Real balance(unit="balance") = 1;
  constant Real begin(unit="time") = 0;
  constant Real duration(unit="time") = 1;
  parameter Real amount(unit="balance", min=-10*balance, max=10*balance) = 0 "what flows in from then on";
  parameter Real since(unit="time", min=begin, max=begin + duration) = begin + 0.5*duration "when it begins";
  output Real v(unit="balance") = if time >= since then amount else 0;
end step;
"#,
    parameters: &[
        ("amount", Role::Size, Starts::Balances(&[0.05, -0.05])),
        (
            "since",
            Role::Shape,
            Starts::Times(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]),
        ),
    ],
    physics: "From some time on an additional constant flow enters or leaves: a door, a valve or a consumer was opened and stays open.",
    confused_with: &["step(p)", "drift(p)", "drift(y)"],
    confirm: "Look into the log for that time: what was switched, opened or replaced?",
    symptoms: &["different since", "jumped", "something was opened"],
};
