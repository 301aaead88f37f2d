//! Records of models with a hidden effect, and their diagnoses.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use ct_model::effects::{OwnCandidate, OwnParameter};
use ct_signals::{Channel, Record, noise};
use effect_search::{Believed, Error, Kept, NotNoise, Options, Verdict, believed, diagnose};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::records::{BLOCK, PAIR, ROWS, STEP, found, names, problem, record};

/// The block with another equation and other parameters than the user believes.
pub(crate) fn block(equation: &str) -> String {
    BLOCK
        .replace("= 0.8;", "= 0.6;")
        .replace("= 1.6;", "= 2.0;")
        .replace("g*u - k*(T - Ta)", equation)
}

/// The block after a sensor with a time constant of 25 s.
fn lagging() -> String {
    block("g*u - k*(T - Ta)")
        .replace(
            "output Real y(unit=\"degC\") = T;",
            "output Real y(unit=\"degC\") = s;\n  Real s(start=20);",
        )
        .replace("end Block", "  25*der(s) = T - s;\nend Block")
}

/// A linear model with an offset: a command that is always above the dead zone would only shift the offset.
#[test]
fn a_dead_zone_within_the_commands_of_a_linear_model_is_named() {
    let linear = |right: &str| {
        format!(
            "model Linear
               parameter Real K = 0.8;
               parameter Real tau(min=1) = 80;
               parameter Real c = 1;
               input Real u;
               output Real y = x;
               Real x(start=20);
             equation
               tau*der(x) = {right} - x;
             end Linear;"
        )
    };
    let mut record = record(&linear("c + K*max(u + 8 - 20, 0)"), 0.0, 0.1, 3);
    for u in &mut record.inputs[0].values {
        *u += 8.0;
    }
    let diagnosis = found(&problem(&linear("c + K*u"), record));
    assert!(names(&diagnosis, "dead_zone(u)"), "{:?}", diagnosis.groups);
    let last = diagnosis.steps.last().unwrap();
    let effect = |id: &str| diagnosis.effects == [id];
    // At a lower limit of the command the model is the same with another offset.
    let name = if effect("dead_zone(u)") {
        "dead_zone_u_threshold"
    } else {
        assert!(effect("saturation(u)"), "{:?}", diagnosis.effects);
        "saturation_u_limit"
    };
    let threshold = last.parameters.iter().find(|p| p.name == name).unwrap();
    assert!((threshold.value - 20.0).abs() < 0.5, "{}", threshold.value);
}

/// Two drifts of one gain are a drift with a curvature: one of them is named, and no record shows which.
#[test]
fn the_drift_of_a_gain_is_named_once() {
    let drifts = ["gain_drift(u)", "drift(g)"];
    let both = |group: &Vec<String>| drifts.iter().all(|id| group.iter().any(|i| i == id));
    let factor = "(1 + 0.3*time/2500 + 0.06*(time/2500)^2)";
    let hidden = block(&format!("g*{factor}*u - k*(T - Ta)"));
    let record = record(&hidden, 0.0, 0.3, 9);
    let diagnosis = found(&problem(BLOCK, record.clone()));
    assert!(both(&diagnosis.groups[0]), "{:?}", diagnosis.groups);
    let named = |id: &&str| diagnosis.effects.iter().any(|effect| effect == id);
    assert_eq!(drifts.iter().filter(|id| named(id)).count(), 1);
    // Nor is it added to a model that has it under the other name.
    let mut listed = problem(BLOCK, record);
    listed.effects = vec![drifts[0].to_string()];
    let again = found(&listed);
    let ids = again.groups.iter().flatten().chain(&again.effects);
    assert!(ids.clone().all(|id| id != drifts[1]), "{:?}", again.groups);
}

