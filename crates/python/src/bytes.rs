//! Objects as bytes, for `pickle`: CBOR, which keeps numbers that are none.

use pyo3::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::Error;

/// The version of ctid that has written them; others may have other layouts.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A value as bytes.
pub fn of(value: &impl Serialize) -> PyResult<Vec<u8>> {
    let mut bytes = Vec::new();
    ciborium::into_writer(&(VERSION, value), &mut bytes)
        .map_err(|error| Error::new_err(format!("this object cannot be pickled: {error}")))?;
    Ok(bytes)
}

/// A value from its bytes.
pub fn read<T: DeserializeOwned>(bytes: &[u8]) -> PyResult<T> {
    let other = |why: String| Error::new_err(format!("this is no object of ctid {VERSION}: {why}"));
    let (version, value): (String, ciborium::Value) =
        ciborium::from_reader(bytes).map_err(|error| other(error.to_string()))?;
    if version != VERSION {
        return Err(other(format!(
            "ctid {version} has pickled it; make it again"
        )));
    }
    value
        .deserialized()
        .map_err(|error| other(error.to_string()))
}
