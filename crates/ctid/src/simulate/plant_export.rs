//! The curves of a plant's fit.

use ct_signals::{Heading, ReadSummary};
use missing_effect::Options;

use super::{Curves, FittedRecord, TimeColumn};
use crate::Error;
use crate::input::{Files, Input};
use crate::model_file::ModelFile;
use crate::own_model::Exported;

/// Fits a plant with its effects to records.
///
/// # Errors
/// One line that names the file, the place and the mend.
pub(crate) fn export(
    model: ModelFile,
    files: &Files,
    options: &Options,
) -> Result<(Exported, Vec<ReadSummary>), Error> {
    let (columns, name) = (model.columns.clone(), model.plant.id().to_string());
    let Input { problem, summaries } = files.read_with(model)?;
    let first = &problem.records[0];
    let name_of = |names: &[String], i: usize, channel: &ct_signals::Channel| {
        let named = names.get(i).filter(|name| !name.is_empty());
        let name = named.map(|name| Heading::of(name).name);
        (
            name.unwrap_or_else(|| channel.name.clone()),
            channel.unit.clone(),
        )
    };
    let inputs = first.inputs.iter().enumerate();
    let inputs = inputs.map(|(i, channel)| name_of(&columns.inputs, i, channel));
    let outputs = first.outputs.iter().enumerate();
    let outputs = outputs.map(|(i, channel)| name_of(&columns.outputs, i, channel));
    let (inputs, outputs): (Vec<_>, Vec<_>) = (inputs.collect(), outputs.collect());
    let fitted = missing_effect::fitted(&problem, options, |fitted| {
        let model = fitted.setup.simulate(&fitted.fit.x)?.output;
        Ok((fitted.setup.records.to_vec(), model))
    });
    let (records, model) = fitted
        .map_err(|error| files.blame(error))?
        .map_err(|error: greybox::Error| files.blame(error.into()))?;
    let mut all = Vec::new();
    for (record, model) in records.into_iter().zip(model.chunks(outputs.len())) {
        let path = files
            .data
            .iter()
            .find(|path| files.name_of(path) == record.name);
        let path = path.unwrap_or(&files.data[0]);
        all.push(FittedRecord {
            time: TimeColumn::of(path, &columns, &record)?,
            record,
            model: model.to_vec(),
        });
    }
    let exported = Exported {
        schema: 1,
        model: name,
        fitted_to: problem.records.iter().map(|r| r.name.clone()).collect(),
        text: None,
        curves: Some(Curves {
            inputs,
            outputs,
            records: all,
        }),
    };
    Ok((exported, summaries))
}