#[test]
fn what_is_hidden_is_named() {
    let lagging = lagging();
    for (hidden, text) in [
        ("lag(y)", lagging),
        ("saturation(u)", block("g*min(u, 27) - k*(T - Ta)")),
        ("dead_zone(u)", block("g*max(u - 5, 0) - k*(T - Ta)")),
        (
            "varies_with(k,T)",
            block("g*u - k*(1 + 0.01*(T - 50))*(T - Ta)"),
        ),
        ("periodic(T)", block("g*u - k*(T - Ta) + 2*sin(0.021*time)")),
        ("delay(u)", block("g*delay(u, 11) - k*(T - Ta)")),
        (
            "delay(y)",
            block("g*u - k*(T - Ta)").replace("= T;", "= delay(T, 11);"),
        ),
    ] {
        let diagnosis = found(&problem(BLOCK, record(&text, 0.0, 0.2, 3)));
        assert!(
            names(&diagnosis, hidden),
            "{hidden}: {:?} {:?}, {:?}, {:?}",
            diagnosis.verdict,
            diagnosis.groups,
            diagnosis.not_noise,
            &diagnosis.singles[..3]
        );
        let (first, last) = (
            &diagnosis.steps[0],
            &diagnosis.steps[diagnosis.steps.len() - 1],
        );
        assert!(last.weighted_rmse < 1.1 && first.weighted_rmse > last.weighted_rmse);
    }
}

/// The pair with a flow between its states.
fn coupled(coupling: f64) -> String {
    let flow = format!("{coupling}*(T1 - T2)");
    PAIR.replace("k1*(T1 - 20)", &format!("k1*(T1 - 20) - {flow}"))
        .replace("k2*(T2 - 20)", &format!("k2*(T2 - 20) + {flow}"))
}

#[test]
fn a_flow_between_two_states_is_named_beside_coloured_noise() {
    let diagnosis = found(&problem(PAIR, record(&coupled(0.2), 0.8, 0.3, 5)));
    assert!(
        names(&diagnosis, "coupling(T1,T2)"),
        "{:?}",
        diagnosis.groups
    );
    assert!(diagnosis.effects.len() == 1, "{:?}", diagnosis.effects);
    assert!(diagnosis.steps[0].rmse_per_output.len() == 2 && diagnosis.steps[0].rmse.is_none());
}

/// Correlated noise may be unmodelled physics: beside an effect that explains as much, it makes the answer a partial one.
#[test]
fn an_effect_beside_as_much_correlated_noise_is_a_part_of_the_answer() {
    for (coupling, verdict) in [(0.2, Verdict::Effect), (0.01, Verdict::Partial)] {
        let found = found(&problem(PAIR, record(&coupled(coupling), 0.8, 0.3, 5)));
        assert!(names(&found, "coupling(T1,T2)"), "{:?}", found.groups);
        assert_eq!(found.verdict, verdict, "{:?}", found.share);
        assert_eq!(found.not_noise, None);
    }
}

/// One output has twenty times the noise of the other one; the hidden effect raises the error of the quiet one by a third.
#[test]
fn an_effect_is_named_whatever_the_noise_of_the_other_output() {
    for noisy in 0..2 {
        let mut record = record(&coupled(0.008), 0.0, 0.1, 5);
        let more = noise::white(ROWS, 2.0, &mut ChaCha8Rng::seed_from_u64(8));
        let values = record.outputs[noisy].values.iter_mut();
        for (value, more) in values.zip(more) {
            *value += more;
        }
        let found = found(&problem(PAIR, record));
        assert_eq!(
            found.effects,
            ["coupling(T1,T2)"],
            "{noisy}: {:?}",
            found.verdict
        );
        assert_ne!(found.verdict, Verdict::Partial);
    }
}

#[test]
fn nothing_is_named_where_nothing_is_missing() {
    for seed in 0..4 {
        let correlation = if seed % 2 == 0 { 0.0 } else { 0.85 };
        let text = block("g*u - k*(T - Ta)");
        let diagnosis = found(&problem(BLOCK, record(&text, correlation, 0.3, seed)));
        assert_eq!(
            diagnosis.verdict,
            Verdict::Adequate,
            "{:?} {:?} {:?}",
            diagnosis.groups,
            diagnosis.not_noise,
            diagnosis.noise
        );
        assert_eq!(diagnosis.ranked[0], "none");
    }
}

