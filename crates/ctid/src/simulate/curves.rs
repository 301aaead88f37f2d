//! Curves and residuals of a fit as CSV.

use ct_signals::{Columns, Record};

use super::TimeColumn;
use crate::Error;
use crate::csv_text::{cell, csv_text, header};
use crate::input::Files;

/// A record that was fitted.
#[derive(Debug, Clone)]
pub(crate) struct FittedRecord {
    pub time: TimeColumn,
    pub record: Record,
    /// The model's outputs, row by row.
    pub model: Vec<Vec<f64>>,
}

impl FittedRecord {
    /// Records with the outputs of a model, series by series.
    ///
    /// # Errors
    /// Where a file cannot be read any more.
    pub fn all(
        records: &[Record],
        model: &[Vec<f64>],
        (files, columns): (&Files, &Columns),
    ) -> Result<Vec<Self>, Error> {
        let outputs = records
            .first()
            .map_or(1, |record| record.outputs.len().max(1));
        let both = records.iter().zip(model.chunks(outputs));
        let all = both.map(|(record, model)| {
            let path = files.path_of(&record.name);
            Ok(Self {
                time: TimeColumn::of(path.unwrap_or(&files.data[0]), columns, record)?,
                record: record.clone(),
                model: model.to_vec(),
            })
        });
        all.collect()
    }
}

/// Curves of all fitted records.
#[derive(Debug, Clone)]
pub(crate) struct Curves {
    /// Names and units of the inputs.
    pub inputs: Vec<(String, String)>,
    /// Names and units of the outputs.
    pub outputs: Vec<(String, String)>,
    pub records: Vec<FittedRecord>,
}

impl Curves {
    /// A row for each instant: record, time, inputs, and for each output the measured value, the model and the residual.
    pub fn csv(&self) -> String {
        let time = self.records.first().map(|r| r.time.header.clone());
        let mut head = vec!["record".to_string(), time.unwrap_or_default()];
        head.extend(self.inputs.iter().map(|(name, unit)| header(name, unit)));
        for (name, unit) in &self.outputs {
            let columns = ["", " model", " residual"];
            head.extend(columns.map(|what| header(&format!("{name}{what}"), unit)));
        }
        let rows = self.records.iter().flat_map(|fitted| {
            let FittedRecord {
                time,
                record,
                model,
            } = fitted;
            (0..record.len()).map(move |k| {
                let mut row = vec![record.name.clone(), time.cells[k].clone()];
                row.extend(record.inputs.iter().map(|input| cell(input.values[k])));
                for (output, model) in record.outputs.iter().zip(model) {
                    let (measured, model) = (output.values[k], model[k]);
                    row.extend([measured, model, measured - model].map(cell));
                }
                row
            })
        });
        csv_text(std::iter::once(head).chain(rows))
    }
}
