//! Sentences of a few typical results.

use ct_signals::Gaps;
use linear_identification::side_by_side::Violation;
use linear_identification::{Method, Order, Warning};
use missing_effect::{
    ControlLoop, MendedGaps, NoiseSource, NotNoise, NotSimulated, PerOutput, Remark, Verdict,
};

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
            "It is pump_deadzone or pump_nonlinearity: these data do not distinguish them; pump_deadzone (u_dz = 0.550 ± 0.027 V) fits best."
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
                "drifts: its correlation time (longer than the record) exceeds the slowest time constant of the model (140 s); it may be a disturbance or an effect that the model lacks."
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
    let stopped = position("The search was stopped at 1 effect: the data require 2.");
    let coloured = position("The noise is coloured: an effect has to be about 2.3 times larger");
    assert!(
        rounding.is_some() && rounding < stopped && stopped < coloured,
        "{said:?}"
    );
}

/// All kinds of remarks at once: what was refused precedes the held-out error, the loop is last.
#[test]
fn the_order_of_remarks_does_not_depend_on_that_of_the_values() {
    let mut found = sample::two_tanks();
    let name = found.outputs[0].clone();
    found.remarks = vec![
        Remark::ColouredNoise { ratio: 2.34 },
        Remark::Terms {
            names: vec!["spill".to_string()],
        },
        Remark::EffectLimit { most: 2, needed: 3 },
        Remark::ReplacedByTime {
            effects: vec!["pump_gain_drift".to_string()],
        },
        Remark::BestPart {
            effects: vec!["overflow".to_string()],
            rmse_per_output: PerOutput(vec![(name.clone(), 0.2)]),
        },
        Remark::Quantisation {
            output: name,
            step: 0.3,
            share: 0.5,
        },
    ];
    if let Some(last) = found.steps.last_mut() {
        last.weighted_rmse_test = Some(3.0 * last.weighted_rmse);
    }
    found.control_loop = Some(ControlLoop {
        simulated: true,
        needed: false,
        feedback_p: None,
        mismatch: Some(0.0123),
        not_simulated: None,
    });
    let said = of_diagnosis(&found);
    let position = |part: &str| {
        let at = said.iter().position(|said| said.contains(part));
        at.unwrap_or_else(|| panic!("{part}: {said:#?}"))
    };
    let order = [
        position("multiples of 0.300 V"),
        position("pump_gain_drift would explain more, but so would a function of time"),
        position(
            "The best significant effect, apart from functions of time, is overflow, with a residual of 0.200 V rms",
        ),
        position("On held-out data the simulation error is 3.0 times as large"),
        position("The noise is coloured"),
        position("With spill in the model the standard errors are too small"),
        position("The search was stopped at 2 effects"),
        position("The loop is simulated from its reference"),
    ];
    assert!(order.is_sorted(), "{order:?}: {said:#?}");
    assert!(said[order[7]].contains("by 0.0123 V rms"));
}

/// A result that an earlier version wrote has no reason.
#[test]
fn a_loop_without_a_reason_is_not_called_simulated() {
    let mut found = sample::comparison();
    found.control_loop = Some(ControlLoop {
        simulated: false,
        needed: false,
        feedback_p: None,
        mismatch: None,
        not_simulated: None,
    });
    let said = of_diagnosis(&found).pop().unwrap_or_default();
    assert!(said.starts_with("The loop is not simulated."), "{said}");
}

