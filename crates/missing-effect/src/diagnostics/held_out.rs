//! Held-out records: their initial states are fitted on the first samples, the rest is scored.

use ct_signals::{Channel, Record};
use greybox::{Stopping, fit_initial_levels};

use effect_search::HeldOutError;

use crate::{Error, PerOutput, Step, fit::node::Node};

/// The begin of a held-out record, for the fit of its initial levels; it is not scored.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Head {
    /// This number of samples of each output.
    Samples(usize),
    /// This number of rows.
    Rows(usize),
}

pub(crate) const HEAD: Head = Head::Samples(5);

/// Simulation of held-out records by a model.
pub(crate) struct HeldOut {
    /// A series for each record and output.
    pub series: Vec<Vec<f64>>,
    /// For each output: number of scored samples, their root mean square error, and its parts.
    pub outputs: Vec<(usize, f64, HeldOutError)>,
}

/// Rows of the begin: the initial levels follow from them.
fn rows_of(output: &Channel, head: Head) -> usize {
    match head {
        Head::Samples(samples) => {
            let present = output.values.iter().enumerate();
            present
                .filter(|(_, value)| !value.is_nan())
                .nth(samples - 1)
                .map_or(output.values.len(), |(last, _)| last + 1)
        }
        Head::Rows(rows) => rows.min(output.values.len()),
    }
}

/// A record up to the end of the begin of every output, without further samples.
fn beginning(record: &Record, head: Head) -> Record {
    let rows = record.outputs.iter().map(|y| rows_of(y, head)).max();
    let rows = rows.unwrap_or(0);
    let mut begun = Record {
        references: Vec::new(),
        ..record.rows(0..rows)
    };
    for (output, whole) in begun.outputs.iter_mut().zip(&record.outputs) {
        output.values[rows_of(whole, head)..].fill(f64::NAN);
    }
    begun
}

/// Initial levels from the first samples with all other parameters fixed; scored on the rest.
pub(crate) fn hold_out(node: &Node, test: &[Record], head: Head) -> Result<Option<HeldOut>, Error> {
    if test.is_empty() {
        return Ok(None);
    }
    let parameters = &node.fit.x[..node.setup.parameter_count()];
    let heads: Vec<Record> = test.iter().map(|record| beginning(record, head)).collect();
    let mut begun = node.setup.with_records(&heads)?;
    // A fit to a few samples takes no time, and an error from wrong levels would not be an error of the model.
    (begun.time_limit, begun.interrupt) = (None, None);
    let x = fit_initial_levels(
        &begun,
        parameters,
        Stopping {
            evaluations: 60,
            cost: 1e-10,
        },
    )?;
    let series = node.setup.with_records(test)?.simulate(&x)?.output;
    let outputs = node.setup.outputs();
    let of_output = |o: usize| {
        let scored = test.iter().zip(series.chunks_exact(outputs));
        let scored = scored.map(|(record, models)| {
            let measured = record.outputs[o].values.iter().copied();
            let pairs = measured.zip(models[o].iter().copied());
            let pairs = pairs.skip(rows_of(&record.outputs[o], head));
            pairs.filter(|(measured, _)| !measured.is_nan()).collect()
        });
        let scored: Vec<Vec<(f64, f64)>> = scored.collect();
        let squares = scored.iter().flatten().map(|(y, m)| (y - m).powi(2));
        let count = scored.iter().map(Vec::len).sum();
        let rmse = (squares.sum::<f64>() / count as f64).sqrt();
        (count, rmse, HeldOutError::of(&scored))
    };
    let outputs = (0..outputs).map(of_output).collect();
    Ok(Some(HeldOut { series, outputs }))
}

/// The error on held-out records at each output \[output unit\].
pub(crate) fn held_out_rmse(node: &Node, test: &[Record]) -> Result<Vec<f64>, Error> {
    let held_out = hold_out(node, test, HEAD)?.map_or_else(Vec::new, |held_out| held_out.outputs);
    Ok(held_out.into_iter().map(|(_, rmse, _)| rmse).collect())
}

/// The share of the first model's excess error on held-out records that the last model explains.
pub(crate) fn share_on_held_out(steps: &[Step], floor: &PerOutput) -> Option<f64> {
    let [first, .., last] = steps else {
        return None;
    };
    // Mean over the outputs, each divided by its floor.
    let mean_square = |step: &Step| -> Option<f64> {
        let errors = step.rmse_test_per_output.as_ref()?.values();
        let squares = errors.zip(floor.values());
        let sum: f64 = squares.map(|(rmse, floor)| (rmse / floor).powi(2)).sum();
        Some(sum / floor.0.len() as f64)
    };
    let (before, after) = (mean_square(first)?, mean_square(last)?);
    // If the error is noise, there is no share to explain.
    (before > 1.0).then(|| (before - after) / (before - after.min(1.0)))
}
