//! Errors of computations, with the names of their records.

use std::fmt::Display;

use ct_signals::{Record, record_names};

use crate::Error;

/// An error of a computation or of a search, with its records.
pub(super) fn blame(records: &[Record], error: &impl Display) -> Error {
    Error::File {
        file: record_names(records).join(", "),
        what: error.to_string(),
    }
}

/// An error of the search, with its records.
pub(super) fn blame_search(records: &[Record], error: effect_search::Error) -> Error {
    match error {
        effect_search::Error::Fit(error) => blame(records, &error),
        other => Error::Columns(other.to_string()),
    }
}
