//! `stribeck(v)`: dry friction that is larger at rest.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "stribeck",
    place: Place::Motion,
    text: r#"
model stribeck
  input Real x;
  constant Real balance(unit="balance") = 1;
  constant Real width(unit="signal") = 1;
  constant Real slow(unit="signal") = 0.002*width "speed from which all of it is there";
  parameter Real friction(unit="balance", min=0, max=10*balance) = 0 "dry friction at speed";
  parameter Real more_at_rest(unit="balance", min=0, max=10*balance) = 0 "by how much it is larger at rest";
  parameter Real speed(unit="port", min=0.01*width, max=width) = 0.1*width "speed at which the larger part is gone";
  output Real v(unit="balance") = -(friction + more_at_rest*exp(-(x/speed)^2))*min(max(x/slow, -1), 1);
end stribeck;
"#,
    parameters: &[
        ("friction", Role::Size, Starts::Balances(&[0.05])),
        ("more_at_rest", Role::Size, Starts::Balances(&[0.05])),
        ("speed", Role::Shape, Starts::Widths(&[0.03, 0.1, 0.3])),
    ],
    physics: "Dry friction that falls as the motion begins: the motion alternates between sticking and slipping.",
    confused_with: &["coulomb(v)", "dead_zone(u)", "backlash(u)"],
    confirm: "Move it very slowly: does it stick and slip?",
    symptoms: &["stick-slip", "jerks", "breaks loose"],
};
