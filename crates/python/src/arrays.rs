//! Arguments that are arrays of numbers.

use numpy::ndarray::Dimension;
use numpy::{PyArray, PyArrayMethods, PyReadonlyArray};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::error;

/// The numbers of the argument `name`. An array of 64-bit floats is read where it lies; numpy converts what else holds numbers: other types of arrays,
/// lists, columns of pandas.
pub fn numbers<'py, D: Dimension>(
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArray<'py, f64, D>> {
    let borrowed = |array: &Bound<'py, PyArray<f64, D>>| {
        let array = array.try_readonly();
        array.map_err(|error| error::of_data(format!("{name}: {error}")))
    };
    if let Ok(array) = value.cast::<PyArray<f64, D>>() {
        return borrowed(array);
    }
    let axes = D::NDIM.unwrap_or(1);
    let s = if axes == 1 { "axis" } else { "axes" };
    let numpy = value.py().import("numpy")?;
    let found = numpy.call_method1("asarray", (value,)).map_err(|why| {
        error::of_data(format!(
            "{name} has rows of different lengths, or is not an array ({why}): give an array of numbers with {axes} {s}"
        ))
    })?;
    let dtype = found.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "f" | "i" | "u" | "b") {
        return Err(error::of_data(format!(
            "{name} holds {dtype}: give numbers, np.asarray({name}, dtype=float)"
        )));
    }
    let found = found.call_method1("astype", ("float64",))?;
    let Ok(array) = found.cast::<PyArray<f64, D>>() else {
        let shape = found.getattr("shape")?;
        return Err(error::of_data(format!(
            "{name} has the shape {shape}: give an array of numbers with {axes} {s}"
        )));
    };
    borrowed(array)
}

/// The numbers of an argument with one axis. For the few of a list numpy would take ten times as long.
pub fn list(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let of_list = value.cast::<PyList>().ok();
    if let Some(found) = of_list.and_then(|list| list.extract().ok()) {
        return Ok(found);
    }
    let found = numbers::<numpy::Ix1>(name, value)?;
    Ok(found.as_array().to_vec())
}
