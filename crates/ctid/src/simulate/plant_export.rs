//! The curves of a plant's fit, and its text.

use ct_model::Expression;
use ct_signals::{Columns, Heading, Hold, ReadSummary};
use missing_effect::{Fitted, Options, Problem};

use super::plant_text::AtPorts;
use super::{Curves, FittedRecord};
use crate::input::{Files, Input};
use crate::model_file::ModelFile;
use crate::numbers;
use crate::own_model::{Exported, commented};
use crate::{Error, MessageNames};

/// The text of a plant with fitted values: names and values of its parameters, then of its levels.
fn text(problem: &Problem, values: &[(String, f64)], errors: &[Option<f64>]) -> Option<String> {
    let mut record = problem.records[0].clone();
    let mut spec = problem.plant.spec_of(&problem.known, &mut record).ok()?;
    let names: Vec<String> = problem.records.iter().map(|r| r.name.clone()).collect();
    let mut head = vec![format!(
        "Written by ctid export from plant {}, fitted to {}.",
        problem.plant.id(),
        names.join(", ")
    )];
    head.push("Time is in seconds.".to_string());
    head.push("Standard errors (fitted values are below):".to_string());
    for parameter in &mut spec.parameters {
        let name = &parameter.about.name;
        if let Some(at) = values.iter().position(|(own, _)| own == name) {
            parameter.value = values[at].1;
            let error = errors[at].map(|error| numbers::significant(error, 3));
            let error = error.unwrap_or_else(|| "none: at a bound, or not determined".to_string());
            head.push(format!("  {name}: {error}"));
        }
    }
    let levels = &values[errors.len()..];
    for (state, (_, value)) in spec.states.iter_mut().zip(levels) {
        state.start = Expression::number(*value);
    }
    if names.len() > 1 {
        head.push(format!("Initial states are those of {}.", names[0]));
    }
    Some(commented(&head, &spec))
}

/// The root mean square of the simulation error of a plant at each output, on the measured command.
fn errors_on_command(
    problem: &Problem,
    options: &Options,
) -> Result<Vec<f64>, missing_effect::Error> {
    let options = Options {
        simulate_loop: false,
        ..*options
    };
    missing_effect::fitted(problem, &options, |fitted| fitted.fit.rmse.clone())
}

/// The text of a plant with effects, which are fitted to the plant's records. `columns`, `hold`: of the model file.
///
/// # Errors
/// Why there is no text: it cannot have one of the effects, a fit fails, or it does not fit as well as the plant.
pub fn text_of_plant(
    problem: &Problem,
    (columns, hold): (&Columns, Hold),
    options: &Options,
) -> Result<String, String> {
    let at_ports = AtPorts::of(problem)?;
    let of_fit = |fitted: &Fitted| (fitted.setup.records.to_vec(), fitted.fit.rmse.clone());
    let fitted = missing_effect::fitted(problem, options, |fitted| of_fit(&fitted));
    let said = |error: missing_effect::Error| error.worded(&MessageNames::PROGRAM.fit);
    let (records, rmse) = fitted.map_err(said)?;
    let errors = errors_of_text(problem, rmse, options).map_err(said)?;
    at_ports.fitted(problem, &records, (columns, hold), &errors, options)
}

/// The errors that the text has to reach: it is simulated on the measured command. `rmse`: of the plant's fit.
fn errors_of_text(
    problem: &Problem,
    rmse: Vec<f64>,
    options: &Options,
) -> Result<Vec<f64>, missing_effect::Error> {
    match problem.controller {
        None => Ok(rmse),
        Some(_) => errors_on_command(problem, options),
    }
}

/// Fits a plant with its effects to records, and returns the curves and, if wanted, its Modelica text.
///
/// # Errors
/// One line that names the file, the place and the correction.
pub(crate) fn export(
    model: ModelFile,
    files: &Files,
    options: &Options,
    with_text: bool,
) -> Result<(Exported, Vec<ReadSummary>), Error> {
    let (columns, name) = (model.columns.clone(), model.plant.id().to_string());
    let hold = model.hold;
    let Input { problem, summaries } = files.read_with(model)?;
    let plain = problem.effects.is_empty() && problem.terms.is_empty();
    let refused = |why: String| {
        let what = format!("--modelica: {why}; write its curves with --csv");
        Error::file(&files.model, &what)
    };
    let at_ports = match with_text && !plain {
        true => Some(AtPorts::of(&problem).map_err(refused)?),
        false => None,
    };
    let first = &problem.records[0];
    let name_of = |names: &[String], i: usize, channel: &ct_signals::Channel| {
        let named = names.get(i).filter(|name| !name.is_empty());
        let name = named.map(|name| Heading::of(name).name);
        (
            name.unwrap_or_else(|| channel.name.clone()),
            channel.unit.clone(),
        )
    };
    let inputs = first.inputs.iter().enumerate();
    let inputs = inputs.map(|(i, channel)| name_of(&columns.inputs, i, channel));
    let outputs = first.outputs.iter().enumerate();
    let outputs = outputs.map(|(i, channel)| name_of(&columns.outputs, i, channel));
    let (inputs, outputs): (Vec<_>, Vec<_>) = (inputs.collect(), outputs.collect());
    let fitted = missing_effect::fitted(&problem, options, |fitted| {
        let model = fitted.setup.simulate(&fitted.fit.x)?.output;
        let names = fitted.setup.names().iter().cloned();
        let values: Vec<_> = names.zip(fitted.fit.x.iter().copied()).collect();
        let std_error = |i: usize| fitted.uncertainty?.std_error(i);
        let errors = (0..fitted.setup.parameter_count()).map(std_error);
        let errors: Vec<Option<f64>> = errors.collect();
        Ok((
            fitted.setup.records.to_vec(),
            model,
            (with_text && plain)
                .then(|| text(&problem, &values, &errors))
                .flatten(),
            fitted.fit.rmse.clone(),
        ))
    });
    let (records, model, text, rmse) = fitted
        .map_err(|error| files.blame(error))?
        .map_err(|error: greybox::Error| files.blame(error.into()))?;
    let text = match at_ports {
        None => text,
        Some(at_ports) => {
            let errors = errors_of_text(&problem, rmse, options).map_err(|e| files.blame(e))?;
            let read = (&columns, hold);
            let text = at_ports.fitted(&problem, &records, read, &errors, options);
            Some(text.map_err(refused)?)
        }
    };
    let exported = Exported {
        schema: 1,
        model: name,
        fitted_to: problem.records.iter().map(|r| r.name.clone()).collect(),
        warnings: Vec::new(),
        text,
        curves: Some(Curves {
            inputs,
            outputs,
            records: FittedRecord::all(&records, &model, (files, &columns))?,
        }),
    };
    Ok((exported, summaries))
}
