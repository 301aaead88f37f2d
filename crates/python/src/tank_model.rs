//! One of the plants: tanks, and what is linear like them.

use std::collections::BTreeMap;

use ctid::model_file::ModelFile;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::frame::{Frame, contents};
use crate::monitor::Monitor;
use crate::tank::TankFit;
use crate::tank_file::{heading, parsed};
use crate::{error, tank_text};

/// A plant, from the text of a model file; it never changes.
#[pyclass(frozen, module = "ctid._ctid")]
pub struct Tank {
    text: String,
    file: ModelFile,
}

#[pymethods]
impl Tank {
    #[new]
    fn new(text: String) -> PyResult<Self> {
        let file = parsed(&text).map_err(|error| error::of(&error))?;
        Ok(Self { text, file })
    }

    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    #[getter]
    fn name(&self) -> &'static str {
        self.file.plant.id()
    }

    #[getter]
    fn effects(&self) -> Vec<&'static str> {
        self.file.effects.iter().map(|e| e.effect.id).collect()
    }

    /// The columns of the inputs and of the outputs, where they are named.
    #[getter]
    fn columns(&self) -> (Vec<String>, Vec<String>) {
        let columns = &self.file.columns;
        (columns.inputs.clone(), columns.outputs.clone())
    }

    /// How many inputs and outputs it has.
    #[getter]
    fn signals(&self) -> (usize, usize) {
        let inputs = match self.file.plant.joined() || self.file.known.disturbance.is_some() {
            true => 2,
            false => 1,
        };
        (inputs, self.file.known.outputs(self.file.plant).len())
    }

    /// The units of the input and of the outputs as the columns say them; empty where they do not.
    #[getter]
    fn units(&self) -> (String, String) {
        let columns = &self.file.columns;
        let unit = |names: &[String]| {
            names
                .first()
                .map_or_else(String::new, |name| heading(name).1)
        };
        (unit(&columns.inputs), unit(&columns.outputs))
    }

    /// The matrices of the plant with these values of its parameters, about values of its levels and inputs.
    fn linearize<'py>(
        &self,
        py: Python<'py>,
        values: BTreeMap<String, f64>,
        at: BTreeMap<String, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        crate::linear::linearize(py, tank_text::spec(&self.file, &values)?, &at)
    }

    /// The plant as the text of a model, with these values of its parameters and initial levels.
    #[allow(
        clippy::needless_pass_by_value,
        reason = "made from a Python dictionary"
    )]
    fn to_modelica(&self, values: BTreeMap<String, f64>) -> PyResult<String> {
        Ok(tank_text::spec(&self.file, &values)?.to_string())
    }

    /// A monitor that runs the model in parallel with the plant.
    fn monitor(
        &self,
        units: (String, String),
        rows_between_false_alarms: f64,
        learning_rows: usize,
    ) -> PyResult<Monitor> {
        Monitor::of_tank(&self.text, units, rows_between_false_alarms, learning_rows)
    }

    #[pyo3(signature = (frames, progress=None))]
    fn fit(
        &self,
        py: Python<'_>,
        frames: Vec<Bound<'_, Frame>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<TankFit> {
        TankFit::of(py, self.text.clone(), contents(&frames), progress.as_ref())
    }
}
