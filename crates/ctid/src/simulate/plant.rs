//! Simulation of a built-in plant with new inputs.

use std::path::Path;

use ct_signals::{Heading, ReadOptions, Record};
use greybox::{
    FitUncertainty, InitialStates, Setup, Stopping, levels_from_readings, output_errors,
    steady_state,
};
use missing_effect::{Fitted, Options, Problem};

use super::{
    Band, Inputs, LEVEL, Simulated, SimulatedOutput, StateSource, TimeColumn, begins_with_readings,
    of_first_readings, read_inputs,
};
use crate::Error;
use crate::input::{self, Files};
use crate::model_file::ModelFile;

/// Stopping criteria of the fit of initial levels.
const STOPPING: Stopping = Stopping {
    evaluations: 60,
    cost: 1e-10,
};

/// Fits a plant with its effects to records, and simulates it on the inputs of another.
///
/// # Errors
/// One line that names the file, the place and the correction.
pub(crate) fn simulate(
    model: ModelFile,
    files: &Files,
    inputs: &Inputs,
    options: &Options,
) -> Result<(Simulated, Vec<ct_signals::ReadSummary>), Error> {
    let columns = model.columns.clone();
    let read_options = ReadOptions {
        hold: model.hold,
        ..inputs.options.clone()
    };
    let read = read_inputs(&inputs.path, &columns, &read_options, Error::from)?;
    let input::Input {
        problem,
        mut summaries,
    } = files.read_with(model)?;
    summaries.push(read.summary);
    let names = columns.outputs.clone();
    let found = of_plant(
        problem,
        (read.record, read.time, &names),
        (&inputs.path, inputs.first),
        LEVEL,
        options,
    );
    Ok((
        found.map_err(|error| match error {
            Error::Diagnosis(error) => files.blame(error),
            other => other,
        })?,
        summaries,
    ))
}

/// A plant on the inputs of a record, after a fit to the records of a problem. `names`: the columns of its outputs, where they are named;
/// `path` is what is named in errors about the record, whose initial levels are fitted to the `first` readings of each output. `level`: the
/// probability with which the band holds, within 0 and 1.
///
/// # Errors
/// Where the records do not allow a fit, or the simulation does not go on.
pub fn of_plant(
    mut problem: Problem,
    (mut record, time, names): (Record, TimeColumn, &[String]),
    (path, first): (&Path, usize),
    level: f64,
    options: &Options,
) -> Result<Simulated, Error> {
    let name = problem.plant.id().to_string();
    let outputs = problem.known.outputs(problem.plant).len();
    while record.outputs.len() < outputs {
        let none = vec![f64::NAN; record.len()];
        record.outputs.push(ct_signals::Channel::new("y", "", none));
    }
    same_units(path, &mut record, &problem.records[0])?;
    let mut all = std::mem::take(&mut problem.records);
    all.push(record);
    input::on_one_clock(&mut all);
    let record = all.pop().unwrap_or_default();
    problem.records = all;
    let fitted = missing_effect::fitted(&problem, options, |fitted| {
        simulated(fitted, (path, first, level), &record)
    });
    let found = fitted??;
    let names = (0..outputs).map(|o| match names.get(o) {
        Some(name) => Heading::of(name).name,
        None => problem.records[0].outputs[o].name.clone(),
    });
    let outputs = found.mean.into_iter().zip(names).enumerate();
    let outputs = outputs.map(|(o, (mean, name))| SimulatedOutput {
        name,
        unit: record.outputs[o].unit.clone(),
        mean,
        band: found.bands.as_ref().map(|bands| bands[o].clone()),
        measured: record.outputs[o].values.clone(),
    });
    let mut warnings = found.warnings;
    if found.bands.is_none() {
        warnings.push(
            "the records do not determine all parameters, so there is no band: give a constant under [known], or a [prior]".to_string(),
        );
    }
    Ok(Simulated {
        schema: 1,
        model: name,
        effects: Vec::new(),
        inputs: record.name.clone(),
        fitted_to: problem.records.iter().map(|r| r.name.clone()).collect(),
        parameters: found.parameters,
        states: found.states,
        states_from: found.states_from,
        level,
        outputs: outputs.collect(),
        warnings,
        length: record.duration(),
        time,
        readings: false,
    })
}

/// The inputs and outputs have the units of the record that was fitted.
fn same_units(path: &Path, record: &mut Record, fitted: &Record) -> Result<(), Error> {
    if record.inputs.len() != fitted.inputs.len() {
        return Err(Error::file(
            path,
            format!(
                "it has {} inputs, and {} has {}; name all of them under [columns]",
                record.inputs.len(),
                fitted.name,
                fitted.inputs.len()
            ),
        ));
    }
    let own = record.inputs.iter_mut().chain(&mut record.outputs);
    for (own, fitted) in own.zip(fitted.inputs.iter().chain(&fitted.outputs)) {
        let there = own.missing() < own.values.len();
        if there && own.unit != fitted.unit {
            return Err(Error::file(
                path,
                format!(
                    "column \"{}\" is in [{}], and in the record that is fitted in [{}]; convert one of them, or name it with its unit under [columns]",
                    ct_signals::quoted(&own.name),
                    ct_signals::quoted(&own.unit),
                    ct_signals::quoted(&fitted.unit)
                ),
            ));
        }
        own.unit.clone_from(&fitted.unit);
    }
    Ok(())
}

