//! Noise level of each measured output, estimated independently of model errors.
//!
//! The residual of an incomplete model contains model errors in addition to noise, more at one output than at another. The noise is
//! estimated as the error of a linear prediction of the reading from all signals that are known at its instant: the model's output and its
//! past, earlier readings of this and of the other outputs, and the inputs. The prediction error is close to the noise if the model error
//! can be predicted from these signals (L. Ljung, System Identification, 2nd ed., 1999, section 10.4: long ARX models).
//!
//! The shorter the interval between readings, the better coloured noise is predicted from its own past. To make outputs with different
//! sampling rates comparable, the prediction horizon of each is the sampling interval of the slowest output.

use ct_signals::Record;
use estimation::Triangle;

/// Readings of the same output before the one that is predicted, and values of the model's output before.
const PAST: usize = 24;
/// Rows of inputs and readings of other outputs before.
const PAST_OF_OTHERS: usize = 12;
/// Least number of samples per coefficient; with fewer samples the prediction uses a shorter past.
const SAMPLES: usize = 5;
/// Penalty of the prediction's coefficients (ridge regression), as a share of the variance of each signal. The model's output is almost a
/// combination of its past and of the inputs: what is left is below a hundredth of a per cent of it, and mostly error of the simulation.
/// Without the penalty a coefficient may be as large as that error is small, and the noise depends on the last digits of the parameters.
/// The penalty is part of the variance: noise below about a thousandth of an output's movement is not resolved.
const PENALTY: f64 = 1e-8;

/// The standard deviation of each output's noise \[its unit\]; `None` where there are too few samples to tell.
///
/// `model`: what a model of the records gives, a series for each record and output, as [`crate::ModelSetup::simulate`] has it.
pub(crate) fn output_noise(records: &[Record], model: &[Vec<f64>]) -> Vec<Option<f64>> {
    let outputs = records.first().map_or(0, |record| record.outputs.len());
    let ahead = slowest(records);
    let of = |output: usize| {
        let mut past = PAST;
        while past > 0 {
            let (triangle, samples) = prediction(records, model, output, (past, ahead));
            if samples >= SAMPLES * (triangle.columns() - 1) {
                let variance = prediction_variance(&triangle, samples)?;
                return (variance.is_finite() && variance > 0.0).then(|| variance.sqrt());
            }
            past /= 2;
        }
        None
    };
    (0..outputs).map(of).collect()
}

/// Rows in which an output was read.
fn read_rows(values: &[f64]) -> Vec<usize> {
    (0..values.len()).filter(|&k| !values[k].is_nan()).collect()
}

/// The median of the rows from one reading to the next, of the slowest output.
fn slowest(records: &[Record]) -> usize {
    let of = |values: &[f64]| {
        let mut apart: Vec<usize> = read_rows(values)
            .windows(2)
            .map(|two| two[1] - two[0])
            .collect();
        apart.sort_unstable();
        apart.get(apart.len() / 2).copied()
    };
    let outputs = records.iter().flat_map(|record| &record.outputs);
    let slowest = outputs.filter_map(|output| of(&output.values)).max();
    slowest.unwrap_or(1)
}

/// Variance of the prediction error, with the penalty. The effective number of coefficients is smaller by `sum_j d_j (R'R)^-1_jj`, where `d_j` is
/// the penalty of each (T. Hastie, R. Tibshirani, J. Friedman, The Elements of Statistical Learning, 2nd ed., 2009, equation 3.50).
fn prediction_variance(triangle: &Triangle, samples: usize) -> Option<f64> {
    let columns = triangle.columns() - 1;
    // The first column is the level: its entry in a row of R is the part of a column that is constant.
    let mut scale: Vec<f64> = (0..columns)
        .map(|j| {
            let (all, constant) = (triangle.column_norm(j), triangle.at(0, j));
            let varying = (all.powi(2) - constant.powi(2)).max(0.0).sqrt();
            if varying > 1e-7 * all {
                varying
            } else if all > 0.0 {
                all
            } else {
                1.0
            }
        })
        .collect();
    scale[0] = 0.0;
    let penalised = triangle.damped(&scale, PENALTY);
    let free: Vec<usize> = (0..columns).collect();
    let covariance = penalised.covariance(&free)?;
    let penalty = scale.iter().map(|scale| PENALTY * scale.powi(2));
    let suppressed: f64 = penalty.enumerate().map(|(j, d)| d * covariance[j][j]).sum();
    let coefficients = columns as f64 - suppressed;
    Some(penalised.at(columns, columns).powi(2) / (samples as f64 - coefficients))
}

