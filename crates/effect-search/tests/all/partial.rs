//! What is said of records whose error no effect explains whole.

use effect_search::{Diagnosis, Options, Problem, Thresholds, Verdict, diagnose};

use crate::hidden::block;
use crate::records::{BLOCK, STEP, found, problem, record};

fn with(problem: &Problem, thresholds: Thresholds) -> Diagnosis {
    let options = Options {
        thresholds,
        ..Options::default()
    };
    diagnose(problem, &options, &|_| {}).unwrap()
}

/// Names of the effects that depend on time only.
fn in_time(diagnosis: &Diagnosis) -> Vec<&String> {
    let names = ["step(", "drift(", "gain_drift(", "periodic("];
    let follows = |id: &&String| names.iter().any(|name| id.starts_with(name));
    diagnosis.effects.iter().filter(follows).collect()
}

/// The block forgets its initial temperature within a few rows: without the first quarter of the record nothing determines it, and a fit may
/// end at any value of it.
#[test]
fn an_initial_state_that_is_soon_forgotten_does_not_decide_the_cross_validation() {
    let fast = BLOCK.replace("C(unit=\"J/K\") = 50", "C(unit=\"J/K\") = 6");
    let hidden = fast.replace("g*u -", "g*u*(1 + 0.5*sin(u/3)) -");
    let options = Options {
        max_effects: 1,
        time_limit: None,
        ..Options::default()
    };
    let problem = problem(&fast, record(&hidden, 0.0, 0.1, 11));
    let diagnosis = diagnose(&problem, &options, &|_| {}).unwrap();
    let unknown = diagnosis.unknown.as_ref().unwrap();
    println!(
        "{:?} {:?} {} {:?}",
        diagnosis.verdict, diagnosis.groups, unknown.effect, unknown.share_left_out
    );
    assert_eq!(unknown.variable, "u");
    // With initial states far from any temperature it is zero or less.
    assert!(unknown.share_left_out.unwrap() > 0.9);
}

/// A sensor of second order, which no candidate is, while the losses rise: the drift may stand beside an effect that is a part of the sensor.
#[test]
fn one_function_of_time_may_be_a_part_of_the_answer_beside_another_effect() {
    let hidden = block("g*u - k*(1 + 0.3*time/2500)*(T - Ta)")
        .replace("= T;", "= s2;\n  Real s1(start=20);\n  Real s2(start=20);")
        .replace(
            "end Block",
            "  20*der(s1) = T - s1;\n  20*der(s2) = s1 - s2;\nend Block",
        );
    let diagnosis = found(&problem(BLOCK, record(&hidden, 0.0, 0.05, 3)));
    println!(
        "{:?} {:?} {:?}",
        diagnosis.verdict, diagnosis.groups, diagnosis.share
    );
    assert_eq!(diagnosis.verdict, Verdict::Partial);
    assert_eq!(in_time(&diagnosis), ["drift(k)"]);
    assert!(diagnosis.effects.len() > 1);
}

/// The room's temperature, which is believed constant, wanders: functions of time fit that, whatever it does.
#[test]
fn several_functions_of_time_are_no_answer() {
    let believed = block("g*u - k*(T - 15) + 0*Ta");
    let wander = "6*sin(0.0031*time) + 4*sin(0.0083*time + 1) + 3*sin(0.0147*time + 2)";
    let hidden = block(&format!("g*u - k*(T - 15 - {wander}) + 0*Ta"));
    let problem = problem(&believed, record(&hidden, 0.5, 0.3, 12));
    let many = with(
        &problem,
        Thresholds {
            functions_of_time: 99,
            ..Thresholds::DEFAULT
        },
    );
    assert!(in_time(&many).len() > 1, "{:?}", many.effects);
    let diagnosis = found(&problem);
    println!("{:?} {:?}", diagnosis.verdict, diagnosis.effects);
    assert!(matches!(
        diagnosis.verdict,
        Verdict::Unexplained | Verdict::Partial
    ));
    assert!(in_time(&diagnosis).len() < 2, "{:?}", diagnosis.effects);
}

/// The first rows still hold what was before the record: a sensor that was warmer. A step in time would fit them.
#[test]
fn a_function_of_time_does_not_stand_in_for_the_past() {
    let mut record = record(BLOCK, 0.8, 0.3, 13);
    for (k, y) in record.outputs[0].values.iter_mut().enumerate() {
        *y += 12.0 * (-STEP * k as f64 / 30.0).exp();
    }
    let problem = problem(BLOCK, record);
    let anywhere = with(
        &problem,
        Thresholds {
            beginning: 0.0,
            ..Thresholds::DEFAULT
        },
    );
    assert!(!in_time(&anywhere).is_empty(), "{:?}", anywhere.effects);
    let diagnosis = found(&problem);
    assert!(in_time(&diagnosis).is_empty(), "{:?}", diagnosis.effects);
}

/// A root of the noise model near the unit circle has another variance than the residual.
#[test]
fn the_noise_is_not_larger_than_the_residual() {
    for correlation in [0.0, 0.9, 0.995] {
        let diagnosis = found(&problem(BLOCK, record(BLOCK, correlation, 0.3, 14)));
        let last = diagnosis.steps.last().unwrap();
        let (level, residual) = (diagnosis.noise[0].level, last.rmse.unwrap());
        // The variance of innovations is estimated with fewer degrees of freedom than samples.
        assert!(level <= 1.02 * residual, "{level} {residual}");
    }
}

/// A residual test that rejects noise does not take a small effect away that passed the acceptance test.
#[test]
fn a_false_alarm_does_not_reduce_an_answer_to_a_part() {
    let hidden = block("g*max(u - 8, 0) - k*(1 + 0.00022*(T - 40))*(T - Ta)");
    let problem = problem(BLOCK, record(&hidden, 0.0, 0.3, 15));
    let whole = found(&problem);
    let [.., one, both] = whole.steps.as_slice() else {
        panic!("{:?}", whole.effects);
    };
    // A partial explanation leaves such a small effect out.
    let ratio = (both.rmse.unwrap() / one.rmse.unwrap()).powi(2);
    assert!(ratio > Thresholds::DEFAULT.partial_error, "{ratio}");
    let alarmed = with(
        &problem,
        Thresholds {
            function_chance: f64::INFINITY,
            ..Thresholds::DEFAULT
        },
    );
    assert_eq!(whole.effects.len(), 2);
    assert_eq!(alarmed.effects, whole.effects);
    assert_eq!(alarmed.verdict, Verdict::Partial);
}
