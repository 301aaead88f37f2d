//! Checks of the information in the records, without a fit.
//!
//! There are three warnings. A record that a fit can use causes none of them:
//!
//! - a record whose command never moves, beside one whose command does;
//! - a command that makes a single step in all fitted records together;
//! - an output that does not respond: its range is that of noise, and the output is not correlated with the command after any lag.

use std::fmt;

use ct_signals::{Channel, Record, residual_tests::prewhitened_input_test};
use missing_effect::Problem;

use crate::numbers;
use crate::sentences::with_unit;

/// A command has changed if its distance from the previous constant value is this share of its whole range.
const MOVE: f64 = 0.1;

/// White noise of up to 100 000 samples has a range below this multiple of the median of its first differences.
const NOISE_RANGE: f64 = 10.0;

/// An output responds to the command if the p-value of their correlation is below this.
const CHANCE: f64 = 0.01;

/// A correlation beyond this number of standard errors is significant.
const STANDARD_ERRORS: f64 = 4.0;

/// Properties that a record cannot show.
#[derive(Debug, Clone, PartialEq)]
pub enum ExcitationWarning {
    /// The command of a record is constant.
    Still {
        /// The record.
        record: String,
    },
    /// All fitted records together contain one step of the command.
    SingleStep {
        /// The record with the step.
        record: String,
        /// Commands before and after it.
        levels: (f64, f64),
        /// Unit of the command.
        unit: String,
    },
    /// An output of a record does not respond to the command.
    NoAnswer {
        /// The record.
        record: String,
        /// The output, if there are several.
        output: Option<String>,
        /// Range of the output.
        range: f64,
        /// Median of the absolute first differences of the output.
        difference: f64,
        /// Unit of the output.
        unit: String,
    },
}

impl fmt::Display for ExcitationWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Still { record } => write!(
                f,
                "{record}: the command never moves, so this record does not show how the process responds; the other fitted records have to"
            ),
            Self::SingleStep {
                record,
                levels: (before, after),
                unit,
            } => write!(
                f,
                "{record}: the command makes a single step, from {} to {}: a gain and a time constant can be fitted to it, but not how they \
                 change with the level or the command, and many effects cannot be distinguished; record several steps of different sizes",
                numbers::significant(*before, 3),
                value_with_unit(*after, unit),
            ),
            Self::NoAnswer {
                record,
                output,
                range,
                difference,
                unit,
            } => write!(
                f,
                "{record}: the output{} does not respond to the command: its range of {} is that of noise (median change from row to row {}); \
                 check the columns, or record an experiment with larger steps",
                output
                    .as_ref()
                    .map_or(String::new(), |name| format!(" \"{name}\"")),
                value_with_unit(*range, unit),
                value_with_unit(*difference, unit),
            ),
        }
    }
}

/// A value to three digits, with its unit.
fn value_with_unit(value: f64, unit: &str) -> String {
    with_unit(&numbers::significant(value, 3), unit)
}

/// Warnings for the fitted records of a problem.
#[must_use]
pub fn of_problem(problem: &Problem) -> Vec<ExcitationWarning> {
    of_records(problem.records.iter())
}

/// Warnings for fitted records that are not in a problem yet.
pub(crate) fn of_records<'a>(
    records: impl Iterator<Item = &'a Record> + Clone,
) -> Vec<ExcitationWarning> {
    let still = |record: &Record| record.require_moving_input().is_err();
    let mut warnings = Vec::new();
    let others = records.clone().any(|record| !still(record));
    for record in records.clone() {
        if still(record) {
            if others {
                warnings.push(ExcitationWarning::Still {
                    record: record.name.clone(),
                });
            }
            continue;
        }
        let several = record.outputs.len() > 1;
        for output in &record.outputs {
            if let Some((range, difference)) = no_answer(record, output) {
                warnings.push(ExcitationWarning::NoAnswer {
                    record: record.name.clone(),
                    output: several.then(|| output.name.clone()),
                    range,
                    difference,
                    unit: output.unit.clone(),
                });
            }
        }
    }
    warnings.extend(single_step(records));
    warnings
}

