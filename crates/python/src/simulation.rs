//! Simulations as dictionaries of arrays.

use ctid::own_model::{Simulated, StateSource};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

use crate::error;

/// Checks the options of a simulation: the probability of its band, and the number of first readings that the initial states are fitted to.
pub fn check_simulation(level: f64, first: usize) -> PyResult<()> {
    if level > 0.0 && level < 1.0 && first > 0 {
        return Ok(());
    }
    Err(error::of_model(format!(
        "the interval is a probability within 0 and 1, and first a whole number above zero; they are {level} and {first}"
    )))
}

/// A simulation as a Python object.
pub fn simulation<'py>(py: Python<'py>, found: &Simulated) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let outputs = PyDict::new(py);
    for output in &found.outputs {
        let own = PyDict::new(py);
        own.set_item("mean", PyArray1::from_slice(py, &output.mean))?;
        if let Some(band) = &output.band {
            for (name, half) in [("", &band.output), ("reading ", &band.reading)] {
                for (side, sign) in [("lower", -1.0), ("upper", 1.0)] {
                    let edge = output.mean.iter().zip(half);
                    let edge: Vec<f64> = edge.map(|(mean, half)| mean + sign * half).collect();
                    own.set_item(format!("{name}{side}"), PyArray1::from_vec(py, edge))?;
                }
            }
        }
        outputs.set_item(&output.name, own)?;
    }
    all.set_item("outputs", outputs)?;
    all.set_item("warnings", &found.warnings)?;
    let from = match found.states_from {
        StateSource::Readings => "readings",
        StateSource::Text => "text",
        StateSource::Rest => "rest",
    };
    all.set_item("states_from", from)?;
    let states: BTreeMap<&String, f64> = found.states.iter().map(|(n, v)| (n, *v)).collect();
    all.set_item("states", states)?;
    Ok(all)
}
