//! Pages hold the plotly.js of the Python package `plotly`: this extension has none.

use pyo3::prelude::*;

/// A page with plotly.js in it; `packed` is gzipped and in base64.
#[pyfunction]
pub fn with_plotly(page: &str, packed: &str) -> String {
    ctid::report::with_plotly(page, packed)
}
