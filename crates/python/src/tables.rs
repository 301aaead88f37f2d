//! Published tables, computed again.

use paper_tables::{baysse, udink};
use pyo3::prelude::*;

use crate::json::json;
use crate::work;

/// Output of `ctid tables udink --json`, without the entry `written_by`.
#[pyfunction]
pub fn udink_tables(py: Python<'_>, runs: usize, seed: u64) -> PyResult<String> {
    let settings = udink::Settings::default();
    let found = work::run(py, None, |_, _| {
        Ok(udink::study(&settings, runs, seed, &|_| {})?)
    })?;
    json(&found)
}

/// Output of `ctid tables baysse --json`, without the entry `written_by`.
#[pyfunction]
pub fn baysse_tables(py: Python<'_>, runs: usize, seed: u64) -> PyResult<String> {
    let found = work::run(py, None, |_, _| Ok(baysse::study(runs, seed, &|_| {})?))?;
    json(&found)
}
