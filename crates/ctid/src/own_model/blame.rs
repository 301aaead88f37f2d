//! Errors of computations, with the names of their records.

use ct_signals::{Record, record_names};

use crate::Error;

/// An error of a computation or of a search, with its records.
pub(super) fn blame(records: &[Record], error: impl Into<effect_search::Error>) -> Error {
    Error::Fit {
        file: record_names(records).join(", "),
        source: Box::new(error.into()),
    }
}

/// An error of the search, with its records.
pub(super) fn blame_search(records: &[Record], error: effect_search::Error) -> Error {
    match error {
        error @ effect_search::Error::Fit(_) => blame(records, error),
        other => Error::Search(Box::new(other)),
    }
}
