//! One of the plants, fitted to records, and diagnosed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

use ct_model::ModelSpec;
use ct_signals::{ReadOptions, Reading};
use ctid::effort::EffortLevel;
use ctid::input;
use ctid::model_file::ModelFile;
use ctid::output::Written;
use ctid::simulate::{TimeColumn, of_plant, text_of_plant};
use missing_effect::{Diagnosis as Found, Options, Problem, compare, diagnose};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};

use crate::frame::{Content, Frame, contents};
use crate::json::json;
use crate::message_names::PYTHON;
use crate::series::{Covariance, NamedBin, RecordSeries, bins, simulated_series, units_of};
use crate::simulation::{check_simulation, simulation};
use crate::tank_file::{NAME, parsed};
use crate::tank_text::WITHOUT_TEXT;
use crate::time_limit::limit;
use crate::{bytes, error, work};

/// A plant that was fitted to frames, or diagnosed; it never changes.
#[pyclass(frozen, module = "ctid._ctid")]
pub struct TankFit {
    text: String,
    frames: Arc<Vec<Content>>,
    /// So many of them are fitted.
    fitted: usize,
    problem: Problem,
    found: Found,
    known: Known,
    /// Its text with fitted effects, once it was asked for.
    modelica: OnceLock<String>,
}

/// How well the parameters are known: names, covariance, degrees of freedom.
type Known = Option<(Vec<String>, Vec<Vec<f64>>, f64)>;

/// The records of a plant as the program checks them.
pub fn problem(file: ModelFile, frames: &[Content], fitted: usize) -> Result<Problem, ctid::Error> {
    let options = ReadOptions::from(file.hold);
    let read = |frame: &Content| frame.record(&file.columns, &options);
    let all = frames
        .iter()
        .map(read)
        .collect::<Result<Vec<Reading>, _>>()?;
    let mut records: Vec<_> = all.into_iter().map(|reading| reading.record).collect();
    input::on_one_clock(&mut records);
    let test = records.split_off(fitted);
    input::problem(NAME, file, records, test)
}

/// Ctrl-C ends a search; of a fit the result is dropped.
pub fn options(limit: std::time::Duration, stop: &AtomicBool) -> Options<'_> {
    Options {
        time_limit: Some(limit),
        interrupt: Some(stop),
        ..Options::default()
    }
}

impl TankFit {
    /// The plant of a text fitted to frames.
    pub fn of(
        py: Python<'_>,
        text: String,
        frames: Vec<Content>,
        progress: Option<&Py<PyAny>>,
    ) -> PyResult<Self> {
        if frames.is_empty() {
            return Err(error::of_data("no record: give a frame, or a list of them"));
        }
        work::run(py, progress, |stop, phases| {
            phases.tell("fitting the model");
            let fitted = frames.len();
            let problem = problem(parsed(&text)?, &frames, fitted)?;
            let options = options(EffortLevel::Normal.limit(), stop);
            let found = compare(&problem, &options)?;
            let known = missing_effect::fitted(&problem, &options, |fitted| {
                let known = fitted.uncertainty?;
                let names = known
                    .entries
                    .iter()
                    .map(|&i| fitted.setup.names()[i].clone());
                let covariance = known.covariance.clone();
                Some((names.collect(), covariance, known.freedom))
            })?;
            Ok(Self {
                text,
                frames: Arc::new(frames),
                fitted,
                problem,
                found,
                known,
                modelica: OnceLock::new(),
            })
        })
    }
}

#[pymethods]
impl TankFit {
    /// Name, value, standard error, unit and whether it is known, of each parameter and initial state of the last step.
    #[getter]
    fn estimates(&self) -> Vec<(String, f64, Option<f64>, String, bool)> {
        let last = self.found.steps.last();
        let all = last.into_iter().flat_map(|step| &step.parameters);
        all.map(|p| (p.name.clone(), p.value, p.std_error, p.unit.clone(), false))
            .collect()
    }

