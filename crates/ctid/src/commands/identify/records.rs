//! Records for `--columns` and `--model`.

use std::path::Path;

use ct_signals::{ReadOptions, Reading, Record, quoted, read_csv};

use super::{Identify, Layout};
use crate::Error;
use crate::column_errors::of_option;

impl Identify {
    /// Source of the column names for error messages: the model file, or the option.
    pub(super) fn named_by(&self) -> fn(ct_signals::Error) -> Error {
        if self.model.is_some() {
            Error::from
        } else {
            of_option
        }
    }

    /// The record without a reference that `--columns` does not name.
    pub(super) fn without_unnamed(&self, mut record: Record) -> Record {
        let named = self
            .columns
            .as_ref()
            .map(|columns| !columns.references.is_empty());
        if named == Some(false) {
            record.references.clear();
        }
        record
    }

    /// Reads a record for `--columns` and `--model`.
    pub(super) fn read(&self, path: &Path, (columns, hold, own): Layout) -> Result<Reading, Error> {
        let options = ReadOptions {
            hold,
            ..self.reading.options()
        };
        let reading = read_csv(path, columns, &options).map_err(self.named_by())?;
        let Reading {
            record,
            mut summary,
        } = reading;
        let mut record = self.without_unnamed(record);
        if let Some(own) = own {
            own.convert(&mut record, &mut summary)?;
        }
        Ok(Reading { record, summary })
    }

    /// A record that is simulated only, in the units of the one that is fitted.
    pub(super) fn read_test(
        &self,
        path: &Path,
        layout: Layout,
        fitted: &Record,
    ) -> Result<Reading, Error> {
        let Reading { record, summary } = self.read(path, layout)?;
        let inputs = record.inputs.iter().zip(&fitted.inputs);
        let pairs = inputs.chain(record.outputs.iter().zip(&fitted.outputs));
        for (test, fitted) in pairs {
            if test.unit != fitted.unit {
                return Err(Error::file(
                    path,
                    format!(
                        "\"{}\" is in [{}], and in the record that is fitted in [{}]; convert one of them",
                        quoted(&test.name),
                        quoted(&test.unit),
                        quoted(&fitted.unit)
                    ),
                ));
            }
        }
        Ok(Reading { record, summary })
    }
}
