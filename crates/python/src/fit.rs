//! A fit.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

use ct_signals::ReadOptions;
use ctid::own_model::{Comparison, Document, FitLimit, FittedModel, compared_page, diagnose};
use effect_search::Options;
use greybox::FitOptions;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};

use crate::diagnosis::Diagnosis;
use crate::frame::{Content, Frame, contents};
use crate::json::json;
use crate::message_names::PYTHON;
use crate::model::Model;
use crate::own::{Inner, Kept, records};
use crate::series::{Covariance, NamedBin, bins, units_of};
use crate::simulation::{check_simulation, simulation};
use crate::time_limit::limit;
use crate::{bytes, error, work};

/// A model that was fitted to frames; it never changes.
#[pyclass(frozen, module = "ctid._ctid")]
pub struct Fit {
    model: Arc<Inner>,
    frames: Arc<Vec<Content>>,
    fitted: FittedModel,
    comparison: Comparison,
    /// Data for the program's page, computed on demand.
    page: OnceLock<Document>,
}

/// The fit in its pickled form: its problem and the result.
#[derive(Serialize, Deserialize)]
struct KeptFit {
    model: Kept,
    frames: Vec<Content>,
    options: FitOptions,
    fit: greybox::Fit,
}

/// Measured and simulated series of an output: name, measured, simulated.
type Series<'py> = (String, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

impl Fit {
    fn of(
        model: Arc<Inner>,
        frames: Vec<Content>,
        options: &FitOptions,
        stop: &AtomicBool,
    ) -> Result<Self, ctid::Error> {
        let records = model.records(&frames, frames.len())?;
        let limit = FitLimit {
            time: None,
            interrupt: Some(stop),
        };
        let fitted = FittedModel::fit(&model.file, records, (options, true), limit)?;
        Self::of_fitted(model, frames, fitted)
    }

    fn of_fitted(
        model: Arc<Inner>,
        frames: Vec<Content>,
        fitted: FittedModel,
    ) -> Result<Self, ctid::Error> {
        Ok(Self {
            model,
            frames: Arc::new(frames),
            comparison: fitted.compare()?,
            fitted,
            page: OnceLock::new(),
        })
    }

    fn page(&self) -> &Document {
        let of = || compared_page(self.fitted.given(), self.fitted.records(), &self.comparison);
        self.page.get_or_init(of)
    }

    fn step(&self) -> &effect_search::Step {
        let [step] = &self.comparison.steps;
        step
    }
}

#[pymethods]
impl Fit {
    /// Fits a model to frames.
    #[staticmethod]
    #[pyo3(signature = (model, frames, *, starts, seed, noise_order, progress=None))]
    fn of_model(
        py: Python<'_>,
        model: &Model,
        frames: Vec<Bound<'_, Frame>>,
        starts: usize,
        seed: u64,
        noise_order: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let options = FitOptions {
            starts,
            seed,
            noise_order,
            ..FitOptions::default()
        };
        let frames = contents(&frames);
        if frames.is_empty() {
            return Err(error::of_data("no record: give a frame, or a list of them"));
        }
        let model = model.0.clone();
        work::run(py, progress.as_ref(), move |stop, phases| {
            phases.tell("fitting the model");
            Self::of(model, frames, &options, stop)
        })
    }

    /// Name, value, standard error, unit and whether it is known, of each parameter and initial state.
    #[getter]
    fn estimates(&self) -> Vec<(String, f64, Option<f64>, String, bool)> {
        let all = self.step().parameters.iter();
        all.map(|p| {
            (
                p.name.clone(),
                p.value,
                p.std_error,
                p.unit.clone(),
                p.known,
            )
        })
        .collect()
    }

