//! Report of a fitted model.

use ct_signals::{ArModel, Record, residual_tests};
use greybox::{Fit, Noise, Setup, robust, weighted_rms};

use effect_search::failures::{FailureKind, Series, Signal, locate};
use effect_search::{HeldOutError, LATER_ROWS, MOST_OF_RECORD, OutputStep, ResidualTests};

use crate::{
    Error, Parameter, PerOutput, Step,
    base::closed_loop::widened,
    diagnostics::{
        held_out::{HEAD, Head, hold_out},
        residual_tests::input_p,
    },
    fit::{node::Node, noise_model::NOISE_ORDER},
};

/// The number of an only output; NaN of several.
pub(crate) fn of_one(outputs: &[f64]) -> f64 {
    match outputs {
        [only] => *only,
        _ => f64::NAN,
    }
}

/// Standard errors with the noise model of the model's own residual, whatever the weighting of its fit.
fn std_errors(node: &Node) -> Result<Vec<Option<f64>>, Error> {
    Ok(if node.fit.noise.order() > 0 {
        node.fit.std_errors()
    } else {
        robust(&node.setup, &node.fit, NOISE_ORDER)?.std_errors
    })
}

/// All entries of the vector with their standard errors.
pub(crate) fn parameters(setup: &Setup, fit: &Fit, std_errors: &[Option<f64>]) -> Vec<Parameter> {
    let priors = setup.prior_values();
    setup
        .names()
        .iter()
        .zip(&fit.x)
        .zip(std_errors)
        .zip(setup.unit_labels())
        .map(|(((name, value), std_error), unit)| Parameter {
            name: name.clone(),
            value: *value,
            std_error: *std_error,
            unit,
            prior: priors.get(name).copied(),
        })
        .collect()
}

/// A test result; `None` if there are too few pairs of samples.
fn testable<T>(test: Result<T, ct_signals::Error>) -> Result<Option<T>, ct_signals::Error> {
    match test {
        Err(ct_signals::Error::TooFewSamples { .. }) => Ok(None),
        test => test.map(Some),
    }
}

/// The residual tests of an output, on the first record or, if that is cut, its longest part.
fn tests(node: &Node, residuals: &[Vec<f64>], output: usize) -> Result<ResidualTests, Error> {
    let setup = &node.setup;
    let samples_of = |residual: &[f64]| residual.iter().filter(|e| !e.is_nan()).count();
    let own = residuals.iter().skip(output).step_by(setup.outputs());
    let parts = setup.records.iter().zip(own);
    let parts = parts.take_while(|(record, _)| record.name == setup.records[0].name);
    let (record, residual) = parts
        .reduce(|a, b| {
            if samples_of(b.1) > samples_of(a.1) {
                b
            } else {
                a
            }
        })
        .unwrap_or((&setup.records[0], &residuals[output]));
    let samples = samples_of(residual);
    let lags = (samples / 10).clamp(2, 60);
    let portmanteau = (samples / 10).clamp(2, 25);
    let (cross, _) = testable(residual_tests::prewhitened_input_test(
        &record.inputs[0].values,
        residual,
        lags,
    ))?
    .unwrap_or((vec![f64::NAN; lags + 1], f64::NAN));
    // The share of pairs of samples is the square of the share of samples.
    let bound = 1.96 * (record.len() as f64).sqrt() / samples.max(1) as f64;
    Ok(ResidualTests {
        autocorrelation: residual_tests::autocorrelation(residual, lags),
        cross_correlation: cross,
        autocorrelation_bound: bound,
        cross_correlation_bound: bound,
        whiteness_p: testable(residual_tests::ljung_box(residual, portmanteau, 0))?
            .unwrap_or(f64::NAN),
        input_p: input_p(node, output)?,
    })
}