#[test]
fn a_loop_that_is_not_simulated_says_why() {
    let mut found = sample::comparison();
    let mut last = |why: NotSimulated, mismatch: Option<f64>| {
        found.control_loop = Some(ControlLoop {
            simulated: false,
            needed: false,
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
            ["as requested", "The model runs on the measured command"],
        ),
        (
            NotSimulated::MissingReadings {
                record: record.clone(),
            },
            None,
            ["readings are missing in rig", "cannot be checked"],
        ),
        (
            NotSimulated::UnknownController {
                lags: 3,
                input: None,
            },
            None,
            [
                "the command depends on the last 3 residuals",
                "no [controller]",
            ],
        ),
        (
            NotSimulated::UnknownController {
                lags: 7,
                input: Some("u2".to_string()),
            },
            None,
            [
                "Feedback detected: u2 depends on the last 7 residuals",
                "no [controller.u2]",
            ],
        ),
        (
            NotSimulated::DirectTerm {
                output: "v".to_string(),
                input: "i".to_string(),
            },
            None,
            ["v depends on i without a state in between", "reads it"],
        ),
        (
            NotSimulated::HardNonlinearity {
                of: "u".to_string(),
            },
            None,
            ["a hard nonlinearity of u acts", "needs a linear plant"],
        ),
        (
            NotSimulated::Unstable { radius: Some(1.25) },
            None,
            ["an eigenvalue of magnitude 1.250", "check its sign"],
        ),
        (
            NotSimulated::ModelError {
                output: "y2".to_string(),
                change: -0.031,
            },
            None,
            ["the error at y2 would change by -3.1 %", "lacks an effect"],
        ),
        (
            NotSimulated::CommandNotHeld {
                record: record.clone(),
            },
            None,
            ["The loop is not simulated: rig", "linear between samples"],
        ),
        (
            NotSimulated::NoReference {
                record: record.clone(),
            },
            None,
            ["rig: the record has no reference", "[columns]"],
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
                "R/S (r - y), by 0.250 V rms, 30 % of its variation",
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

/// There is no order below the first: then faster sampling is advised.
#[test]
fn a_lower_order_is_advised_where_there_is_one() {
    let said = |lower| {
        super::of_warning(&Warning::BelowStep {
            time_constant: 0.5,
            step: 2.0,
            lower,
        })
    };
    let first = said(Some(Order { n: 1, m: 0 }));
    assert!(
        first.starts_with("the fastest time constant, 0.50 s, is below the longest step of 2 s: ")
            && first.ends_with("; try --order 1,0"),
        "{first}"
    );
    assert!(said(None).ends_with("; sample faster"), "{}", said(None));
}

#[test]
fn a_parameter_that_may_be_zero_has_its_relative_error() {
    let said = |lower| {
        super::of_warning(&Warning::NotSignificant {
            parameter: "b0_2".to_string(),
            value: -0.5,
            std_error: 0.3,
            lower,
        })
    };
    let start =
        "b0_2 is not significantly different from 0: its standard error is 60 % of its value; ";
    assert_eq!(
        said(None),
        format!("{start}try a lower --order, or leave out its input or term")
    );
    assert_eq!(
        said(Some(Order { n: 2, m: 1 })),
        format!("{start}try --order 2,1")
    );
}

#[test]
fn an_error_above_the_least_has_its_reason_by_method() {
    let worse = Violation::WorseThanLeast {
        rmse: 0.3,
        least: 0.2,
    };
    assert_eq!(
        super::of_violation(&worse, Method::Ls),
        "its error is 50 % above the least of this order: noise may bias it"
    );
    assert!(
        super::of_violation(&worse, Method::Fcloe).ends_with("or of this order"),
        "{worse:?}"
    );
}

#[test]
fn gaps_are_counted_with_the_longest_hold() {
    let mut mended = MendedGaps {
        gaps: Gaps::default(),
        time_constant: 100.0,
        limit: 10.0,
    };
    assert_eq!(super::of_gaps(&mended), None);
    mended.gaps = Gaps {
        rows: 12,
        places: 3,
        held: 2,
        cut: 1,
        unused: 1,
        longest_hold: 8.0,
    };
    assert_eq!(
        super::of_gaps(&mended).unwrap_or_default(),
        "12 rows are missing in 3 places; the input is held through 2 of them, for at most 8 s; the simulation restarts after 1, where the input would have to be held longer than 10 % of the fastest time constant (100 s); 1 row is not used."
    );
    // Of a model that only integrates, and without a first fit.
    for (time_constant, limit) in [
        (f64::INFINITY, "longer than 10 s; 1 row"),
        (
            f64::NAN,
            "longer than 10 s: no fastest time constant was found, which would permit a longer hold; 1 row",
        ),
    ] {
        mended.time_constant = time_constant;
        let said = super::of_gaps(&mended).unwrap_or_default();
        assert!(said.contains(limit), "{said}");
    }
}

#[test]
fn a_noise_floor_names_the_residual_that_it_is_from() {
    let mut floor = sample::comparison().noise.remove(0);
    floor.source = NoiseSource::RichestModel;
    assert_eq!(
        super::of_noise_source(&floor),
        "the residual of the richest model that was tried"
    );
    (floor.source, floor.of_innovation) = (NoiseSource::OnlyModel, true);
    assert_eq!(
        super::of_noise_source(&floor),
        "innovation of the residual: the part that its past does not predict"
    );
}