/// The single step of the command, if all records together contain no other change.
fn single_step<'a>(records: impl Iterator<Item = &'a Record> + Clone) -> Option<ExcitationWarning> {
    let wider = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
    let (low, high) = records.clone().map(Record::input_range).reduce(wider)?;
    let least = MOVE * (high - low);
    let second = |record: &Record| {
        record
            .inputs
            .get(1)
            .is_some_and(|u| u.range().0 < u.range().1)
    };
    let mut found = None;
    for record in records {
        if second(record) {
            return None;
        }
        for levels in moves(&record.inputs[0], least) {
            if found.is_some() {
                return None;
            }
            found = Some(ExcitationWarning::SingleStep {
                record: record.name.clone(),
                levels,
                unit: record.inputs[0].unit.clone(),
            });
        }
    }
    found
}

/// The changes of a signal by more than `least`: value before and after.
fn moves(signal: &Channel, least: f64) -> Vec<(f64, f64)> {
    let mut moves = Vec::new();
    let mut values = signal.present();
    let Some(mut stood) = values.next() else {
        return moves;
    };
    for value in values {
        if (value - stood).abs() > least {
            moves.push((stood, value));
            stood = value;
        }
    }
    moves
}

/// Range of an output and median of its first differences, if the output does not respond to the command.
fn no_answer(record: &Record, output: &Channel) -> Option<(f64, f64)> {
    let (low, high) = output.range();
    let (input, output) = (&record.inputs[0].interpolated(), &output.values);
    let differences = output.windows(2).map(|y| (y[1] - y[0]).abs());
    let mut differences: Vec<f64> = differences.filter(|d| !d.is_nan()).collect();
    let middle = differences.len() / 2;
    if differences.is_empty() {
        return None;
    }
    let (_, &mut difference, _) = differences.select_nth_unstable_by(middle, f64::total_cmp);
    let range = high - low;
    let silent = record.inputs.get(1).is_none()
        && range < NOISE_RANGE * difference
        && uncorrelated(input, output)
        && uncorrelated_behind_lags(input, output);
    silent.then_some((range, difference))
}

/// Whether no lag of the prewhitened input is correlated with the output. False if the test is not possible.
fn uncorrelated(input: &[f64], output: &[f64]) -> bool {
    let lags = (input.len() / 10).clamp(2, 60);
    prewhitened_input_test(input, output, lags).is_ok_and(|(_, p)| p > CHANCE)
}

/// The input, and the input after first-order lags of one sample to a third of the record, are not correlated with the output.
fn uncorrelated_behind_lags(input: &[f64], output: &[f64]) -> bool {
    let samples = output.iter().filter(|y| !y.is_nan()).count();
    let bound = STANDARD_ERRORS / (samples as f64).sqrt();
    let mut lag = 1.0;
    let mut filtered = input.to_vec();
    loop {
        if correlation(&filtered, output).abs() > bound {
            return false;
        }
        if lag > input.len() as f64 / 3.0 {
            return true;
        }
        let keep = (-1.0_f64 / lag).exp();
        let mut state = input[0];
        for (to, u) in filtered.iter_mut().zip(input) {
            *to = state;
            state = keep * state + (1.0 - keep) * u;
        }
        lag *= 2.0;
    }
}

