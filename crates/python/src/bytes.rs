//! Objects as bytes, for `pickle`: MessagePack, which can store NaN and infinity.

use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::error::Error;

/// The version of ctid that wrote the bytes; other versions may have other layouts.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A value as bytes.
pub fn of(value: &impl Serialize) -> PyResult<Vec<u8>> {
    rmp_serde::to_vec_named(&(VERSION, value))
        .map_err(|error| Error::new_err(format!("this object cannot be pickled: {error}")))
}

/// A value from its bytes.
pub fn read<T: DeserializeOwned>(bytes: &[u8]) -> PyResult<T> {
    let other =
        |why: String| Error::new_err(format!("this is not an object of ctid {VERSION}: {why}"));
    // The version comes first, because the rest may have another layout.
    let mut reader = rmp_serde::Deserializer::from_read_ref(bytes);
    let all = Versioned::<T>::deserialize(&mut reader);
    let Versioned(version, value) = all.map_err(|error| other(error.to_string()))?;
    if version != VERSION {
        return Err(other(format!(
            "ctid {version} has pickled it; make it again"
        )));
    }
    Ok(value)
}

/// A value after the version that has written it.
#[derive(Deserialize)]
struct Versioned<T>(String, T);
