//! A user's own model.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use ctid::own_model::{AnyModelFile, OwnModelFile, OwnSettings};
use greybox::PriorValue;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::frame::hold_of;
use crate::monitor::Monitor;
use crate::own::{Inner, parsed};
use crate::{bytes, error};

/// A model; it never changes.
#[pyclass(frozen, module = "ctid._ctid")]
pub struct Model(pub Arc<Inner>);

#[pymethods]
impl Model {
    /// Reads a model text; `name` is its name in messages.
    #[staticmethod]
    fn from_text(text: String, name: &str) -> PyResult<Self> {
        let spec = parsed(name, &text)?;
        let file = OwnModelFile::new(name, spec, OwnSettings::default());
        let file = file.map_err(|error| error::of(&error))?;
        Ok(Self(Arc::new(Inner {
            text,
            file,
            values: BTreeMap::new(),
        })))
    }

    /// Reads a model file of `ctid`, which names the text.
    #[staticmethod]
    fn from_model_file(path: &str) -> PyResult<Self> {
        // Whatever is wrong, a text that is not there say, is wrong with the model.
        let file = AnyModelFile::read(Path::new(path)).map_err(error::of_model)?;
        let AnyModelFile::Own(file) = file else {
            return Err(error::of_model(format!(
                "{path}: it names a plant: use Model.tank"
            )));
        };
        let text = file.base.to_string();
        Ok(Self(Arc::new(Inner {
            text,
            file: *file,
            values: BTreeMap::new(),
        })))
    }

    /// The model with these columns, known parameters, side measurements and hold (`zero`, `first`); other settings do not change.
    #[pyo3(signature = (*, inputs=None, outputs=None, known=None, priors=None, hold=None))]
    fn with_settings(
        &self,
        inputs: Option<Vec<String>>,
        outputs: Option<Vec<String>>,
        known: Option<BTreeMap<String, f64>>,
        priors: Option<BTreeMap<String, (f64, f64)>>,
        hold: Option<&str>,
    ) -> PyResult<Self> {
        let mut settings = self.0.file.settings();
        if let Some(inputs) = inputs {
            settings.columns.inputs = inputs;
        }
        if let Some(outputs) = outputs {
            settings.columns.outputs = outputs;
        }
        settings.known.extend(known.unwrap_or_default());
        for (name, (value, std_error)) in priors.unwrap_or_default() {
            settings
                .priors
                .insert(name, PriorValue { value, std_error });
        }
        if let Some(hold) = hold {
            settings.hold = hold_of(hold)?;
        }
        let mut kept = self.0.kept();
        kept.settings = settings;
        Ok(Self(Arc::new(Inner::of_kept(kept)?)))
    }

    /// The model with its effects as text, with the fitted values after a fit.
    fn to_modelica(&self) -> PyResult<String> {
        let spec = self.0.valued().map_err(|error| error::of(&error))?;
        Ok(spec.to_string())
    }

    /// The matrices of the model about values of its states and inputs.
    fn linearize<'py>(
        &self,
        py: Python<'py>,
        at: BTreeMap<String, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let spec = self.0.valued().map_err(|error| error::of(&error))?;
        crate::linear::linearize(py, spec, &at)
    }

    /// A monitor of a plant with this model.
    fn monitor(
        &self,
        time_unit: f64,
        rows_between_false_alarms: f64,
        learning_rows: usize,
    ) -> PyResult<Monitor> {
        let time_unit = self.0.file.time_unit.unwrap_or(time_unit);
        Monitor::of_model(&self.0, time_unit, rows_between_false_alarms, learning_rows)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.file.base.name
    }

    #[getter]
    fn file(&self) -> &str {
        &self.0.file.name
    }

    #[getter]
    fn text(&self) -> &str {
        &self.0.text
    }

    #[getter]
    fn effects(&self) -> Vec<String> {
        self.0.file.effects.on.clone()
    }

    /// Names of the inputs, and the columns that they are read from.
    #[getter]
    fn inputs(&self) -> Vec<(String, String)> {
        let spec = &self.0.file.base;
        let names = spec.inputs.iter().map(|input| input.about.name.clone());
        names.zip(self.0.file.columns.inputs.clone()).collect()
    }

    /// Columns of the references of its controllers.
    #[getter]
    fn references(&self) -> Vec<String> {
        self.0.file.references().cloned().collect()
    }

    /// Names and units of the outputs.
    #[getter]
    fn outputs(&self) -> Vec<(String, String)> {
        let names = self.0.file.base.about_outputs().map(|y| y.name.clone());
        names.zip(self.0.file.columns.outputs.clone()).collect()
    }

    /// Names, values and units of the parameters, of its effects too.
    #[getter]
    fn parameters(&self) -> PyResult<Vec<(String, f64, String)>> {
        let spec = self.0.valued().map_err(|error| error::of(&error))?;
        let all = spec.parameters.into_iter();
        Ok(all.map(|p| (p.about.name, p.value, p.about.unit)).collect())
    }

    /// Names of the states.
    #[getter]
    fn states(&self) -> PyResult<Vec<String>> {
        let spec = self.0.valued().map_err(|error| error::of(&error))?;
        Ok(spec.states.into_iter().map(|s| s.about.name).collect())
    }

    /// As bytes, for pickle.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &bytes::of(&self.0.kept())?))
    }

    #[staticmethod]
    fn from_bytes(content: &[u8]) -> PyResult<Self> {
        Ok(Self(Arc::new(Inner::of_kept(bytes::read(content)?)?)))
    }
}
