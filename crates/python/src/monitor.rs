//! A monitor: a model that runs in parallel with the plant.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ct_model::effects::{apply, own_candidates};
use ct_model::{Model as Compiled, ModelSpec};
use ctid::model_file::ModelFile;
use ctid::own_model::OwnSettings;
use ctid::sentences::Told;
use monitor::{CandidateModel, NotUsed, Notice, OwnModel, Row, Settings, State, Units};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};

use crate::json::json;
use crate::own::Inner;
use crate::tank_file::{heading, parsed};
use crate::{bytes, error};

/// Watches a plant row by row.
#[pyclass(frozen, module = "ctid._ctid")]
pub struct Monitor {
    watched: Watched,
    monitor: Mutex<monitor::Monitor>,
}

/// What is watched, as it is pickled.
#[derive(Clone, Serialize, Deserialize)]
struct Watched {
    of: Of,
    rows_between_false_alarms: f64,
    learning_rows: usize,
}

/// A model as text, or one of the plants.
#[derive(Clone, Serialize, Deserialize)]
enum Of {
    Own {
        /// The model, its effects in it, with its values.
        text: String,
        settings: Box<OwnSettings>,
        time_unit: f64,
    },
    Tank {
        /// The model file that says the same.
        text: String,
        /// Those of the command and of the readings; empty where they are not known.
        units: (String, String),
    },
}

/// The watched model with each candidate of its user's own.
fn candidates(spec: &ModelSpec, settings: &OwnSettings) -> PyResult<Arc<[CandidateModel]>> {
    let mut own = settings.candidates.clone();
    own.retain(|id, _| !settings.effects.contains(id));
    let candidates = own_candidates(spec, &own).map_err(error::of_model)?;
    let is_on = |id: &String| settings.effects.contains(id);
    let candidates = candidates
        .into_iter()
        // Alone it is the same as what it repeats.
        .filter(|candidate| candidate.repeats.as_ref().is_none_or(is_on))
        .map(|candidate| {
            let with = apply(spec, &[&candidate]).map_err(error::of_model)?;
            let model = Compiled::new(with);
            Ok(CandidateModel { candidate, model })
        });
    candidates.collect()
}

impl Watched {
    fn begin(&self, state: Option<State>) -> PyResult<monitor::Monitor> {
        let (model, units): (monitor::Watched, Units) = match &self.of {
            Of::Own {
                text,
                settings,
                time_unit,
            } => {
                let spec = ModelSpec::parse_to_simulate(text).map_err(error::of_model)?;
                let own = OwnModel {
                    known: settings.known.clone(),
                    priors: settings.priors.clone(),
                    hold: settings.hold,
                    time_unit: *time_unit,
                    candidates: candidates(&spec, settings)?,
                    model: Arc::new(Compiled::new(spec)),
                };
                (own.into(), Units::default())
            }
            Of::Tank { text, units } => {
                let file = parsed(text).map_err(|error| error::of(&error))?;
                let (input, output) = units.clone();
                let believed = ctid::monitor::believed(&file);
                (believed.into(), Units { output, input })
            }
        };
        let settings = Settings {
            rows_between_false_alarms: self.rows_between_false_alarms,
            learning_rows: self.learning_rows,
            ..Settings::default()
        };
        let monitor = match state {
            None => monitor::Monitor::new(model, settings, units),
            Some(state) => monitor::Monitor::restore(model, settings, state),
        };
        monitor.map_err(error::of_model)
    }

    /// Names of the inputs and the outputs.
    fn signals(&self) -> PyResult<(Vec<String>, Vec<String>)> {
        match &self.of {
            Of::Own { text, .. } => {
                let spec = ModelSpec::parse_to_simulate(text).map_err(error::of_model)?;
                let inputs = spec.about_inputs().map(|u| u.name.clone());
                let outputs = spec.about_outputs().map(|y| y.name.clone());
                Ok((inputs.collect(), outputs.collect()))
            }
            Of::Tank { text, .. } => {
                let file = parsed(text).map_err(|error| error::of(&error))?;
                Ok(signals_of_tank(&file))
            }
        }
    }
}

