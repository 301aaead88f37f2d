//! Memory in bytes of the data that grow with the records.

use ct_signals::Record;
use missing_effect::Diagnosis;

fn bytes<'a>(series: impl IntoIterator<Item = &'a Vec<f64>>) -> usize {
    let series = series.into_iter();
    series.map(|values| size_of_val(values.as_slice())).sum()
}

/// The numbers of a record.
pub(super) fn of_record(record: &Record) -> usize {
    let channels = record.channels().map(|channel| &channel.values);
    bytes(std::iter::once(&record.time).chain(channels))
}

/// Copy of the records, simulations of the models, and the unexplained error.
pub(super) fn of_diagnosis(diagnosis: &Diagnosis) -> usize {
    let records = diagnosis.records.iter();
    let records = records.flat_map(|shown| {
        let inputs = shown.inputs.iter().map(|input| &input.values);
        std::iter::once(&shown.time)
            .chain(inputs)
            .chain(&shown.outputs)
    });
    let runs = diagnosis.steps.iter().flat_map(|step| &step.simulated);
    let paths = diagnosis.unknown.iter();
    let paths = paths.flat_map(|unknown| [&unknown.time, &unknown.value, &unknown.std_error]);
    bytes(records) + bytes(runs) + bytes(paths)
}
