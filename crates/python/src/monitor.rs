//! A monitor: the model run in parallel with a plant.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ct_model::effects::{apply, own_candidates};
use ct_model::{Model as Compiled, ModelSpec};
use ctid::own_model::OwnSettings;
use monitor::{CandidateModel, Notice, OwnModel, Row, Settings, State, Units};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};

use crate::model::Inner;
use crate::{bytes, error};

/// A watched model, and with each candidate of its user's own.
struct Models {
    model: Compiled,
    candidates: Vec<CandidateModel>,
}

/// Monitored models live as long as the interpreter, because a monitor borrows its model. Each text is stored once with the same
/// candidates.
static MODELS: Mutex<Option<HashMap<String, &'static Models>>> = Mutex::new(None);

fn kept(spec: ModelSpec, settings: &OwnSettings) -> PyResult<&'static Models> {
    let mut own = settings.candidates.clone();
    own.retain(|id, _| !settings.effects.contains(id));
    let key = format!("{spec}{own:?}");
    let mut models = MODELS.lock().unwrap_or_else(PoisonError::into_inner);
    let models = models.get_or_insert_default();
    if let Some(known) = models.get(&key) {
        return Ok(known);
    }
    let candidates = own_candidates(&spec, &own).map_err(error::of_model)?;
    let is_on = |id: &String| settings.effects.contains(id);
    let candidates = candidates
        .into_iter()
        // Alone it is the same as what it repeats.
        .filter(|candidate| candidate.repeats.as_ref().is_none_or(is_on))
        .map(|candidate| {
            let with = apply(&spec, &[&candidate]).map_err(error::of_model)?;
            let model = Compiled::new(with);
            Ok(CandidateModel { candidate, model })
        });
    let candidates = candidates.collect::<PyResult<_>>()?;
    let model = Compiled::new(spec);
    let all = Box::leak(Box::new(Models { model, candidates }));
    models.insert(key, all);
    Ok(all)
}

/// Watches a plant row by row.
#[pyclass(frozen, module = "ctid._ctid")]
pub struct Monitor {
    watched: Watched,
    monitor: Mutex<monitor::Monitor<'static>>,
}

/// The monitored model in its pickled form.
#[derive(Clone, Serialize, Deserialize)]
struct Watched {
    /// The model, its effects in it, with its values.
    text: String,
    settings: OwnSettings,
    time_unit: f64,
    rows_between_false_alarms: f64,
    learning_rows: usize,
}

impl Watched {
    fn begin(&self, state: Option<State>) -> PyResult<monitor::Monitor<'static>> {
        let spec = ModelSpec::parse_to_simulate(&self.text).map_err(error::of_model)?;
        let models = kept(spec, &self.settings)?;
        let model = OwnModel {
            model: &models.model,
            known: self.settings.known.clone(),
            priors: self.settings.priors.clone(),
            hold: self.settings.hold,
            time_unit: self.time_unit,
            candidates: &models.candidates,
        };
        let settings = Settings {
            rows_between_false_alarms: self.rows_between_false_alarms,
            learning_rows: self.learning_rows,
            ..Settings::default()
        };
        let monitor = match state {
            None => monitor::Monitor::new(model, settings, Units::default()),
            Some(state) => monitor::Monitor::restore(model, settings, state),
        };
        monitor.map_err(error::of_model)
    }
}

impl Monitor {
    pub fn of(
        model: &Arc<Inner>,
        time_unit: f64,
        rows_between_false_alarms: f64,
        learning_rows: usize,
    ) -> PyResult<Self> {
        let spec = model.valued().map_err(|error| error::of(&error))?;
        let watched = Watched {
            text: spec.to_string(),
            settings: model.file.settings(),
            time_unit,
            rows_between_false_alarms,
            learning_rows,
        };
        let monitor = watched.begin(None)?;
        Ok(Self {
            watched,
            monitor: Mutex::new(monitor),
        })
    }

