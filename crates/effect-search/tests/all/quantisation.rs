//! Readings of a coarse converter: rounded together with their noise, or with noise added after the rounding.

use ct_signals::{Record, noise};
use effect_search::{Options, Problem, Verdict, believed};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::records::{BLOCK, PAIR, found, names, problem, record};

fn rounded(record: &mut Record, step: f64) {
    for y in record.outputs.iter_mut().flat_map(|y| &mut y.values) {
        *y = step * (*y / step).round();
    }
}

/// A block whose readings are rounded together with noise of a fifth of the step.
fn noise_and_rounding() -> Problem {
    let mut record = record(BLOCK, 0.0, 0.1, 7);
    rounded(&mut record, 0.5);
    problem(BLOCK, record)
}

#[test]
fn rounding_of_reading_and_noise_is_named() {
    let diagnosis = found(&noise_and_rounding());
    assert_eq!(diagnosis.verdict, Verdict::Effect);
    assert_eq!(diagnosis.groups, [["quantisation(y)"]]);
    assert_eq!(diagnosis.quantisation, []);
    let [base, with] = &diagnosis.steps[..] else {
        panic!("{} steps", diagnosis.steps.len());
    };
    assert!(with.rmse < base.rmse, "{:?}, {:?}", with.rmse, base.rmse);
    let value = |name: &str| {
        let own = with.parameters.iter().find(|p| p.name == name);
        own.unwrap().value
    };
    assert!((value("quantisation_y_step") - 0.5).abs() < 2e-3);
    assert!((value("quantisation_y_dither") - 0.2).abs() < 0.06);
}

/// Readings without noise that the rounded model reproduces, but for a few: the residual says nothing of the estimates.
#[test]
fn estimates_from_rounded_readings_without_noise_have_errors() {
    let mut record = record(BLOCK, 0.0, 0.0, 7);
    rounded(&mut record, 0.5);
    let believed = BLOCK
        .replace("= 0.8;", "= 0.7;")
        .replace("= 1.6;", "= 1.8;");
    let diagnosis = found(&problem(&believed, record));
    assert_eq!(diagnosis.groups, [["quantisation(y)"]]);
    let last = diagnosis.steps.last().unwrap();
    // At most five of 500 are a step off.
    assert!(last.rmse.unwrap() < 0.05, "{:?}", last.rmse);
    for (name, value) in [("k", 0.8), ("g", 1.6)] {
        let own = last.parameters.iter().find(|p| p.name == name).unwrap();
        let error = own.std_error.unwrap();
        assert!(
            (1e-5 * value..0.01 * value).contains(&error),
            "{name}: {error}"
        );
        assert!((own.value - value).abs() < 4.0 * error, "{}", own.value);
    }
    assert!(last.not_determined.is_empty(), "{:?}", last.not_determined);
}

#[test]
fn rounding_that_is_not_to_be_named_is_reported() {
    let mut problem = noise_and_rounding();
    problem.left_out.insert("quantisation(y)".to_string());
    let diagnosis = found(&problem);
    assert_eq!(diagnosis.verdict, Verdict::Adequate);
    let [rounded] = &diagnosis.quantisation[..] else {
        panic!("{:?}", diagnosis.quantisation);
    };
    assert_eq!(
        (rounded.output.as_str(), rounded.unit.as_str()),
        ("y", "degC")
    );
    assert!((rounded.step - 0.5).abs() < 1e-9, "{rounded:?}");
    // The sum of both variances is 0.0308; rounding corrects a part of the noise.
    let rounding = 0.5_f64.powi(2) / 12.0;
    assert!(
        (rounding / 0.0308..1.0).contains(&rounded.share),
        "{rounded:?}"
    );
}

#[test]
fn rounding_of_every_output_is_named() {
    let mut record = record(PAIR, 0.0, 0.1, 7);
    rounded(&mut record, 0.5);
    let mut effects = found(&problem(PAIR, record)).effects;
    effects.sort();
    assert_eq!(effects, ["quantisation(y1)", "quantisation(y2)"]);
}

#[test]
fn a_model_that_rounds_by_itself_lacks_no_rounding() {
    let model = BLOCK.replace("= T;", "= quantise(T, 0.5);");
    let mut record = record(BLOCK, 0.0, 0.1, 7);
    rounded(&mut record, 0.5);
    let found = found(&problem(&model, record));
    assert!(!names(&found, "quantisation(y)"), "{:?}", found.groups);
}

/// Readings scatter only next to the steps, which other effects may fit by chance.
#[test]
fn a_step_of_ten_times_the_noise_brings_no_other_effect() {
    for seed in 1..=4 {
        let mut record = record(BLOCK, 0.0, 0.05, seed);
        rounded(&mut record, 0.5);
        let diagnosis = found(&problem(BLOCK, record));
        assert_eq!(diagnosis.verdict, Verdict::Effect, "seed {seed}");
        assert_eq!(diagnosis.groups, [["quantisation(y)"]], "seed {seed}");
    }
}

/// Rounding does not explain errors of several steps.
#[test]
fn a_disturbance_of_several_steps_beside_rounding_is_no_noise() {
    let mut record = record(BLOCK, 0.0, 0.05, 1);
    for y in &mut record.outputs[0].values[300..306] {
        *y += 2.0;
    }
    rounded(&mut record, 0.5);
    let diagnosis = found(&problem(BLOCK, record));
    assert!(diagnosis.not_noise.is_some(), "{:?}", diagnosis.groups);
    assert_ne!(diagnosis.verdict, Verdict::Effect);
}

/// Of a model file, without the values that a diagnosis found.
#[test]
fn a_listed_rounding_begins_with_what_the_readings_show() {
    let mut problem = noise_and_rounding();
    problem.effects = vec!["quantisation(y)".to_string()];
    let listed = believed(&problem, &Options::default()).unwrap().spec;
    let value = |name: &str| {
        let own = listed.parameters.iter().find(|p| p.about.name == name);
        own.unwrap().value
    };
    assert!((value("quantisation_y_step") - 0.5).abs() < 2e-3);
    assert!((value("quantisation_y_dither") - 0.2).abs() < 0.06);
}

#[test]
fn fine_readings_are_not_reported() {
    let mut record = record(BLOCK, 0.0, 0.1, 7);
    rounded(&mut record, 0.01);
    assert_eq!(found(&problem(BLOCK, record)).quantisation, []);
}

#[test]
fn rounding_that_is_in_the_model_is_not_reported_again() {
    let mut record = record(BLOCK, 0.0, 0.02, 7);
    rounded(&mut record, 0.5);
    let diagnosis = found(&problem(BLOCK, record));
    assert!(
        names(&diagnosis, "quantisation(y)"),
        "{:?}",
        diagnosis.groups
    );
    assert_eq!(diagnosis.quantisation, []);
}

#[test]
fn a_step_before_the_noise_is_found_where_it_is_3_5_times_the_noise() {
    let mut record = record(BLOCK, 0.0, 0.0, 7);
    rounded(&mut record, 0.7);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let e = noise::white(record.len(), 0.2, &mut rng);
    for (y, e) in record.outputs[0].values.iter_mut().zip(e) {
        *y += e;
    }
    let diagnosis = found(&problem(BLOCK, record));
    assert!(
        names(&diagnosis, "quantisation(y)"),
        "{:?}",
        diagnosis.groups
    );
    let last = &diagnosis.steps[diagnosis.steps.len() - 1];
    let step = last
        .parameters
        .iter()
        .find(|p| p.name == "quantisation_y_step");
    assert!((step.unwrap().value - 0.7).abs() < 1e-3);
}
