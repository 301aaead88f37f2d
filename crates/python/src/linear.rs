//! The matrices of a model about a point.

use std::collections::BTreeMap;

use ct_model::{LinearForm, Model as Compiled, ModelSpec, Variable};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error;

/// A matrix, also where it has no row or no column.
fn matrix<'py>(
    py: Python<'py>,
    rows: &[Vec<f64>],
    columns: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat: Vec<f64> = rows.iter().flatten().copied().collect();
    let flat = PyArray1::from_vec(py, flat);
    numpy::PyArrayMethods::reshape(&flat, [rows.len(), columns])
}

/// Linearises a model at an operating point: values of inputs and states by name. A linear model needs none.
pub fn linearize<'py>(
    py: Python<'py>,
    spec: ModelSpec,
    at: &BTreeMap<String, f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let model = Compiled::new(spec);
    let spec = model.spec();
    let states: Vec<String> = spec.states.iter().map(|s| s.about.name.clone()).collect();
    let inputs: Vec<String> = spec.about_inputs().map(|u| u.name.clone()).collect();
    let outputs: Vec<String> = spec.about_outputs().map(|y| y.name.clone()).collect();
    // An output that reads a state is another name of it.
    let own = |name: &String| match spec.find(name) {
        Some(Variable::State(i)) => Some(states[i].clone()),
        Some(Variable::Input(i)) => Some(inputs[i].clone()),
        _ => None,
    };
    let mut values = BTreeMap::new();
    let mut time = 0.0;
    for (name, value) in at {
        if name == "time" {
            time = *value;
            continue;
        }
        let Some(name) = own(name) else {
            return Err(error::of_model(format!(
                "{name} is neither a state nor an input of {}: it has {}",
                spec.name,
                [states.clone(), inputs.clone()].concat().join(", ")
            )));
        };
        if !value.is_finite() {
            return Err(error::of_model(format!("{name} has to be a finite number")));
        }
        values.insert(name, *value);
    }
    let parameters = model.parameters();
    let linear = model.linear(&parameters);
    let lacking: Vec<&str> = states
        .iter()
        .chain(&inputs)
        .filter(|name| !values.contains_key(*name))
        .map(String::as_str)
        .collect();
    if linear.is_none() && !lacking.is_empty() {
        return Err(error::of_model(format!(
            "{} is not linear: say where, at={{...}}; there is no value of {}",
            spec.name,
            lacking.join(", ")
        )));
    }
    let of = |names: &[String]| -> Vec<f64> {
        names
            .iter()
            .map(|name| values.get(name).copied().unwrap_or(0.0))
            .collect()
    };
    let (x, u) = (of(&states), of(&inputs));
    let form = model.linear_about(&parameters, &x, &u, time).or(linear);
    let Some(LinearForm {
        a,
        b,
        c,
        d,
        state_offset,
        output_offset,
    }) = form
    else {
        return Err(error::of_model(format!(
            "{} has no matrices there: it delays a signal, or a slope is not finite; choose another point",
            spec.name
        )));
    };
    let all = PyDict::new(py);
    all.set_item("A", matrix(py, &a, states.len())?)?;
    all.set_item("B", matrix(py, &b, inputs.len())?)?;
    all.set_item("C", matrix(py, &c, states.len())?)?;
    all.set_item("D", matrix(py, &d, inputs.len())?)?;
    all.set_item("dx", PyArray1::from_vec(py, state_offset))?;
    all.set_item("y", PyArray1::from_vec(py, output_offset))?;
    all.set_item("x", PyArray1::from_vec(py, x))?;
    all.set_item("u", PyArray1::from_vec(py, u))?;
    all.set_item("states", states)?;
    all.set_item("inputs", inputs)?;
    all.set_item("outputs", outputs)?;
    Ok(all)
}