/// The prediction of one output from the given number of past readings, the given number of rows ahead: a row for each sample, whose last
/// column is the reading; with the number of samples.
fn prediction(
    records: &[Record],
    model: &[Vec<f64>],
    output: usize,
    (past, ahead): (usize, usize),
) -> (Triangle, usize) {
    let others = past.min(PAST_OF_OTHERS);
    let (inputs, outputs) = records
        .first()
        .map_or((0, 0), |r| (r.inputs.len(), r.outputs.len()));
    // The level; readings and model of this output; inputs; the other outputs; the reading.
    let columns = 1 + past + past + 1 + inputs * others + (outputs - 1) * others;
    let mut triangle = Triangle::new(columns + 1);
    let mut values = Vec::with_capacity(columns + 1);
    let mut samples = 0;
    for (r, record) in records.iter().enumerate() {
        let series = |o: usize| &record.outputs[o].values;
        // Outputs may have different rates: the past of each is its last present readings.
        let there: Vec<Vec<usize>> = (0..outputs).map(|o| read_rows(series(o))).collect();
        let own = &there[output];
        for &k in own {
            let known = own.partition_point(|&j| j + ahead <= k);
            if known < past {
                continue;
            }
            values.clear();
            values.push(1.0);
            let before = &own[known - past..known];
            values.extend(before.iter().map(|&j| series(output)[j]));
            let simulated = &model[r * outputs + output];
            values.extend(before.iter().chain([&k]).map(|&j| simulated[j]));
            for input in &record.inputs {
                // Rows before this one only: in a loop the input of a row depends on the reading of that row.
                values.extend((1..=others).map(|lag| input.values[k.saturating_sub(lag)]));
            }
            for other in (0..outputs).filter(|o| *o != output) {
                let read = there[other].partition_point(|&j| j < k);
                values.extend(
                    there[other][read.saturating_sub(others)..read]
                        .iter()
                        .map(|&j| series(other)[j]),
                );
            }
            values.push(series(output)[k]);
            if values.len() == columns + 1 {
                triangle.push(&values);
                samples += 1;
            }
        }
    }
    triangle.finish();
    (triangle, samples)
}

#[cfg(test)]
mod tests {
    use ct_signals::{Channel, noise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Two outputs with the same noise spectrum, the second one read at every fifth row: their weights follow from their standard
    /// deviations.
    #[test]
    fn coloured_noise_of_a_slow_output_weighs_as_its_deviation() {
        const ROWS: usize = 4000;
        const DEVIATIONS: [f64; 2] = [0.016, 0.0256];
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut outputs = DEVIATIONS.map(|sigma| noise::ar1(ROWS, sigma, 0.85, &mut rng));
        for (k, value) in outputs[1].iter_mut().enumerate() {
            if k % 5 != 0 {
                *value = f64::NAN;
            }
        }
        let [first, second] = outputs;
        let record = Record {
            name: "record".into(),
            time: (0..ROWS).map(|k| k as f64).collect(),
            inputs: vec![Channel::new("u", "V", noise::white(ROWS, 1.0, &mut rng))],
            outputs: vec![
                Channel::new("y", "g/L", first),
                Channel::new("z", "g/L", second),
            ],
            ..Record::default()
        };
        let zeros = vec![vec![0.0; ROWS]; 2];
        let found = output_noise(&[record], &zeros);
        let ratio = found[1].zip(found[0]).map_or(f64::NAN, |(z, y)| z / y);
        let expected = DEVIATIONS[1] / DEVIATIONS[0];
        assert!((ratio / expected - 1.0).abs() < 0.15, "{ratio}");
    }
}
