//! Errors in the columns of a record that the option `--columns` names.

use ct_signals::{ColumnFault, Error as RecordError, ReadError};

use crate::Error;

/// The error with the correction for the option; otherwise that for `[columns]` of a model file.
pub(crate) fn of_option(error: RecordError) -> Error {
    const OPTION: &str = "--columns TIME,INPUT,OUTPUT";
    let RecordError::Read(ReadError::Column { file, row, fault }) = &error else {
        return error.into();
    };
    let mend = match &**fault {
        ColumnFault::Missing { .. } => format!("name it with {OPTION}"),
        ColumnFault::Ambiguous { .. } => {
            format!("say which with {OPTION}, and rename columns of the same name")
        }
        ColumnFault::Shared { .. } => format!("give each its own column with {OPTION}"),
        ColumnFault::Unit { column, .. } => format!("write \"{column}\" in {OPTION}"),
        _ => return error.into(),
    };
    Error::Columns(format!(
        "{file}, row {row}{}",
        fault.said("--columns", &mend)
    ))
}
