//! Sentences of a few typical results.

use missing_effect::{ControlLoop, NotNoise, NotSimulated, Remark, Verdict};

use super::of_diagnosis;
use crate::report::sample;

#[test]
fn effects_come_first_with_size_and_alternatives() {
    let said = of_diagnosis(&sample::two_tanks());
    assert_eq!(
        said[0],
        "It is overflow in the upper tank (rim = 7.500 ± 0.034 V)."
    );
    assert!(
        said[1].starts_with(
            "It is pump_deadzone or pump_nonlinearity: these data cannot tell them apart; pump_deadzone (u_dz = 0.550 ± 0.027 V) fits best."
        ),
        "{}",
        said[1]
    );
    assert!(said[2].starts_with("The simulation error falls from "));
}

#[test]
fn a_comparison_says_what_the_residual_shows() {
    let mut compared = sample::comparison();
    compared.not_noise = Some(NotNoise::Slow {
        output: compared.outputs[0].clone(),
        correlation_time: f64::INFINITY,
        time_constant: 140.0,
    });
    let [said] = &of_diagnosis(&compared)[..] else {
        panic!("{:?}", of_diagnosis(&compared));
    };
    assert!(
        said.starts_with("The model does not explain the data: the residual of ")
            && said.ends_with(
                "drifts: its correlation time of longer than the record reaches the slowest time constant, 140 s; it may be a disturbance or an effect that the model lacks."
            ),
        "{said}"
    );
}

#[test]
fn an_abrupt_change_names_its_output_and_its_time() {
    let mut found = sample::two_outputs();
    found.verdict = Verdict::Unexplained;
    found.not_noise = Some(NotNoise::Instant {
        output: found.outputs[1].clone(),
        record: found.records[0].name.clone(),
        from: 488.0,
        to: 552.0,
    });
    let said = of_diagnosis(&found);
    let start = format!(
        "Something is missing, and nothing in the catalogue explains it: the residual of {} of ",
        found.outputs[1]
    );
    assert!(said[0].starts_with(&start), "{}", said[0]);
    assert!(
        said[0].contains("has an abrupt change, from 488 to 552 s, which noise does not explain"),
        "{}",
        said[0]
    );
}

#[test]
fn remarks_follow_the_verdict_in_their_order() {
    let mut found = sample::two_tanks();
    found.remarks = vec![
        Remark::Quantisation {
            output: found.outputs[0].clone(),
            step: 0.3,
            share: 0.5,
        },
        Remark::EffectLimit { most: 1, needed: 2 },
        Remark::ColouredNoise { ratio: 2.34 },
    ];
    let said = of_diagnosis(&found);
    let position = |start: &str| said.iter().position(|said| said.starts_with(start));
    let rounding = position(
        "Nearly all readings are multiples of 0.300 V: rounding alone makes an error of 0.087 V rms, 50 % of",
    );
    let stopped = position("The search was stopped at 1 effect: the data call for 2.");
    let coloured = position("The noise is coloured: an effect has to be about 2.3 times larger");
    assert!(
        rounding.is_some() && rounding < stopped && stopped < coloured,
        "{said:?}"
    );
}

#[test]
fn a_loop_that_is_not_simulated_says_why() {
    let mut found = sample::comparison();
    let mut last = |why: NotSimulated, mismatch: Option<f64>| {
        found.control_loop = Some(ControlLoop {
            simulated: false,
            feedback_p: None,
            mismatch,
            not_simulated: Some(why),
        });
        of_diagnosis(&found).pop().unwrap_or_default()
    };
    let record = "rig".to_string();
    for (why, mismatch, parts) in [
        (
            NotSimulated::AsRequested,
            None,
            ["as was asked for", "The model runs on the measured command"],
        ),
        (
            NotSimulated::NoReference {
                record: record.clone(),
            },
            None,
            ["rig: the record holds no reference", "[columns]"],
        ),
        (
            NotSimulated::ConstantReference {
                record,
                value: 16.0,
            },
            None,
            ["reference stays at 16", "set point changes"],
        ),
        (
            NotSimulated::OtherController { share: 0.3 },
            Some(0.25),
            [
                "R/S (r - y), by 0.250 V rms, 30 % of what it moves",
                "check gain",
            ],
        ),
    ] {
        let said = last(why, mismatch);
        for part in parts {
            assert!(said.contains(part), "{said}");
        }
    }
}