    fn monitor(&self) -> MutexGuard<'_, monitor::Monitor<'static>> {
        self.monitor.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A notice: its kind and its numbers.
fn notice<'py>(py: Python<'py>, notice: &Notice) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let kind = match notice {
        Notice::Gap {
            from,
            to,
            missing,
            bridged,
        } => {
            all.set_item("from", from)?;
            all.set_item("to", to)?;
            all.set_item("missing", missing)?;
            all.set_item("bridged", bridged)?;
            "gap"
        }
        Notice::ClockSetBack { from, to } => {
            all.set_item("from", from)?;
            all.set_item("to", to)?;
            "clock-set-back"
        }
        Notice::IntervalChanged { time, from, to } => {
            all.set_item("time", time)?;
            all.set_item("from", from)?;
            all.set_item("to", to)?;
            "interval-changed"
        }
        Notice::Learned {
            rows,
            time_constant,
            noise,
            every,
            threshold,
        } => {
            all.set_item("rows", rows)?;
            all.set_item("time_constant", time_constant)?;
            all.set_item("noise", noise)?;
            all.set_item("every", every)?;
            all.set_item("threshold", threshold)?;
            "learned"
        }
        Notice::FitsAgain { time, since } => {
            all.set_item("time", time)?;
            all.set_item("since", since)?;
            "fits-again"
        }
        Notice::LearnsAnew { why } => {
            all.set_item("why", why)?;
            "learns-anew"
        }
        Notice::NotLearned { why } => {
            all.set_item("why", why)?;
            "not-learned"
        }
        _ => "other",
    };
    all.set_item("kind", kind)?;
    Ok(all)
}

/// Residual, and innovation in standard deviations; none without a reading, and during learning.
type Innovation = Option<(f64, f64)>;

#[pymethods]
impl Monitor {
    /// Processes a row: innovations, the alarm and those of the noise as JSON, notices, reasons for missing readings.
    #[allow(clippy::type_complexity)]
    fn update<'py>(
        &self,
        py: Python<'py>,
        time: f64,
        inputs: Vec<f64>,
        outputs: Vec<f64>,
    ) -> PyResult<(
        Vec<Innovation>,
        Option<String>,
        Vec<String>,
        Vec<Bound<'py, PyDict>>,
        Vec<Option<String>>,
    )> {
        let row = Row::with_inputs(time, &inputs, &outputs);
        let step = py.detach(|| self.monitor().update(&row));
        let step = step.map_err(error::of_data)?;
        let innovations = step.innovations.iter();
        let innovations = innovations.map(|i| i.map(|i| (i.residual, i.standardised)));
        let alarm = step
            .alarm
            .as_ref()
            .map(crate::diagnosis::json)
            .transpose()?;
        let scatter = step.scatter.iter().map(crate::diagnosis::json);
        let notices = step.notices.iter().flatten().map(|n| notice(py, n));
        let lost = step
            .lost
            .iter()
            .map(|l| l.as_ref().map(ToString::to_string));
        Ok((
            innovations.collect(),
            alarm,
            scatter.collect::<PyResult<_>>()?,
            notices.collect::<PyResult<_>>()?,
            lost.collect(),
        ))
    }

    /// Name, unit, learned value, present value, half the width of its 95 % interval.
    #[getter]
    fn estimates(&self) -> Vec<(String, String, f64, f64, Option<f64>)> {
        let all = self.monitor().estimates().into_iter();
        all.map(|e| (e.name, e.unit, e.learned, e.value, e.half_width))
            .collect()
    }

    /// `learning`, `watching` or `alarmed`, and the number of rows, or the largest score and its threshold.
    #[getter]
    fn progress(&self) -> (&'static str, f64, f64) {
        match self.monitor().progress() {
            monitor::Progress::Learning(rows) => ("learning", rows as f64, f64::NAN),
            monitor::Progress::Watching { score, threshold } => ("watching", score, threshold),
            monitor::Progress::Alarmed { score, threshold } => ("alarmed", score, threshold),
        }
    }

    #[getter]
    fn rows(&self) -> u64 {
        self.monitor().rows()
    }

    /// Names of the inputs and the outputs.
    #[getter]
    fn signals(&self) -> PyResult<(Vec<String>, Vec<String>)> {
        let spec = ModelSpec::parse_to_simulate(&self.watched.text).map_err(error::of_model)?;
        let inputs = spec.inputs.iter().map(|u| u.about.name.clone());
        let outputs = spec.outputs.iter();
        let outputs = outputs.map(|output| spec.about(output.variable).name.clone());
        Ok((inputs.collect(), outputs.collect()))
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let state = self.monitor().state();
        Ok(PyBytes::new(py, &bytes::of(&(&self.watched, state))?))
    }

    #[staticmethod]
    fn from_bytes(content: &[u8]) -> PyResult<Self> {
        let (watched, state): (Watched, State) = bytes::read(content)?;
        let monitor = watched.begin(Some(state))?;
        Ok(Self {
            watched,
            monitor: Mutex::new(monitor),
        })
    }
}
