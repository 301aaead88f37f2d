//! `periodic(x)`: a sine of unknown period.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "periodic",
    place: Place::Balance,
    text: r#"
model periodic
  constant Real balance(unit="balance") = 1;
  constant Real begin(unit="time") = 0;
  constant Real duration(unit="time") = 100;
  constant Real interval(unit="time") = 1;
  constant Real turn = 6.283185307179586;
  parameter Real sine(unit="balance", min=-10*balance, max=10*balance) = 0 "amplitude of the sine";
  parameter Real cosine(unit="balance", min=-10*balance, max=10*balance) = 0 "amplitude of the cosine";
  parameter Real period(unit="time", min=2*interval, max=0.5*duration) = 0.1*duration "period, two of which the record holds at least: what is longer is a trend";
  Real angle = turn*(time - begin)/period;
  output Real v(unit="balance") = sine*sin(angle) + cosine*cos(angle);
end periodic;
"#,
    parameters: &[
        ("sine", Role::Size, Starts::Balances(&[0.05])),
        ("cosine", Role::Size, Starts::Balances(&[0.05])),
        (
            "period",
            Role::Shape,
            Starts::Durations(&[
                0.4, 0.3, 0.2, 0.14, 0.1, 0.07, 0.05, 0.035, 0.025, 0.0175, 0.0125,
            ]),
        ),
    ],
    physics: "A term of the balance that varies with a fixed period: a load that switches on and off, the daily cycle, a rotating unbalance.",
    confused_with: &["hidden_state(x)"],
    confirm: "Log what runs nearby: what has this period?",
    symptoms: &["oscillates", "hum", "rhythm", "day and night"],
};
