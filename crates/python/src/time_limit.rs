//! The time limit of a search.

use std::time::Duration;

use ctid::effort::EffortLevel;
use pyo3::prelude::*;

use crate::error;

/// Time limit of a search.
pub fn limit(effort: &str, seconds: Option<f64>) -> PyResult<Duration> {
    let effort = match effort {
        "quick" => EffortLevel::Quick,
        "normal" => EffortLevel::Normal,
        "thorough" => EffortLevel::Thorough,
        other => {
            return Err(error::of_model(format!(
                "effort is \"quick\", \"normal\" or \"thorough\", and not \"{other}\""
            )));
        }
    };
    match seconds {
        None => Ok(effort.limit()),
        Some(seconds) => Duration::try_from_secs_f64(seconds)
            .map_err(|_| error::of_model("time_limit is a number of seconds above zero")),
    }
}

/// Time limit of a search in s.
#[pyfunction]
pub fn time_limit(effort: &str, seconds: Option<f64>) -> PyResult<f64> {
    Ok(limit(effort, seconds)?.as_secs_f64())
}
