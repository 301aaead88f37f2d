//! What is wrong with the columns of a record, with the mend for the place where they are named: `[columns]` of a model
//! file, or the option `--columns`.

use ct_signals::Error as Record;

use crate::Error;

/// The units that a time may have.
const TIMES: [&str; 6] = ["us", "ms", "s", "min", "h", "d"];

/// Where there is a model file.
pub(crate) fn of_columns(error: Record) -> Error {
    match error {
        // No constant of the model is in the unit of the time.
        Record::UnitContradiction {
            file,
            row,
            column,
            file_unit,
            model_unit,
        } if [&file_unit, &model_unit]
            .iter()
            .all(|unit| TIMES.contains(&unit.as_str())) =>
        {
            Error::Columns(format!(
                "{file}, row {row}, column \"{column}\": the file says {file_unit} but the model says {model_unit}; convert the \
                 column, or write \"{column}\" under [columns]: us, ms, s, min, h and d are understood"
            ))
        }
        Record::MissingColumn {
            file,
            row,
            role,
            wanted,
            columns,
        } => {
            let set = if columns.ends_with('?') {
                " Set"
            } else {
                "; set"
            };
            Error::Columns(format!(
                "{file}, row {row}: no column {wanted} for the {role}; the file has {columns}{set} {role} = \"...\" under [columns]"
            ))
        }
        error => error.into(),
    }
}

/// Where there is none.
pub(crate) fn of_option(error: Record) -> Error {
    const OPTION: &str = "--columns TIME,INPUT,OUTPUT";
    Error::Columns(match error {
        Record::MissingColumn {
            file,
            row,
            role,
            wanted,
            columns,
        } => {
            let name = if columns.ends_with('?') {
                " Name"
            } else {
                "; name"
            };
            format!(
                "{file}, row {row}: no column {wanted} for the {role}; the file has {columns}{name} it with {OPTION}"
            )
        }
        Record::AmbiguousColumn {
            file,
            row,
            role,
            candidates,
        } => format!(
            "{file}, row {row}: {candidates} could each be the {role}; say which with {OPTION}, and rename columns of the same name"
        ),
        Record::SharedColumn {
            file,
            row,
            column,
            first,
            second,
        } => format!(
            "{file}, row {row}, column \"{column}\": it is named both as {first} and as {second}; give each its own column with {OPTION}"
        ),
        Record::UnitContradiction {
            file,
            row,
            column,
            file_unit,
            model_unit,
        } => format!(
            "{file}, row {row}, column \"{column}\": the file says {file_unit} but --columns says {model_unit}; write \"{column}\" in {OPTION}"
        ),
        error => return error.into(),
    })
}