    /// Half the width of the interval that contains each of them with probability `level`.
    fn half_widths(&self, level: f64) -> PyResult<Vec<Option<f64>>> {
        if !(level > 0.0 && level < 1.0) {
            return Err(error::of_model(format!(
                "a probability is within 0 and 1, and {level} is not"
            )));
        }
        let robust = self.fitted.robust().map_err(|error| error::of(&error))?;
        let none = || vec![None; self.step().parameters.len()];
        Ok(robust.map_or_else(none, |robust| robust.half_widths(level)))
    }

    /// Names and covariance of what is fitted and not at a bound; `None` where the records do not determine all of it.
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Covariance<'py>> {
        let setup = self.fitted.setup().map_err(|error| error::of(&error))?;
        let robust = self.fitted.robust().map_err(|error| error::of(&error))?;
        let fit = self.fitted.estimate();
        let covariance = robust.and_then(|robust| robust.covariance);
        let Some(matrix) = covariance.filter(|_| fit.is_determined()) else {
            return Ok(None);
        };
        let free = setup.free();
        let names = fit.interior().iter();
        let names = names.map(|&i| setup.names()[free[i]].clone());
        let matrix = PyArray2::from_vec2(py, &matrix);
        let matrix = matrix.map_err(|error| error::of_data(error.to_string()))?;
        Ok(Some((names.collect(), matrix)))
    }

    /// For each record: its name, its times \[s\] and its outputs.
    #[getter]
    fn series<'py>(
        &self,
        py: Python<'py>,
    ) -> Vec<(String, Bound<'py, PyArray1<f64>>, Vec<Series<'py>>)> {
        let count = self.step().rmse_per_output.len().max(1);
        let curves = self.comparison.curves.chunks(count);
        let all = curves.map(|curves| {
            let outputs = curves.iter().map(|curve| {
                let measured = PyArray1::from_slice(py, &curve.measured);
                let model = PyArray1::from_slice(py, &curve.model);
                (curve.output.clone(), measured, model)
            });
            let time = PyArray1::from_slice(py, &curves[0].time);
            (curves[0].record.clone(), time, outputs.collect())
        });
        all.collect()
    }

    /// The unit of each output; empty if no record has it.
    #[getter]
    fn output_units(&self) -> Vec<String> {
        units_of(&self.fitted.records().records)
    }

    /// Output, error and fit % on the fitted records.
    #[getter]
    fn scores(&self) -> Vec<(String, f64, f64)> {
        let all = self.fitted.score_of_fit().into_iter();
        all.map(|s| (s.output, s.rmse, s.fit_percent)).collect()
    }

    /// Scores on other records.
    fn score(
        &self,
        py: Python<'_>,
        frames: Vec<Bound<'_, Frame>>,
    ) -> PyResult<Vec<(String, f64, f64)>> {
        let frames = contents(&frames);
        let found = work::run(py, None, |_, _| {
            let file = self.fitted.given();
            let records = records(file, &frames, frames.len())?;
            self.fitted.score(&records.records)
        })?;
        let all = found.into_iter();
        Ok(all.map(|s| (s.output, s.rmse, s.fit_percent)).collect())
    }

    /// The model on the inputs of a frame.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, Frame>,
        first: usize,
        level: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        check_simulation(level, first)?;
        let frame = &frame.get().0;
        let found = work::run(py, None, |_, _| {
            let file = self.fitted.model();
            let options = ReadOptions::from(file.hold);
            let reading = frame.inputs(&file.columns, &options)?;
            self.fitted.simulate(reading, first, level)
        })?;
        simulation(py, &found)
    }

    /// For each output: its name, the p-values of the tests of its residual (whiteness, dependence on the inputs), the bins where the model
    /// fails, and these failures in sentences. A bin has a kind and a [`crate::series::Bin`].
    #[getter]
    #[allow(clippy::type_complexity)]
    fn outputs(&self) -> Vec<(String, (f64, f64), Vec<NamedBin>, Vec<String>)> {
        let diagnosis = &self.page().diagnosis;
        let outputs = diagnosis
            .steps
            .first()
            .map_or(&[][..], |step| &step.outputs);
        let all = outputs.iter().enumerate().map(|(at, output)| {
            let tests = (output.tests.whiteness_p, output.tests.input_p);
            let bins = bins(&output.failures);
            let sentences = ctid::sentences::of_failures(diagnosis, output, at);
            (output.name.clone(), tests, bins, sentences)
        });
        all.collect()
    }

    #[getter]
    fn starts(&self) -> (usize, usize) {
        (self.step().starts, self.step().starts_agree)
    }

    #[getter]
    fn bic(&self) -> f64 {
        self.step().bic
    }

    /// Entries that the records do not determine, alone or together.
    #[getter]
    fn not_determined(&self) -> Vec<Vec<String>> {
        self.step().not_determined.clone()
    }

    /// Whether feedback was detected in the records, in a sentence; `None` if it was not.
    #[getter]
    fn control_loop(&self) -> Option<String> {
        let known = self.comparison.control_loop.as_ref()?;
        Some(self.model.file.loop_sentence(known, &PYTHON))
    }

    /// The result as `ctid compare --json` writes it, without its mark.
    fn json(&self) -> PyResult<String> {
        json(&self.comparison)
    }

    /// The page of `ctid compare --report`.
    fn html(&self, py: Python<'_>) -> String {
        py.detach(|| self.page().html())
    }

    /// The model with its fitted values, as `ctid export --modelica` writes it.
    fn to_modelica(&self) -> PyResult<String> {
        let text = self.fitted.text(&self.model.file.name);
        text.map_err(|error| error::of(&error))
    }

    /// The model with its fitted values.
    #[getter]
    fn model(&self) -> Model {
        let estimates = self.step().parameters.iter();
        Model(Arc::new(Inner {
            text: self.model.text.clone(),
            file: self.model.file.clone(),
            values: estimates.map(|p| (p.name.clone(), p.value)).collect(),
        }))
    }

    /// Diagnoses the model.
    #[pyo3(signature = (test, *, effort, time_limit, max_effects, seed, progress=None))]
    #[allow(clippy::too_many_arguments, reason = "Python passes them by name")]
    fn diagnose(
        &self,
        py: Python<'_>,
        test: Vec<Bound<'_, Frame>>,
        effort: &str,
        time_limit: Option<f64>,
        max_effects: Option<usize>,
        seed: u64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Diagnosis> {
        let limit = limit(effort, time_limit)?;
        let mut frames = self.frames.to_vec();
        let fitted = frames.len();
        frames.extend(contents(&test));
        let file = self.fitted.given();
        let (found, records) = work::run(py, progress.as_ref(), |stop, phases| {
            let records = records(file, &frames, fitted)?;
            let mut options = Options {
                seed,
                time_limit: Some(limit),
                interrupt: Some(stop),
                ..Options::default()
            };
            options.max_effects = max_effects.unwrap_or(options.max_effects);
            let found = diagnose(file, &records, &options, &|progress| {
                phases.tell(progress.phase);
            })?;
            Ok((found, records))
        })?;
        Ok(Diagnosis::new(
            self.model.clone(),
            (frames, fitted),
            records,
            found,
        ))
    }

    /// As bytes, for pickle.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = bytes::of(&KeptFit {
            model: self.model.kept(),
            frames: self.frames.to_vec(),
            options: *self.fitted.options(),
            fit: self.fitted.estimate().clone(),
        })?;
        Ok(PyBytes::new(py, &bytes))
    }

    #[staticmethod]
    fn from_bytes(py: Python<'_>, content: &[u8]) -> PyResult<Self> {
        let KeptFit {
            model,
            frames,
            options,
            fit,
        } = bytes::read(content)?;
        let model = Arc::new(Inner::of_kept(model)?);
        work::run(py, None, move |_, _| {
            let records = model.records(&frames, frames.len())?;
            let fitted = FittedModel::of_fit(&model.file, records, &options, fit)?;
            Self::of_fitted(model, frames, fitted)
        })
    }
}