struct Found {
    mean: Vec<Vec<f64>>,
    bands: Option<Vec<Band>>,
    parameters: Vec<(String, f64, Option<f64>)>,
    states: Vec<(String, f64)>,
    states_from: StateSource,
    warnings: Vec<String>,
}

fn simulated(
    fitted: Fitted,
    (path, first, level): (&Path, usize, f64),
    record: &Record,
) -> Result<Found, Error> {
    let wrong = |error: greybox::Error| Error::fit(path, error);
    let Fitted {
        setup: own,
        fit,
        uncertainty,
        lacking,
    } = fitted;
    let records = std::slice::from_ref(record);
    let mut setup = own.with_records(records).map_err(wrong)?;
    // Simulations run without a time limit, because they are short compared with a search.
    (setup.time_limit, setup.interrupt) = (None, None);
    let count = setup.parameter_count();
    let parameters = &fit.x[..count];
    let (initial, states_from) = states(&setup, parameters, (record, first), uncertainty)
        .map_err(wrong)?
        .ok_or_else(|| {
            Error::file(
                path,
                "the plant has no equilibrium under its first inputs, so its initial state is not known; put the first readings of the output into the file: initial levels are fitted to them",
            )
        })?;
    let mut x = parameters.to_vec();
    x.extend(&initial.values);
    let mean = setup.simulate(&x).map_err(wrong)?.output;
    let away = || {
        let k = mean
            .iter()
            .flat_map(|series| series.iter().position(|y| !y.is_finite()));
        let k = k.min().unwrap_or(0);
        let at = ct_signals::Clock::of([record]).at(record.time[k]);
        Error::file(
            path,
            format!(
                "the simulation stops at {at}: a level grows without bound; correct the inputs there, or the model file"
            ),
        )
    };
    if mean.iter().flatten().any(|y| !y.is_finite()) {
        return Err(away());
    }
    let bands = match uncertainty {
        None => None,
        Some(known) => {
            let errors = output_errors(&setup, &x, count, known, &initial).ok_or_else(away)?;
            let errors = errors.iter().enumerate();
            Some(
                errors
                    .map(|(o, errors)| Band::of(errors, known, o, level))
                    .collect(),
            )
        }
    };
    let std_error = |i: usize| uncertainty?.std_error(i);
    let names = setup.names();
    let mut warnings = Vec::new();
    if lacking {
        warnings.push(
            "the residual of the fit is not noise, and the band does not include this model error: `ctid diagnose` shows what is missing".to_string(),
        );
    }
    if states_from == StateSource::Rest && begins_with_readings(record) {
        warnings.push(format!(
            "the readings of {} do not determine the initial levels: the plant begins at rest under the first inputs",
            record.name
        ));
    }
    Ok(Found {
        mean,
        bands,
        parameters: (0..count)
            .map(|i| (names[i].clone(), fit.x[i], std_error(i)))
            .collect(),
        states: names[count..]
            .iter()
            .cloned()
            .zip(initial.values.iter().copied())
            .collect(),
        states_from,
        warnings,
    })
}

/// The initial levels: fitted to the first readings, to more of them if these are not sufficient, or at rest; `None` without a steady
/// state.
fn states(
    setup: &Setup,
    parameters: &[f64],
    (record, first): (&Record, usize),
    known: Option<&FitUncertainty>,
) -> Result<Option<(InitialStates, StateSource)>, greybox::Error> {
    let count = parameters.len();
    let fitted = of_first_readings((record, first), |begun| {
        let model = setup.with_records(begun)?;
        let Some(known) = known else {
            let x = greybox::fit_initial_levels(&model, parameters, STOPPING)?;
            return Ok(Some(InitialStates::known(x[count..].to_vec(), 0)));
        };
        let mut frozen = model.clone();
        frozen.freeze_parameters();
        let levels = levels_from_readings(&model, parameters);
        let x: Vec<f64> = parameters.iter().copied().chain(levels).collect();
        InitialStates::of_readings(&frozen, &model, &x, count, known, STOPPING)
    })?;
    if let Some(states) = fitted {
        return Ok(Some((states, StateSource::Readings)));
    }
    let at_rest = |parameters: &[f64]| steady_state(setup, parameters);
    let states = InitialStates::of_parameters(at_rest, parameters, known);
    Ok(states.map(|states| (states, StateSource::Rest)))
}