/// Correlation over the pairs with both samples present.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let pairs = || a.iter().zip(b).filter(|(a, b)| !a.is_nan() && !b.is_nan());
    let count = pairs().count() as f64;
    let (mean_a, mean_b) = pairs().fold((0.0, 0.0), |sum, (a, b)| {
        (sum.0 + a / count, sum.1 + b / count)
    });
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in pairs() {
        let (a, b) = (a - mean_a, b - mean_b);
        (aa, bb, ab) = (aa + a * a, bb + b * b, ab + a * b);
    }
    ab / (aa * bb).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use ct_signals::noise;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Response of a lag with `gain` and `tau` samples to this command, plus white noise of standard deviation one.
    fn record(name: &str, gain: f64, tau: f64, seed: u64, command: &[f64]) -> Record {
        let n = command.len();
        let white = noise::white(n, 1.0, &mut ChaCha8Rng::seed_from_u64(seed));
        let keep = (-1.0 / tau).exp();
        let mut state = gain * command[0];
        let output = command
            .iter()
            .zip(white)
            .map(|(u, e)| {
                let reading = 20.0 + state + e;
                state = keep * state + (1.0 - keep) * gain * u;
                reading
            })
            .collect();
        Record {
            name: name.to_string(),
            time: (0..n).map(|k| k as f64).collect(),
            inputs: vec![Channel::new("u", "V", command.to_vec())],
            outputs: vec![Channel::new("y", "cm", output)],
            ..Record::default()
        }
    }

    /// Steps between random levels, each held for this time.
    fn steps(n: usize, held: usize, seed: u64) -> Vec<f64> {
        let levels = noise::white(n.div_ceil(held), 1.0, &mut ChaCha8Rng::seed_from_u64(seed));
        (0..n).map(|k| levels[k / held]).collect()
    }

    fn warnings(records: &[Record]) -> Vec<ExcitationWarning> {
        of_records(records.iter())
    }

    #[test]
    fn an_output_of_noise_alone_does_not_answer() {
        let mut raised = 0;
        for seed in 0..20 {
            let record = record("a.csv", 0.0, 10.0, seed, &steps(1000, 20, seed + 100));
            match warnings(&[record]).as_slice() {
                [] => {}
                [ExcitationWarning::NoAnswer { range, .. }] => {
                    assert!((5.0..10.0).contains(range), "{range}");
                    raised += 1;
                }
                other => panic!("{other:?}"),
            }
        }
        // Each test has a false alarm in one record of a hundred.
        assert!(raised >= 18, "{raised} of 20");
    }

    #[test]
    fn each_of_several_outputs_is_looked_at() {
        let command = steps(600, 40, 1);
        let mut both = record("a.csv", 5.0, 20.0, 1, &command);
        let silent = record("a.csv", 0.0, 20.0, 2, &command)
            .outputs
            .swap_remove(0);
        both.outputs.push(Channel {
            name: "lower".into(),
            ..silent
        });
        let warnings = warnings(&[both]);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        let said = warnings[0].to_string();
        assert!(
            said.starts_with("a.csv: the output \"lower\" does not respond"),
            "{said}"
        );
    }

    #[test]
    fn an_output_that_answers_in_noise_does() {
        // Slow and fast compared with the sampling and the steps, with noise as large as the response or half of it; and with almost no
        // noise.
        for (gain, tau, held) in [
            (1.0, 10.0, 20),
            (0.7, 200.0, 1000),
            (1.0, 0.05, 1),
            (1.0, 0.05, 30),
            (300.0, 0.05, 1),
            (300.0, 50.0, 100),
        ] {
            for seed in 0..10 {
                let command = steps(4000, held, seed + 100);
                let record = record("a.csv", gain, tau, seed, &command);
                assert_eq!(warnings(&[record]), [], "{gain} {tau} {held} {seed}");
            }
        }
    }

    #[test]
    fn a_single_step_is_said_and_two_are_not() {
        let single: Vec<f64> = (0..400).map(|k| if k < 100 { 2.0 } else { 3.0 }).collect();
        let expected = ExcitationWarning::SingleStep {
            record: "a.csv".to_string(),
            levels: (2.0, 3.0),
            unit: "V".to_string(),
        };
        let once = record("a.csv", 30.0, 20.0, 1, &single);
        assert_eq!(warnings(std::slice::from_ref(&once)), [expected]);
        // A measured command contains noise.
        let measured: Vec<f64> = single
            .iter()
            .zip(noise::white(400, 0.005, &mut ChaCha8Rng::seed_from_u64(7)))
            .map(|(u, e)| u + e)
            .collect();
        let noisy = record("a.csv", 30.0, 20.0, 1, &measured);
        assert!(matches!(
            warnings(&[noisy]).as_slice(),
            [ExcitationWarning::SingleStep { .. }]
        ));
        // A second record with a step, a step back, and a ramp has more changes.
        let again = record("b.csv", 30.0, 20.0, 2, &single);
        assert_eq!(warnings(&[once, again]), []);
        let back: Vec<f64> = (0..400)
            .map(|k| if (100..250).contains(&k) { 3.0 } else { 2.0 })
            .collect();
        assert_eq!(warnings(&[record("a.csv", 30.0, 20.0, 1, &back)]), []);
        let ramp: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        assert_eq!(warnings(&[record("a.csv", 30.0, 20.0, 1, &ramp)]), []);
    }

    #[test]
    fn a_record_at_rest_is_said_beside_one_that_moves() {
        let still = record("still.csv", 30.0, 20.0, 1, &[2.0; 100]);
        let moves = record("a.csv", 30.0, 20.0, 1, &steps(400, 20, 1));
        let said = warnings(&[still, moves]);
        let expected = ExcitationWarning::Still {
            record: "still.csv".to_string(),
        };
        assert_eq!(said, [expected]);
        assert!(
            said[0]
                .to_string()
                .starts_with("still.csv: the command never moves")
        );
    }
}
