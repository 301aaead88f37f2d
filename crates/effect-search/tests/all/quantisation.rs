//! Readings of a coarse converter: rounded together with their noise, or with noise added after the rounding.

use ct_signals::{Record, noise};
use effect_search::Verdict;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::records::{BLOCK, found, names, problem, record};

fn rounded(record: &mut Record, step: f64) {
    for y in &mut record.outputs[0].values {
        *y = step * (*y / step).round();
    }
}

#[test]
fn rounding_of_reading_and_noise_is_reported_and_needs_no_effect() {
    let mut record = record(BLOCK, 0.0, 0.1, 7);
    rounded(&mut record, 0.5);
    let diagnosis = found(&problem(BLOCK, record));
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
