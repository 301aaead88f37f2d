//! `coulomb(v)`: dry friction.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "coulomb",
    place: Place::Motion,
    text: r#"
model coulomb
  input Real x;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  constant Real slow(unit="signal") = 0.002*width "speed from which all of it is there";
  parameter Real friction(unit="balance", min=0, max=10*balance) = 0 "dry friction";
  output Real v(unit="balance") = -friction*min(max(x/slow, -1), 1);
end coulomb;
"#,
    parameters: &[("friction", Role::Size, Starts::Balances(&[0.03, 0.2]))],
    physics: "Dry friction: a force against the motion that has the same size at any speed.",
    confused_with: &["dead_zone(u)", "backlash(u)", "stribeck(v)"],
    confirm: "Raise the force slowly from zero and note where the motion begins; repeat in the other direction.",
    symptoms: &["sticks", "stops early", "does not start"],
};
