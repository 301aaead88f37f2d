//! A diagnosis.

use std::collections::BTreeMap;
use std::sync::Arc;

use ct_signals::parts;
use ctid::own_model::{Records, design, diagnosed_page};
use effect_search::Options;
use effect_search::design::Limits;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::{Deserialize, Serialize};

use crate::frame::Content;
use crate::json::json;
use crate::model::Model;
use crate::own::{Inner, Kept};
use crate::series::{RecordSeries, simulated_series, units_of};
use crate::time_limit::limit;
use crate::{bytes, error, work};

/// Diagnosis of a model; immutable.
#[pyclass(frozen, module = "ctid._ctid")]
pub struct Diagnosis {
    model: Arc<Inner>,
    frames: Vec<Content>,
    fitted: usize,
    records: Records,
    found: effect_search::Diagnosis,
}

/// The diagnosis in its pickled form.
#[derive(Serialize, Deserialize)]
struct KeptDiagnosis {
    model: Kept,
    frames: Vec<Content>,
    fitted: usize,
    found: effect_search::Diagnosis,
    simulated: Vec<Vec<Vec<f64>>>,
}

impl Diagnosis {
    pub fn new(
        model: Arc<Inner>,
        (frames, fitted): (Vec<Content>, usize),
        records: Records,
        found: effect_search::Diagnosis,
    ) -> Self {
        Self {
            model,
            frames,
            fitted,
            records,
            found,
        }
    }
}

#[pymethods]
impl Diagnosis {
    /// The result in the form of `ctid diagnose --json`, without its mark.
    fn json(&self) -> PyResult<String> {
        json(&self.found)
    }

    /// The finding in sentences.
    #[getter]
    fn sentences(&self) -> Vec<String> {
        diagnosed_page(&self.model.file, &self.records, &self.found).sentences
    }

    /// The page of `ctid diagnose --report`.
    fn html(&self, py: Python<'_>) -> String {
        py.detach(|| diagnosed_page(&self.model.file, &self.records, &self.found).html())
    }

    /// The model with the found effects, and its values in the last step.
    #[getter]
    fn model(&self) -> PyResult<Model> {
        let mut file = self.model.file.clone();
        for effect in &self.found.effects {
            let with = file.with_effect(effect, &self.found);
            file = with.map_err(|error| error::of(&error))?;
        }
        let last = self.found.steps.last();
        let estimates = last.into_iter().flat_map(|step| &step.parameters);
        Ok(Model(Arc::new(Inner {
            text: self.model.text.clone(),
            file,
            values: estimates.map(|p| (p.name.clone(), p.value)).collect(),
        })))
    }

    /// The experiment that distinguishes two effects best; the output of `ctid design --json` without its mark, and the unit of the model's
    /// time \[s\].
    #[pyo3(signature = (between, *, ranges, slews, inputs, duration, seed, effort, time_limit, progress=None))]
    #[allow(clippy::too_many_arguments, reason = "Python passes them by name")]
    fn design(
        &self,
        py: Python<'_>,
        between: (String, String),
        ranges: BTreeMap<String, (f64, f64)>,
        slews: BTreeMap<String, f64>,
        inputs: Vec<String>,
        duration: Option<f64>,
        seed: u64,
        effort: &str,
        time_limit: Option<f64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(String, f64)> {
        let limit = limit(effort, time_limit)?;
        let limits = Limits {
            inputs,
            ranges,
            slews,
            duration,
            seed,
        };
        let found = work::run(py, progress.as_ref(), |stop, phases| {
            let options = Options {
                seed,
                time_limit: Some(limit),
                interrupt: Some(stop),
                ..Options::default()
            };
            let between = [between.0.as_str(), between.1.as_str()];
            let tell = |progress: effect_search::Progress| phases.tell(progress.phase);
            design(
                &self.model.file,
                &self.records,
                between,
                &limits,
                &options,
                &tell,
            )
        })?;
        Ok((json(&found)?, self.records.time_unit))
    }

    /// The unit of each output; empty if no record has it.
    #[getter]
    fn output_units(&self) -> Vec<String> {
        units_of(&self.records.records)
    }

    /// For each record, fitted ones first: its name, whether it is held out, its times \[s\], and for each output its name, the measured
    /// values and the values of each step.
    #[getter]
    fn series<'py>(&self, py: Python<'py>) -> Vec<RecordSeries<'py>> {
        let Records { records, test, .. } = &self.records;
        let all_parts = [records.as_slice(), test].concat();
        let count = self.model.file.columns.outputs.len();
        let steps = self.found.steps.iter();
        let simulated = steps.map(|step| parts::joined_series(&all_parts, count, &step.simulated));
        let simulated: Vec<Vec<Vec<f64>>> = simulated.collect();
        let steps: Vec<&[Vec<f64>]> = simulated.iter().map(Vec::as_slice).collect();
        let (fitted, held_out) = (parts::joined(records), parts::joined(test));
        let all = fitted.iter().map(|record| (record, false));
        let all = all.chain(held_out.iter().map(|record| (record, true)));
        let all = all.enumerate().map(|(i, (record, held_out))| {
            let outputs = record.outputs.iter();
            let outputs = outputs.map(|y| (y.name.clone(), &y.values[..]));
            let outputs = simulated_series(py, i, outputs, &steps);
            let time = PyArray1::from_slice(py, &record.time);
            (record.name.clone(), held_out, time, outputs)
        });
        all.collect()
    }

    /// As bytes, for pickle.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let steps = self.found.steps.iter();
        let bytes = bytes::of(&KeptDiagnosis {
            model: self.model.kept(),
            frames: self.frames.clone(),
            fitted: self.fitted,
            found: self.found.clone(),
            simulated: steps.map(|step| step.simulated.clone()).collect(),
        })?;
        Ok(PyBytes::new(py, &bytes))
    }

    #[staticmethod]
    fn from_bytes(content: &[u8]) -> PyResult<Self> {
        let KeptDiagnosis {
            model,
            frames,
            fitted,
            mut found,
            simulated,
        } = bytes::read(content)?;
        let model = Arc::new(Inner::of_kept(model)?);
        let records = model.records(&frames, fitted);
        let records = records.map_err(|error| error::of(&error))?;
        for (step, simulated) in found.steps.iter_mut().zip(simulated) {
            step.simulated = simulated;
        }
        Ok(Self::new(model, (frames, fitted), records, found))
    }
}