#[test]
fn a_candidate_of_the_users_own_is_judged_beside_the_others() {
    let text = block("g*u - k*(T - Ta) - 0.004*max(T - Ta, 0)^1.7");
    let mut problem = problem(BLOCK, record(&text, 0.0, 0.1, 9));
    let candidate = OwnCandidate {
        parameters: BTreeMap::from([(
            "c".to_string(),
            OwnParameter {
                min: Some(0.0),
                start: 0.01,
                ..OwnParameter::default()
            },
        )]),
        terms: BTreeMap::from([("T".to_string(), "-c*max(T - Ta, 0)^1.7".to_string())]),
        ..OwnCandidate::default()
    };
    problem
        .candidates
        .insert("draught".to_string(), candidate.clone());
    let diagnosis = found(&problem);
    assert!(names(&diagnosis, "draught"), "{:?}", diagnosis.groups);
    // A candidate that equals another one is rejected.
    problem.candidates.insert("wind".to_string(), candidate);
    let refused = diagnose(&problem, &Options::default(), &|_| {});
    assert!(matches!(refused, Err(Error::Own(_))));
}

#[test]
fn what_no_candidate_holds_is_not_called_noise() {
    // A heat flow with an irregular course.
    let text = block(
        "g*u - k*(T - Ta) + (if time > 700 and time < 1000 then 12 else if time > 1500 and time < 1650 then -15 else 0)",
    );
    let diagnosis = found(&problem(BLOCK, record(&text, 0.0, 0.1, 2)));
    assert!(
        matches!(diagnosis.verdict, Verdict::Unexplained | Verdict::Partial),
        "{:?} {:?}",
        diagnosis.verdict,
        diagnosis.groups
    );
    assert!(diagnosis.not_noise.is_some());
}

/// The gain at one block rises and falls with the temperature of the other: effects of the catalogue imitate a part of it, and a noise
/// model takes the rest.
#[test]
fn a_function_that_no_candidate_has_is_found_in_what_the_noise_model_takes_for_noise() {
    for correlation in [0.0, 0.8] {
        let truth = PAIR.replace("g*u", "g*u*(1 + 0.2*sin(0.12*T2))");
        let diagnosis = found(&problem(PAIR, record(&truth, correlation, 0.5, 3)));
        let told = (diagnosis.verdict, &diagnosis.groups, &diagnosis.not_noise);
        let Some(NotNoise::Function { variable, .. }) = &diagnosis.not_noise else {
            panic!("{told:?}");
        };
        assert_eq!(variable, "T2");
        assert!(
            matches!(diagnosis.verdict, Verdict::Unexplained | Verdict::Partial),
            "{told:?}"
        );
    }
}

#[test]
fn an_effect_that_the_model_cannot_have_is_refused() {
    let text = block("g*u - k*(T - Ta)");
    let mut problem = problem(BLOCK, record(&text, 0.0, 0.3, 1));
    problem.effects.push("lag(q)".to_string());
    let refused = diagnose(&problem, &Options::default(), &|_| {});
    assert!(matches!(refused, Err(Error::UnknownEffect { id, .. }) if id == "lag(q)"));
}

#[test]
fn effects_of_the_model_file_are_fitted_with_it_and_keep_their_record() {
    let lagging = lagging();
    let mut problem = problem(BLOCK, record(&lagging, 0.0, 0.2, 3));
    problem.effects.push("lag(y)".to_string());
    let found = believed(&problem, &Options::default()).unwrap();
    let tau = |found: &Believed| {
        let mut parameters = found.spec.parameters.iter();
        parameters
            .find(|p| p.about.name == "lag_y_tau")
            .unwrap()
            .value
    };
    assert!((tau(&found) - 25.0).abs() < 1.0, "{}", tau(&found));
    let numbers = &found.record_numbers["lag(y)"];
    assert_eq!(numbers["duration"], STEP * (ROWS - 1) as f64);
    assert_eq!(numbers["interval"], STEP);
    // The effect belongs to the believed model: nothing else is missing.
    let diagnosis = diagnose(&problem, &Options::default(), &|_| {}).unwrap();
    assert_eq!(
        diagnosis.verdict,
        Verdict::Adequate,
        "{:?} {:?} {:?}",
        diagnosis.groups,
        diagnosis.not_noise,
        diagnosis.noise
    );
    assert!(diagnosis.effects.is_empty());
    assert_eq!(&diagnosis.record_numbers["lag(y)"], numbers);
    // Numbers of an earlier record stay, and a start is tried beside the effect's own.
    let kept = Kept {
        numbers: BTreeMap::from([
            ("duration".to_string(), 900.0),
            ("interval".to_string(), 2.0),
        ]),
        start: BTreeMap::from([("tau".to_string(), 24.0)]),
        function: None,
    };
    problem.kept.insert("lag(y)".to_string(), kept);
    let found = believed(&problem, &Options::default()).unwrap();
    assert_eq!(found.record_numbers["lag(y)"]["duration"], 900.0);
    assert!((tau(&found) - 25.0).abs() < 1.0, "{}", tau(&found));
}

