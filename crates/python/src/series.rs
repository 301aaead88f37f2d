//! Results as Python takes them: curves, matrices, bins of the residual, units.

use ct_signals::Record;
use effect_search::Failures;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// Name, measured values and values of each step of an output.
type OutputSeries<'py> = (
    String,
    Bound<'py, PyArray1<f64>>,
    Vec<Bound<'py, PyArray1<f64>>>,
);

/// Name of a record, whether it is held out, its times \[s\], and its outputs.
pub type RecordSeries<'py> = (
    String,
    bool,
    Bound<'py, PyArray1<f64>>,
    Vec<OutputSeries<'py>>,
);

/// The outputs of a record by its position: names and measured values, with the series that each step simulated.
pub fn simulated_series<'py, 'a>(
    py: Python<'py>,
    record: usize,
    outputs: impl ExactSizeIterator<Item = (String, &'a [f64])>,
    steps: &[&[Vec<f64>]],
) -> Vec<OutputSeries<'py>> {
    let first = record * outputs.len();
    let of_output = |(o, (name, measured)): (usize, (String, &[f64]))| {
        let series = steps.iter().filter_map(|step| step.get(first + o));
        let series = series.map(|values| PyArray1::from_slice(py, values));
        (name, PyArray1::from_slice(py, measured), series.collect())
    };
    outputs.enumerate().map(of_output).collect()
}

/// A bin of the residual: index of the record (for a window), from, to, samples, mean, root mean square, whether the model fails clearly in
/// the bin.
pub type Bin = (Option<usize>, f64, f64, usize, f64, f64, bool);
/// A kind of bin, the name of its input or state, and the bin.
pub type NamedBin = (&'static str, Option<String>, Bin);

/// Bins of the residual, by kind.
pub fn bins(failures: &Failures) -> Vec<NamedBin> {
    let unnamed = [
        ("time", &failures.by_time),
        ("output", &failures.by_output),
        ("direction", &failures.by_direction),
        ("frequency", &failures.by_frequency),
    ];
    let unnamed = unnamed.into_iter().map(|(by, bins)| (by, None, bins));
    let inputs = failures.by_input.iter().map(|signal| ("input", signal));
    let states = failures.by_state.iter().map(|signal| ("state", signal));
    let named = inputs.chain(states);
    let named = named.map(|(by, signal)| (by, Some(signal.name.clone()), &signal.bins));
    let all = unnamed.chain(named).flat_map(|(by, name, bins)| {
        bins.iter().map(move |b| {
            let bin = (b.record, b.from, b.to, b.count, b.mean, b.rms, b.fails);
            (by, name.clone(), bin)
        })
    });
    all.collect()
}

/// Names and matrix; none where the records do not determine all that was fitted.
pub type Covariance<'py> = Option<(Vec<String>, Bound<'py, PyArray2<f64>>)>;

/// The unit of each output of records, which is that of the first one.
pub fn units_of(records: &[Record]) -> Vec<String> {
    let outputs = records.first().map_or(&[][..], |record| &record.outputs);
    outputs.iter().map(|output| output.unit.clone()).collect()
}
