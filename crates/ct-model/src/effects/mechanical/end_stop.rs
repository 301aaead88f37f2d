//! `end_stop(v,x)`: the motion ends at a stop.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "end_stop",
    place: Place::MotionAndPosition,
    text: r#"
model end_stop
  input Real x;
  input Real a;
  constant Real balance(unit="balance") = 1;
  constant Real low(unit="signal") = 0;
  constant Real high(unit="signal") = 1;
  constant Real width(unit="signal") = 1;
  constant Real interval(unit="time") = 1;
  final parameter Real side(min=-1, max=1) = 1 "1: not above the stop, -1: not below it";
  parameter Real bound(unit="port", min=low - width, max=high + width) = high + width "position of the stop";
  parameter Real stiffness(unit="balance/port", min=balance/width, max=10000*balance/width) = 100*balance/width "of the stop";
  parameter Real damping(unit="time", min=0, max=1000*interval) = interval "damping of the stop over its stiffness";
  Real into(unit="port") = side*(x - bound);
  output Real v(unit="balance") = if into > 0 and into + damping*side*a > 0 then -side*stiffness*(into + damping*side*a) else 0;
end end_stop;
"#,
    parameters: &[
        ("side", Role::Choice, Starts::Values(&[1.0, -1.0])),
        (
            "bound",
            Role::Threshold,
            Starts::Quantiles(&[0.97, 0.9, 0.8, 0.65, 0.35, 0.2, 0.1, 0.03]),
        ),
        ("stiffness", Role::Shape, Starts::BalancesPerWidth(&[100.0])),
        ("damping", Role::Shape, Starts::Intervals(&[1.0])),
    ],
    physics: "An end stop: beyond its position it pushes back, and it takes energy from the impact.",
    confused_with: &["limit(x)", "saturation(y)", "nonlinearity(y)"],
    confirm: "Move it by hand through its travel and note where it stops.",
    symptoms: &["end stop", "hits a stop", "bounces", "stays at a value"],
};