/// Report of one model; `bic` is its criterion with the noise model of its own residual, `judge` the noise for the residual tests; `widen`:
/// the standard errors allow for the bias of feedback.
pub(crate) fn report(
    node: &Node,
    bic: f64,
    noise_floor: &Noise,
    test: &[Record],
    widen: bool,
) -> Result<Step, Error> {
    let Node { setup, fit, added } = node;
    let last = added.last();
    let simulated = setup.simulate(&fit.x)?.output;
    let residuals = setup.residuals(&fit.x)?;
    let held_out = hold_out(node, test, HEAD)?;
    let are_long = |record: &Record| record.len() >= MOST_OF_RECORD * LATER_ROWS;
    // A model whose simulation over this number of rows is not finite has no such score.
    let later = test
        .iter()
        .all(are_long)
        .then(|| hold_out(node, test, Head::Rows(LATER_ROWS)).ok())
        .flatten()
        .flatten()
        .filter(|later| later.outputs.iter().all(|(count, ..)| *count > 0));
    let count = setup.outputs();
    let first = &setup.records[0];
    let inputs: Vec<Signal> = first
        .inputs
        .iter()
        .map(|input| Signal {
            kind: FailureKind::Input,
            name: &input.name,
            unit: &input.unit,
        })
        .collect();
    let of_output = |output: usize| {
        let own = simulated.iter().zip(&residuals).skip(output).step_by(count);
        let of_parts = ct_signals::parts::records_of_parts(setup.records);
        let series: Vec<Series> = setup
            .records
            .iter()
            .zip(of_parts)
            .zip(own)
            .map(|((record, of), (model, residual))| Series {
                record: of,
                time: &record.time,
                signals: record.inputs.iter().map(|u| u.values.as_slice()).collect(),
                model,
                residual,
            })
            .collect();
        let failures = locate(&series, &inputs, noise_floor.output(output));
        let held_out = held_out.as_ref().map(|held_out| held_out.outputs[output]);
        Ok(OutputStep {
            name: first.outputs[output].name.clone(),
            rmse: fit.rmse[output],
            rmse_test: held_out.map(|(_, rmse, _)| rmse),
            rmse_test_50: later.as_ref().map(|later| later.outputs[output].1),
            held_out_error: held_out.map(|(.., error)| error),
            tests: tests(node, &residuals, output)?,
            failures,
        })
    };
    let outputs = (0..count)
        .map(of_output)
        .collect::<Result<Vec<_>, Error>>()?;
    let mut errors = std_errors(node)?;
    if widen {
        errors = widened(node, errors)?;
    }
    let named = |values: &[f64]| PerOutput::of(&first.outputs, values);
    let floors: Vec<f64> = noise_floor.iter().map(ArModel::stationary_std).collect();
    let of_test = held_out.as_ref().map(|held_out| {
        let of = |(count, rmse, _): &(usize, f64, HeldOutError)| (*count, *rmse);
        let (counts, rmse): (Vec<usize>, Vec<f64>) = held_out.outputs.iter().map(of).unzip();
        (weighted_rms(&rmse, &floors, &counts), rmse)
    });
    let mut series = simulated;
    series.extend(held_out.into_iter().flat_map(|held_out| held_out.series));
    Ok(Step {
        added: last.map(|placed| placed.effect.id.to_string()),
        place: last.and_then(|placed| place_name(node, *placed)),
        rmse: of_one(&fit.rmse),
        rmse_test: of_test
            .as_ref()
            .map(|(_, rmse)| of_one(rmse))
            .filter(|rmse| !rmse.is_nan()),
        rmse_per_output: named(&fit.rmse),
        rmse_test_per_output: of_test.as_ref().map(|(_, rmse)| named(rmse)),
        weighted_rmse: weighted_rms(&fit.rmse, &floors, setup.samples_per_output()),
        weighted_rmse_test: of_test.map(|(weighted, _)| weighted),
        bic,
        parameters: parameters(setup, fit, &errors),
        starts: fit.starts,
        starts_agree: fit.agree,
        outputs,
        simulated: series,
    })
}

/// The name of its vessel, pump or sensor, where the effect acts in one of several.
pub(crate) fn place_name(node: &Node, placed: plants::Placed) -> Option<String> {
    let structure = &node.setup.structure;
    let name = placed.place_name(structure.plant, &structure.known);
    name.map(str::to_string)
}