/// The columns of a plant's command and readings; without them `u`, and `y` or the names of the levels that are read.
fn signals_of_tank(file: &ModelFile) -> (Vec<String>, Vec<String>) {
    let read = file.known.outputs(file.plant);
    let name = |column: &String| heading(column).0;
    let inputs = match &file.columns.inputs[..] {
        [] => vec!["u".to_string()],
        columns => columns.iter().map(name).collect(),
    };
    let outputs = match (&file.columns.outputs[..], &read[..]) {
        ([], [_]) => vec!["y".to_string()],
        ([], _) => {
            let names = read.iter().map(|vessel| file.plant.level_name(*vessel));
            names.map(str::to_string).collect()
        }
        (columns, _) => columns.iter().map(name).collect(),
    };
    (inputs, outputs)
}

impl Monitor {
    fn of(of: Of, rows_between_false_alarms: f64, learning_rows: usize) -> PyResult<Self> {
        let watched = Watched {
            of,
            rows_between_false_alarms,
            learning_rows,
        };
        let monitor = watched.begin(None)?;
        Ok(Self {
            watched,
            monitor: Mutex::new(monitor),
        })
    }

    /// Of a model as text.
    pub fn of_model(
        model: &Arc<Inner>,
        time_unit: f64,
        rows_between_false_alarms: f64,
        learning_rows: usize,
    ) -> PyResult<Self> {
        let spec = model.valued().map_err(|error| error::of(&error))?;
        let of = Of::Own {
            text: spec.to_string(),
            settings: Box::new(model.file.settings()),
            time_unit,
        };
        Self::of(of, rows_between_false_alarms, learning_rows)
    }

    /// Of one of the plants.
    pub fn of_tank(
        text: &str,
        units: (String, String),
        rows_between_false_alarms: f64,
        learning_rows: usize,
    ) -> PyResult<Self> {
        let text = text.to_string();
        let of = Of::Tank { text, units };
        Self::of(of, rows_between_false_alarms, learning_rows)
    }

    /// The error of a row that is not used, which names the signal.
    fn refused(&self, refused: &NotUsed) -> PyErr {
        let (inputs, outputs) = match self.watched.signals() {
            Ok(signals) => signals,
            Err(error) => return error,
        };
        let name = match refused.column() {
            "input" => inputs.get(refused.at()),
            "output" => outputs.get(refused.at()),
            _ => None,
        };
        let name = name.map_or_else(|| "time".to_string(), |name| format!("\"{name}\""));
        error::of_data(format!(
            "{name}: {refused}; the row is not used: correct it, or leave it out"
        ))
    }

    fn monitor(&self) -> MutexGuard<'_, monitor::Monitor> {
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

/// Residual, the same in standard deviations; none without a reading, and while it learns.
type Innovation = Option<(f64, f64)>;

#[pymethods]
impl Monitor {
    /// Takes in a row: innovations, the alarm and those of the scatter as JSON, notices, why readings are lost.
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
        let (step, domain, axis) = py.detach(|| {
            let mut monitor = self.monitor();
            let step = monitor.update(&row);
            (step, monitor.domain(), monitor.axis().clone())
        });
        let step = step.map_err(|refused| self.refused(&refused))?;
        let innovations = step.innovations.iter();
        let innovations = innovations.map(|i| i.map(|i| (i.residual, i.standardised)));
        let alarm = step
            .alarm
            .as_ref()
            .map(|alarm| json(&Told::alarm(alarm, domain, &axis)))
            .transpose()?;
        let scatter = step.scatter.iter();
        let scatter = scatter.map(|scatter| json(&Told::scatter(scatter, domain)));
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

    /// Name, unit, value as learned, value now, half the width of its 95 % interval.
    #[getter]
    fn estimates(&self) -> Vec<(String, String, f64, f64, Option<f64>)> {
        let all = self.monitor().estimates().into_iter();
        all.map(|e| (e.name, e.unit, e.learned, e.value, e.half_width))
            .collect()
    }

    /// `learning`, `watching` or `alarmed`, and rows, or the largest score and its threshold.
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
        self.watched.signals()
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