    /// Half the width of the interval that holds each of them with probability `level`; none of the initial states.
    fn half_widths(&self, level: f64) -> PyResult<Vec<Option<f64>>> {
        if !(level > 0.0 && level < 1.0) {
            return Err(error::of_model(format!(
                "a probability is within 0 and 1, and {level} is not"
            )));
        }
        let quantile = self
            .known
            .as_ref()
            .map(|(_, _, freedom)| ct_signals::student_half_width(level, *freedom));
        let all = self.estimates().into_iter();
        Ok(all.map(|e| Some(e.2? * quantile?)).collect())
    }

    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Covariance<'py>> {
        let Some((names, matrix, _)) = &self.known else {
            return Ok(None);
        };
        let matrix = PyArray2::from_vec2(py, matrix).map_err(error::of_data)?;
        Ok(Some((names.clone(), matrix)))
    }

    /// The unit of each output; empty where no record says it.
    #[getter]
    fn output_units(&self) -> Vec<String> {
        units_of(&self.problem.records)
    }

    /// As of a diagnosis of a model of the user's own.
    #[getter]
    fn series<'py>(&self, py: Python<'py>) -> Vec<RecordSeries<'py>> {
        let steps = self.found.steps.iter();
        let steps: Vec<&[Vec<f64>]> = steps.map(|step| step.simulated.as_slice()).collect();
        let all = self.found.records.iter().enumerate();
        let all = all.map(|(i, record)| {
            let names = self.found.outputs.iter().cloned();
            let outputs = names.zip(record.outputs.iter().map(Vec::as_slice));
            let outputs = simulated_series(py, i, outputs, &steps);
            let time = PyArray1::from_slice(py, &record.time);
            (record.name.clone(), record.held_out, time, outputs)
        });
        all.collect()
    }

    #[getter]
    #[allow(clippy::type_complexity)]
    fn outputs(&self) -> Vec<(String, (f64, f64), Vec<NamedBin>, Vec<String>)> {
        let last = self.found.steps.last();
        let all = last.into_iter().flat_map(|step| &step.outputs);
        all.enumerate()
            .map(|(at, output)| {
                let tests = (output.tests.whiteness_p, output.tests.input_p);
                let sentences = ctid::sentences::of_failures(&self.found, output, at);
                (
                    output.name.clone(),
                    tests,
                    bins(&output.failures),
                    sentences,
                )
            })
            .collect()
    }

    /// The units of the input and of the outputs; empty where no record says them.
    #[getter]
    fn units(&self) -> (String, String) {
        let record = self.problem.records.first();
        let unit = |channels: &[ct_signals::Channel]| {
            channels
                .first()
                .map_or_else(String::new, |c| c.unit.clone())
        };
        record.map_or_else(Default::default, |r| (unit(&r.inputs), unit(&r.outputs)))
    }

    #[getter]
    fn starts(&self) -> (usize, usize) {
        let last = self.found.steps.last();
        last.map_or((0, 0), |step| (step.starts, step.starts_agree))
    }

    #[getter]
    fn bic(&self) -> f64 {
        self.found.steps.last().map_or(f64::NAN, |step| step.bic)
    }

    /// As of a fit of a model of the user's own.
    #[getter]
    fn control_loop(&self) -> Option<String> {
        let known = self.found.control_loop.as_ref()?;
        let unit = &self.found.input_unit;
        Some(ctid::sentences::of_the_loop(known, unit, &PYTHON))
    }

    #[getter]
    fn sentences(&self) -> Vec<String> {
        ctid::sentences::of_diagnosis(&self.found)
    }

    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// The result as `ctid compare --json` or `ctid diagnose --json` writes it, without its mark.
    fn json(&self) -> PyResult<String> {
        json(&Written::of(&self.found))
    }

    fn html(&self, py: Python<'_>) -> String {
        py.detach(|| ctid::report::html(&self.found))
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
        let found = work::run(py, None, |stop, _| {
            let file = parsed(&self.text)?;
            let options = ReadOptions::from(file.hold);
            let reading = frame.inputs(&file.columns, &options)?;
            let mut problem = self.problem.clone();
            problem.test.clear();
            let path = PathBuf::from(&reading.record.name);
            let options = self::options(EffortLevel::Normal.limit(), stop);
            of_plant(
                problem,
                (reading.record, TimeColumn::default(), &file.columns.outputs),
                (Path::new(&path), first),
                level,
                &options,
            )
        })?;
        simulation(py, &found)
    }

    /// The same fit with records that are held out, for their scores.
    fn with_test(&self, py: Python<'_>, test: Vec<Bound<'_, Frame>>) -> PyResult<Self> {
        let mut frames = self.frames[..self.fitted].to_vec();
        frames.extend(contents(&test));
        let known = self.known.clone();
        work::run(py, None, |stop, _| {
            let problem = problem(parsed(&self.text)?, &frames, self.fitted)?;
            let found = compare(&problem, &options(EffortLevel::Normal.limit(), stop))?;
            Ok(Self {
                text: self.text.clone(),
                frames: Arc::new(frames),
                fitted: self.fitted,
                problem,
                found,
                known,
                modelica: OnceLock::new(),
            })
        })
    }

    /// What the plant is missing.
    #[pyo3(signature = (test, *, effort, time_limit, max_effects, seed, progress=None))]
    #[allow(clippy::too_many_arguments, reason = "Python hands them over by name")]
    fn diagnose(
        &self,
        py: Python<'_>,
        test: Vec<Bound<'_, Frame>>,
        effort: &str,
        time_limit: Option<f64>,
        max_effects: Option<usize>,
        seed: u64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let limit = limit(effort, time_limit)?;
        let mut frames = self.frames[..self.fitted].to_vec();
        frames.extend(contents(&test));
        work::run(py, progress.as_ref(), |stop, phases| {
            let problem = problem(parsed(&self.text)?, &frames, self.fitted)?;
            let mut options = options(limit, stop);
            options.seed = seed;
            options.max_effects = max_effects.unwrap_or(options.max_effects);
            let found = diagnose(&problem, &options, &|progress| phases.tell(progress.phase))?;
            Ok(Self {
                text: self.text.clone(),
                frames: Arc::new(frames),
                fitted: self.fitted,
                problem,
                found,
                known: None,
                modelica: OnceLock::new(),
            })
        })
    }

    /// What it is made of again: the text and the records, with the fit repeated.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let kept = KeptTank {
            text: self.text.clone(),
            frames: self.frames[..self.fitted].to_vec(),
        };
        Ok(PyBytes::new(py, &bytes::of(&kept)?))
    }

    /// `model`: the text of another model file for the same records, in the place of that of the fit.
    #[staticmethod]
    #[pyo3(signature = (content, model=None))]
    fn from_bytes(py: Python<'_>, content: &[u8], model: Option<String>) -> PyResult<Self> {
        let KeptTank { text, frames } = bytes::read(content)?;
        Self::of(py, model.unwrap_or(text), frames, None)
    }

    /// The plant with its effects as the text of a model. The effects at the ports of the plant's text have parameters of their own, which
    /// are fitted to the records here.
    fn to_modelica(&self, py: Python<'_>) -> PyResult<String> {
        if let Some(text) = self.modelica.get() {
            return Ok(text.clone());
        }
        let text = work::run(py, None, |stop, _| {
            let file = parsed(&self.text)?;
            let options = options(EffortLevel::Normal.limit(), stop);
            let read = (&file.columns, file.hold);
            let text = text_of_plant(&self.problem, read, &options);
            text.map_err(|what| ctid::Error::Usage(format!("{what}; {WITHOUT_TEXT}")))
        })?;
        Ok(self.modelica.get_or_init(|| text).clone())
    }

    /// The matrices of this text about values of its states and inputs.
    fn linearize<'py>(
        &self,
        py: Python<'py>,
        at: BTreeMap<String, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let spec = ModelSpec::parse(&self.to_modelica(py)?).map_err(error::of_model)?;
        crate::linear::linearize(py, spec, &at)
    }
}

/// A fit of a plant as it is pickled.
#[derive(Serialize, Deserialize)]
pub struct KeptTank {
    pub text: String,
    pub frames: Vec<Content>,
}
