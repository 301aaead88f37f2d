//! Errors of the program as Python exceptions, whose messages name arguments of Python.

use ctid::MessageNames;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::message_names::PYTHON;

pyo3::create_exception!(
    ctid,
    Error,
    PyValueError,
    "An input that ctid rejects. The message is one line that names the place and the correction."
);
pyo3::create_exception!(ctid, DataError, Error, "An error in records.");
pyo3::create_exception!(
    ctid,
    ModelError,
    Error,
    "An error in a model, its parameters or its effects."
);

/// The exception of an error of the program.
pub fn of(error: &ctid::Error) -> PyErr {
    worded(error, &PYTHON)
}

/// The exception of an error of the program, with names of arguments.
pub fn worded(error: &ctid::Error, names: &MessageNames) -> PyErr {
    use ctid::Error as E;
    let message = ctid::one_line(&error.worded(names));
    match error {
        E::AtLine { .. }
        | E::Text { .. }
        | E::UnknownEffect(_)
        | E::Usage(_)
        | E::Setting(_)
        | E::Plant(_)
        | E::Experiment(_)
        | E::PlantExperiment(_) => ModelError::new_err(message),
        E::File { .. }
        | E::Columns(_)
        | E::Record(_)
        | E::Fit { .. }
        | E::Search(_)
        | E::Identification(_) => DataError::new_err(message),
        _ => Error::new_err(message),
    }
}

/// The exception of an error of the records.
pub fn of_data(error: impl ToString) -> PyErr {
    DataError::new_err(ctid::one_line(&error.to_string()))
}

/// The exception of an error of the model or the arguments.
pub fn of_model(error: impl ToString) -> PyErr {
    ModelError::new_err(ctid::one_line(&error.to_string()))
}
