//! Results of one model at one output: its error, where it fails, and the tests of its residual.

use ct_model::{Expression, Variable};
use ct_signals::{ArModel, parts};
use estimation::Fit;
use greybox::ModelSetup;
use serde::{Deserialize, Serialize};

use crate::HeldOut;
use crate::diagnostics::failures::{FailureKind, Failures, Series, Signal, locate};
use crate::residual_tests::ResidualTests;

/// Results of one model at one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutputStep {
    /// Its name.
    pub name: String,
    /// Root mean square of the simulation error on the fitted records, in the output's unit.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub rmse: f64,
    /// Simulation error on the held-out records.
    pub rmse_test: Option<f64>,
    /// `rmse_test` with the initial states of each record from its first 50 samples, which are not scored (the rule of the newer
    /// benchmarks); `None` if a record has fewer than 200.
    #[serde(default)]
    pub rmse_test_50: Option<f64>,
    /// The parts of `rmse_test`; `None` without held-out records.
    pub held_out_error: Option<HeldOutError>,
    /// Residual tests.
    pub tests: ResidualTests,
    /// Regions where the model fails.
    pub failures: Failures,
}

/// The mean squared error on held-out records, split into the parts of an offset, a gain and the rest, as root mean squares \[output
/// unit\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeldOutError {
    /// Mean of measured minus model, record by record.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub offset: f64,
    /// Part of the error that a factor on the model's deviations from its mean explains in addition to the offset.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub gain: f64,
    /// The rest of the error: the shape.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub shape: f64,
}

/// The results of a fitted model at each output. `simulated`: a series for each record and output, `noise`: that of each output.
#[must_use]
pub fn output_steps(
    setup: &ModelSetup,
    fit: &Fit,
    simulated: &[Vec<f64>],
    noise: &[ArModel],
    test: Option<&HeldOut>,
) -> Vec<OutputStep> {
    let (spec, records) = (setup.model().spec(), setup.records());
    let count = setup.outputs();
    let outputs: Vec<Expression> = spec
        .outputs
        .iter()
        .map(|output| Expression::Variable(output.variable))
        .collect();
    let is_read = |x: &usize| {
        let state = Expression::Variable(Variable::State(*x));
        outputs.iter().any(|output| *spec.behind(output) == state)
    };
    let hidden: Vec<usize> = (0..spec.states.len()).filter(|x| !is_read(x)).collect();
    let states = if hidden.is_empty() {
        Vec::new()
    } else {
        setup.simulate_states(&fit.x).unwrap_or_default()
    };
    // A simulation that fits the records has its states too.
    let hidden: &[usize] = if states.is_empty() { &[] } else { &hidden };
    let inputs = spec.inputs.iter().map(|input| Signal {
        kind: FailureKind::Input,
        name: &input.about.name,
        unit: &input.about.unit,
    });
    let of_states = hidden.iter().map(|&x| Signal {
        kind: FailureKind::State,
        name: &spec.states[x].about.name,
        unit: &spec.states[x].about.unit,
    });
    let signals: Vec<Signal> = inputs.chain(of_states).collect();
    // In a loop that the model needs, the controllers answer the difference from the readings: the disturbance is what noise would be.
    let disturbances = match setup.is_run_in_loop() {
        true => estimation::residuals(setup, &fit.x),
        false => None,
    };
    let residuals: Vec<Vec<f64>> = disturbances.unwrap_or_else(|| {
        records
            .iter()
            .flat_map(|record| &record.outputs)
            .zip(simulated)
            .map(|(y, model)| y.values.iter().zip(model).map(|(y, m)| y - m).collect())
            .collect()
    });
    let of_parts = parts::records_of_parts(records);
    let of_output = |o: usize| {
        let series: Vec<Series> = records
            .iter()
            .enumerate()
            .map(|(r, record)| {
                let inputs = record.inputs.iter().map(|input| input.values.as_slice());
                let own = hidden.iter();
                let own = own.map(|x| states[r * spec.states.len() + x].as_slice());
                Series {
                    record: of_parts[r],
                    time: &record.time,
                    signals: inputs.chain(own).collect(),
                    model: &simulated[r * count + o],
                    residual: &residuals[r * count + o],
                }
            })
            .collect();
        OutputStep {
            name: spec.about(spec.outputs[o].variable).name.clone(),
            rmse: fit.rmse[o],
            rmse_test: test.map(|test| test.rmse[o]),
            rmse_test_50: test.and_then(|test| Some(test.rmse_50.as_ref()?[o])),
            held_out_error: test.map(|test| test.errors[o]),
            tests: {
                // Of the first record, or of its part with the most readings.
                let of_first = (0..records.len()).take_while(|&part| of_parts[part] == 0);
                let readings = |part: &usize| {
                    let output = &records[*part].outputs[o];
                    output.values.len() - output.missing()
                };
                let part = of_first.max_by_key(readings).unwrap_or(0);
                let external = setup.external_signals(&records[part]);
                ResidualTests::of(&external, &residuals[part * count + o])
            },
            failures: locate(&series, &signals, &noise[o]),
        }
    };
    (0..count).map(of_output).collect()
}

impl HeldOutError {
    /// The parts of the error of pairs of measured and simulated values of several records: mean squares over all of them.
    #[must_use]
    pub fn of(records: &[Vec<(f64, f64)>]) -> Self {
        let mut sums = [0.0; 3];
        for pairs in records {
            for (sum, part) in sums.iter_mut().zip(error_parts(pairs)) {
                *sum += part;
            }
        }
        let count: usize = records.iter().map(Vec::len).sum();
        // NaN for an output without scored samples.
        let [offset, gain, shape] = sums.map(|sum| (sum / count as f64).sqrt());
        Self {
            offset,
            gain,
            shape,
        }
    }
}

/// Sums of squares of measured minus model: the part of its mean, the part of a factor on the model's deviations from their mean, and the
/// rest.
fn error_parts(pairs: &[(f64, f64)]) -> [f64; 3] {
    let n = pairs.len().max(1) as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / n;
    let (error, model) = (mean(&|(y, m)| y - m), mean(&|(_, m)| *m));
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        pairs.iter().map(|(y, m)| of(y - m, m - model)).sum()
    };
    let all = sum(&|e, _| e * e);
    let offset = n * error * error;
    let (cross, power) = (sum(&|e, m| e * m), sum(&|_, m| m * m));
    let gain = if power > 0.0 {
        cross * cross / power
    } else {
        0.0
    };
    [offset, gain, (all - offset - gain).max(0.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_out_error_is_split_into_offset_gain_and_shape() {
        // Measured: the model's deviations from 5, times 1.5, plus 2, plus an independent oscillation.
        let model = |k: usize| if k % 4 < 2 { 6.0 } else { 4.0 };
        let wave = |k: usize| if k.is_multiple_of(2) { 0.3 } else { -0.3 };
        let pairs: Vec<(f64, f64)> = (0..400)
            .map(|k| (7.0 + 1.5 * (model(k) - 5.0) + wave(k), model(k)))
            .collect();
        let error = HeldOutError::of(&[pairs[..200].to_vec(), pairs[200..].to_vec()]);
        assert!((error.offset - 2.0).abs() < 1e-12 && (error.gain - 0.5).abs() < 1e-12);
        assert!((error.shape - 0.3).abs() < 1e-12);
    }
}
