//! The next experiment at one of the plants.

use std::path::Path;

use ctid::output::Written;
use missing_effect::design::{Limits, design};
use pyo3::prelude::*;

use crate::json::json;
use crate::tank::{KeptTank, options, problem};
use crate::tank_file::{NAME, parsed};
use crate::time_limit::limit;
use crate::{bytes, error, work};

/// The experiment that distinguishes two effects best, from a plant and its records, in the form in which [`crate::tank::TankFit`] is pickled: what
/// `ctid design --json` writes, without its mark.
#[pyfunction]
#[pyo3(signature = (content, between, *, range, slew, duration, seed, effort, time_limit, progress=None))]
#[allow(clippy::too_many_arguments, reason = "Python hands them over by name")]
pub fn tank_design(
    py: Python<'_>,
    content: &[u8],
    between: (String, String),
    range: Option<(f64, f64)>,
    slew: Option<f64>,
    duration: Option<f64>,
    seed: u64,
    effort: &str,
    time_limit: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let limit = limit(effort, time_limit)?;
    let limits = Limits {
        range,
        slew,
        duration,
        seed,
    };
    let KeptTank { text, frames } = bytes::read(content)?;
    let file = parsed(&text).map_err(|error| error::of(&error))?;
    for name in [&between.0, &between.1] {
        let id = name.split(':').next().unwrap_or(name);
        if file.effects.iter().any(|on| on.effect.id == id) {
            return Err(error::of_model(format!(
                "{id} is in the model already, so that there is nothing to decide"
            )));
        }
    }
    let found = work::run(py, progress.as_ref(), |stop, phases| {
        let first = ctid::design::candidacy(&file, Path::new(NAME), &between.0)?;
        let second = ctid::design::candidacy(&file, Path::new(NAME), &between.1)?;
        let problem = problem(file, &frames, frames.len())?;
        let tell = |progress: missing_effect::Progress| phases.tell(progress.phase);
        let found = design(
            &problem,
            [first, second],
            &limits,
            &options(limit, stop),
            &tell,
        );
        found.map_err(|error| match error {
            // An error in the limits is not an error of a record.
            missing_effect::Error::Design(refused) => refused.into(),
            error => error.into(),
        })
    })?;
    json(&Written::of(&found))
}