/// A step is found at its time, which lies between the times at which it is looked for first, beside an effect of another output.
#[test]
fn a_step_is_found_at_its_time_beside_another_effect() {
    const SINCE: f64 = 1587.0;
    let text = PAIR
        .replace(
            "k1*(T1 - 20)",
            "k1*(1 + (if time >= 1587 then 0.2 else 0))*(T1 - 20)",
        )
        .replace("k2*(T2 - 20)", "k2*(T2 - 20) - 4");
    let diagnosis = found(&problem(PAIR, record(&text, 0.0, 0.2, 11)));
    assert!(names(&diagnosis, "step(k1)"), "{:?}", diagnosis.groups);
    assert!(names(&diagnosis, "constant(T2)"), "{:?}", diagnosis.groups);
    let last = &diagnosis.steps[diagnosis.steps.len() - 1];
    let since = last
        .parameters
        .iter()
        .find(|own| own.name == "step_k1_since")
        .unwrap();
    assert!(
        (since.value - SINCE).abs() < 4.0 * since.std_error.unwrap(),
        "{since:?}"
    );
}

/// A free fall, as a camera follows it.
const FALL: &str = r#"model Fall
  final parameter Real g(unit="m/s2") = 9.81;
  output Real y(unit="m") = h;
  Real h(unit="m", start=47);
  Real w(unit="m/s", start=0);
equation
  der(h) = w;
  der(w) = -g;
end Fall;"#;

#[test]
fn one_reading_that_is_off_is_no_effect() {
    for seed in 0..8 {
        for correlation in [0.0, 0.8] {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let read = noise::ar1(43, 0.03, correlation, &mut rng);
            let time: Vec<f64> = (0..43).map(|k| f64::from(k) / 15.0).collect();
            let mut values: Vec<f64> = time
                .iter()
                .zip(&read)
                .map(|(t, v)| 47.0 + 0.3 * t - 0.5 * 9.81 * t * t + v)
                .collect();
            values[42] += 0.4;
            let record = Record {
                name: "fall.csv".into(),
                time,
                inputs: Vec::new(),
                outputs: vec![Channel::new("y", "m", values)],
                ..Record::default()
            };
            let diagnosis = found(&problem(FALL, record));
            assert!(
                diagnosis.effects.is_empty(),
                "{seed} {correlation}: {:?} {:?}",
                diagnosis.verdict,
                diagnosis.groups
            );
        }
    }
}

#[test]
fn an_interrupted_search_names_effects_with_the_same_sensitivity() {
    let record = record(&BLOCK.replace("g*u", "g*(1 - 0.0001*time)*u"), 0.0, 0.1, 21);
    let problem = problem(BLOCK, record);
    let interrupt = AtomicBool::new(false);
    let options = Options {
        interrupt: Some(&interrupt),
        ..Options::default()
    };
    let at_the_groups = |progress: effect_search::Progress| {
        if progress.phase == "telling apart" {
            interrupt.store(true, Ordering::Relaxed);
        }
    };
    let found = diagnose(&problem, &options, &at_the_groups).unwrap();
    let group = &found.groups[0];
    for effect in ["gain_drift(u)", "drift(g)"] {
        assert!(group.iter().any(|id| id == effect), "{group:?}");
    }
    assert!(!found.left_out.is_empty());
}
