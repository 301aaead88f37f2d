//! Results as the program writes them.

use pyo3::prelude::*;
use serde::Serialize;

use crate::error;

/// A result as the program writes it.
pub fn json(found: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(found).map_err(|error| error::Error::new_err(error.to_string()))
}
