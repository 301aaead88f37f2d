#![allow(clippy::unwrap_used)]
use std::f64::consts::TAU;

use super::*;
use crate::{Failure, FailureKind};
use ct_signals::noise;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Time and an oscillating level.
fn rig(n: u32) -> (Vec<f64>, Vec<f64>) {
    let time: Vec<f64> = (0..n).map(f64::from).collect();
    let model = time.iter().map(|t| 10.0 + 5.0 * (t / 40.0).sin()).collect();
    (time, model)
}

fn located(noise: &ArModel, records: &[(&[f64], &[f64], &[f64])]) -> Failures {
    let series: Vec<Series> = records
        .iter()
        .map(|(time, model, residual)| Series {
            time,
            input: model,
            model,
            residual,
        })
        .collect();
    locate(&series, noise)
}

fn worst(failures: &Failures, by: FailureKind) -> &Failure {
    failures.worst.iter().find(|worst| worst.by == by).unwrap()
}

fn failing(failures: &Failures) -> usize {
    [
        &failures.by_time,
        &failures.by_level,
        &failures.by_flow,
        &failures.by_direction,
        &failures.by_frequency,
    ]
    .iter()
    .map(|bins| bins.iter().filter(|bin| bin.fails).count())
    .sum()
}

#[test]
fn a_failure_at_high_level_is_found_where_it_is() {
    let (time, model) = rig(1200);
    let residual: Vec<f64> = model
        .iter()
        .zip(&time)
        .map(|(y, t)| 0.05 * (t * 1.7).sin() - if *y > 14.0 { 1.0 } else { 0.0 })
        .collect();
    let failures = located(&ArModel::white(0.05), &[(&time, &model, &residual)]);
    for bin in &failures.by_level {
        // The failing range begins at 14; a bin of 0.83 extends over this value.
        assert_eq!(bin.fails, bin.to > 14.0 + 0.05, "{bin:?}");
    }
    let high = worst(&failures, FailureKind::Level);
    assert!(high.bin.from >= 13.2 && high.bin.mean < -0.5);
    assert!(high.error_share > high.sample_share + 0.2);
    let n = residual.len() as f64;
    let mean_square: f64 = residual.iter().map(|r| r * r).sum::<f64>() / n;
    let mean = residual.iter().sum::<f64>() / n;
    let bands: f64 = failures.by_frequency.iter().map(|b| b.rms * b.rms).sum();
    assert!((bands - (mean_square - mean * mean)).abs() < 0.01 * mean_square);
}

/// Chance is one in ten thousand for a record: of 300 there is none, or one in 33 runs of the test, which is seeded.
#[test]
fn noise_of_any_colour_fails_nowhere() {
    let (time, model) = rig(1000);
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for colour in [0.0, 0.8, 0.95] {
        let process = ArModel::from_coefficients(&[colour], 0.2).unwrap();
        let size = process.stationary_std();
        for run in 0..100 {
            let residual = noise::ar1(1000, size, colour, &mut rng);
            let failures = located(&process, &[(&time, &model, &residual)]);
            assert_eq!(
                failing(&failures),
                0,
                "colour {colour}, run {run}: {failures:?}"
            );
        }
    }
}

/// Noise of the same variance, but with another spectrum: only the frequency bands show it.
#[test]
fn a_band_that_the_noise_does_not_fill_fails() {
    let (time, model) = rig(1000);
    let process = ArModel::from_coefficients(&[0.95], 0.2).unwrap();
    let swing = |period: f64| -> Vec<f64> {
        noise::ar1(
            1000,
            process.stationary_std(),
            0.95,
            &mut ChaCha8Rng::seed_from_u64(9),
        )
        .iter()
        .zip(&time)
        .map(|(e, t)| e + 0.4 * (TAU * t / period).sin())
        .collect()
    };
    let quick = located(&process, &[(&time, &model, &swing(3.0))]);
    // Periods from 2 to 4 s.
    let band = worst(&quick, FailureKind::Frequency);
    assert!(band.bin.from <= 1.0 / 3.0 && band.bin.to >= 1.0 / 3.0);
    // Where the noise itself is large an oscillation of that size is nothing.
    assert_eq!(
        failing(&located(&process, &[(&time, &model, &swing(300.0))])),
        0
    );
}

#[test]
fn a_failure_in_the_second_record_is_found_there() {
    let (time, model) = rig(1000);
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let right = noise::white(1000, 0.1, &mut rng);
    let mut wrong = noise::white(1000, 0.1, &mut rng);
    for value in &mut wrong[500..583] {
        *value += 1.0;
    }
    let failures = located(
        &ArModel::white(0.1),
        &[(&time, &model, &right), (&time, &model, &wrong)],
    );
    assert_eq!(failures.by_time.len(), 2 * BINS);
    assert!(
        failures
            .by_time
            .iter()
            .all(|bin| !bin.fails || bin.record == Some(1))
    );
    let window = worst(&failures, FailureKind::Time);
    assert_eq!(window.bin.record, Some(1));
    assert!((window.bin.from - 499.5).abs() < 1.0 && (window.bin.to - 582.75).abs() < 1.0);
    assert!(window.error_share > 0.7 && (window.sample_share - 1.0 / 24.0).abs() < 0.005);
}
