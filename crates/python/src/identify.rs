//! Linear models in continuous time from records: `ctid identify`.

use clap::ValueEnum;
use ct_signals::{Columns, ReadOptions, Reading};
use ctid::output::Written;
use fcloe::Controller;
use linear_identification::{
    DelayChoice, LevelChoice, Method, Order, Request, identify_mended, mend,
};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::error;
use crate::frame::{Frame, contents, hold_of};
use crate::json::json;
use crate::message_names::IDENTIFY;
use crate::work;

/// Time, measured output, simulated output.
type Shown<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
);

/// Polynomials of a controller `u = R/S (r - y)`, by rising powers.
pub fn controller(polynomials: Option<(Vec<f64>, Vec<f64>)>) -> PyResult<Option<Controller>> {
    let Some((r, s)) = polynomials else {
        return Ok(None);
    };
    let of = |coefficients| ct_lti::Polynomial::new(coefficients).map_err(error::of_model);
    let controller = Controller::new(of(r)?, of(s)?);
    controller.map(Some).map_err(error::of_model)
}

/// Identifies a linear model; returns what `ctid identify --json` writes, without its mark, and the curves.
#[pyfunction]
#[pyo3(signature = (
    frames, inputs, output, *, reference, method, order, delay, integrator, memory, bandwidth, levels, controller, limits, hold
))]
#[allow(clippy::too_many_arguments, reason = "Python passes them by name")]
pub fn identify<'py>(
    py: Python<'py>,
    frames: Vec<Bound<'py, Frame>>,
    inputs: Vec<String>,
    output: String,
    reference: Option<String>,
    method: &str,
    order: (usize, usize),
    delay: Option<String>,
    integrator: bool,
    memory: Option<f64>,
    bandwidth: Option<f64>,
    levels: &str,
    controller: Option<(Vec<f64>, Vec<f64>)>,
    limits: (f64, f64),
    hold: &str,
) -> PyResult<(String, Shown<'py>)> {
    let choices = |all: Vec<String>| all.join(", ");
    let method = Method::from_str(method, false).map_err(|_| {
        let all = Method::value_variants().iter().map(|m| m.id().to_string());
        error::of_model(format!(
            "\"{method}\" is not a method: there are {}",
            choices(all.collect())
        ))
    })?;
    let levels = LevelChoice::from_str(levels, false).map_err(|_| {
        let all = LevelChoice::value_variants().iter();
        let all = all.filter_map(ValueEnum::to_possible_value);
        error::of_model(format!(
            "\"{levels}\" is not a choice of levels: there are {}",
            choices(all.map(|v| v.get_name().to_string()).collect())
        ))
    })?;
    let (n, m) = order;
    let order: Order = format!("{n},{m}").parse().map_err(error::of_model)?;
    let delay = delay.map(|text| text.parse::<DelayChoice>());
    let delay = delay.transpose().map_err(error::of_model)?;
    if !method.is_refined() && (delay.is_some() || integrator || inputs.len() > 1) {
        return Err(error::of_model(format!(
            "{} supports only one input, without delay and integrator: use srivc or rivc",
            method.id()
        )));
    }
    let controller = self::controller(controller)?;
    if controller.is_some() && !method.is_of_loop() {
        return Err(error::of_model(format!(
            "{} does not use a controller: leave it out, or use ls, iv, fcloe or recursive-fcloe",
            method.id()
        )));
    }
    let request = Request {
        memory,
        bandwidth,
        controller,
        levels,
        limits,
        delay,
        integrator,
        ..Request::new(method, order)
    };
    let columns = Columns {
        without_inputs: inputs.is_empty(),
        inputs,
        outputs: vec![output],
        references: reference.into_iter().collect(),
        ..Columns::default()
    };
    let options = ReadOptions::from(hold_of(hold)?);
    let frames = contents(&frames);
    if frames.len() > 1 && !method.is_refined() {
        return Err(error::of_data(format!(
            "{} fits one record: srivc and rivc fit several",
            method.id()
        )));
    }
    let found = work::run_worded(py, None, &IDENTIFY, |_, _| {
        let read = |frame: &crate::frame::Content| frame.record(&columns, &options);
        let all = frames
            .iter()
            .map(read)
            .collect::<Result<Vec<Reading>, _>>()?;
        let mut records: Vec<_> = all.into_iter().map(|reading| reading.record).collect();
        if columns.references.is_empty() {
            records.iter_mut().for_each(|r| r.references.clear());
        }
        let (mended, _) = mend(records, Vec::new(), order, integrator)?;
        Ok(identify_mended(&mended, &request)?)
    })?;
    let shown = &found.shown;
    let curves = (
        PyArray1::from_slice(py, &shown.time),
        PyArray1::from_slice(py, &shown.output.values),
        PyArray1::from_slice(py, &shown.simulated),
    );
    Ok((json(&Written::of(&found))?, curves))
}
