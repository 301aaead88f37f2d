//! Whether the readings of records are whole multiples of one number, and of which: exactly, as after a converter, or with additional
//! noise.

use ct_signals::Record;

use crate::reading_grid;

/// Least agreement of the readings with multiples: the mean of `cos(2 pi y/D)`, one for exact multiples. With white noise of a tenth of the
/// step, 0.82.
const ALIGNED: f64 = 0.8;
/// The most steps between the least and the largest reading that are looked for.
const MOST_STEPS: f64 = 100.0;
/// The least number of steps: fewer distinct levels would always fit.
const FEWEST_STEPS: f64 = 4.0;
/// Number of readings in the first test.
const FIRST_LOOK: usize = 400;

/// The largest `D` such that nearly all readings of an output are multiples of `D` \[output unit\], if it is larger than the last digit.
pub(crate) fn reading_step(records: &[Record], output: usize) -> Option<f64> {
    exact_reading_step(records, output).or_else(|| noisy_step(records, output))
}

/// Quantisation step if the readings themselves are exact multiples, as after an A/D converter.
#[must_use]
pub fn exact_reading_step(records: &[Record], output: usize) -> Option<f64> {
    let grid = reading_grid(records, output).filter(|grid| grid.is_coarse() && grid.has_zero());
    grid.map(|grid| grid.step)
}

/// Quantisation step if noise is added after the quantisation.
fn noisy_step(records: &[Record], output: usize) -> Option<f64> {
    let all = || {
        records
            .iter()
            .flat_map(|record| record.outputs[output].present())
    };
    let count = all().count();
    let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
        (low.min(y), high.max(y))
    });
    let (span, reach) = (high - low, low.abs().max(high.abs()));
    if !(span > 0.0 && reach.is_finite()) {
        return None;
    }
    let all: Vec<f64> = all().collect();
    let some: Vec<f64> = all
        .iter()
        .copied()
        .step_by(count.div_ceil(FIRST_LOOK))
        .collect();
    // The phase of the largest reading changes by an eighth from one number of steps to the next, so no peak is missed.
    let grid = 0.125 / reach;
    let count = ((MOST_STEPS - FEWEST_STEPS) / span / grid).min(1e5) as usize;
    let at = |k: usize| FEWEST_STEPS / span + grid * k as f64;
    let coarse: Vec<f64> = (0..count).map(|k| aligned(at(k), &some)).collect();
    // Readings on multiples of D are also on multiples of D/2, so the first (largest) step is the result.
    let tried = (1..count.saturating_sub(1))
        .filter(|&k| coarse[k] > 0.5 * ALIGNED)
        .filter(|&k| coarse[k] >= coarse[k - 1] && coarse[k] >= coarse[k + 1])
        .map(|k| climb(at(k), grid, &all));
    let mut tried = tried.map(|steps| (aligned(steps, &all), steps));
    let first = tried.find(|(alignment, _)| *alignment > ALIGNED)?;
    // A neighbouring frequency with one step more or less over the range has a high alignment too, but a lower one.
    let nearby = tried.take_while(|(_, steps)| *steps < 1.5 * first.1);
    let best = nearby.fold(
        first,
        |best, next| if next.0 > best.0 { next } else { best },
    );
    Some(1.0 / best.1)
}

/// Agreement of readings with multiples of one over `steps`.
fn aligned(steps: f64, readings: &[f64]) -> f64 {
    let turn = std::f64::consts::TAU * steps;
    let sum: f64 = readings.iter().map(|y| (turn * y).cos()).sum();
    sum / readings.len() as f64
}

/// The best alignment near a number of steps, within `reach`.
fn climb(steps: f64, reach: f64, readings: &[f64]) -> f64 {
    let (mut steps, mut reach) = (steps, reach);
    while reach > 1e-9 * steps {
        let best = [-1.0, -0.5, 0.0, 0.5, 1.0]
            .map(|share| steps + share * reach)
            .map(|trial| (aligned(trial, readings), trial))
            .into_iter()
            .max_by(|a, b| a.0.total_cmp(&b.0));
        steps = best.map_or(steps, |(_, trial)| trial);
        reach *= 0.6;
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use ct_signals::Channel;

    fn record(reading: impl Fn(f64) -> f64) -> Record {
        let y: Vec<f64> = (0..900)
            .map(|k| f64::from(k) / 30.0)
            .map(|t| reading(14.0 + 4.0 * t.sin() + 3.0 * (0.37 * t).cos()))
            .collect();
        Record {
            name: "wave".into(),
            time: (0..y.len()).map(|k| k as f64).collect(),
            inputs: vec![Channel::new("u", "V", vec![1.0; y.len()])],
            outputs: vec![Channel::new("y", "cm", y)],
            references: Vec::new(),
            calendar: None,
        }
    }

    #[test]
    fn steps_are_found_with_and_without_noise_on_them() {
        for step in [0.17, 0.5, 1.3] {
            for noise in [0.0, 0.07] {
                let jitter = |y: f64| noise * step * (977.0 * y).sin();
                let wave = record(|y| step * (y / step).round() + jitter(y));
                let found = reading_step(&[wave], 0).unwrap();
                assert!((found - step).abs() < 1e-3 * step, "{found} of {step}");
            }
        }
    }

    #[test]
    fn a_smooth_reading_and_a_fine_converter_have_none() {
        assert_eq!(reading_step(&[record(|y| y)], 0), None);
        assert_eq!(
            reading_step(&[record(|y| (y / 0.01).round() * 0.01)], 0),
            None
        );
        assert_eq!(reading_step(&[record(|_| 3.0)], 0), None);
        assert_eq!(reading_step(&[record(|_| f64::INFINITY)], 0), None);
    }
}
