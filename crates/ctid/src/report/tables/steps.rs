//! Tables with a column for each step: parameters and errors.

use effect_search::HeldOutError;
use missing_effect::{Diagnosis, Parameter, Step};

use super::{one_decimal, table};
use crate::findings;
use crate::report::data::step_label;
use crate::report::text::{code, escape, significant, unit, with_error};
use crate::sentences::of_prior;

/// The parameters of every step side by side, with the error of the fit.
pub(crate) fn parameters(diagnosis: &Diagnosis) -> String {
    let steps = &diagnosis.steps;
    let heads: String = last_first(steps)
        .map(|(k, step)| {
            let last = if k > 0 && k + 1 == steps.len() {
                "last: "
            } else {
                ""
            };
            format!(
                "<th scope=\"col\" class=\"number\" data-step=\"{k}\">{last}{}</th>",
                escape(&step_label(step))
            )
        })
        .collect();
    let mut rows: String = names(steps)
        .iter()
        .map(|(name, parameter_unit)| {
            row(&code(name), &unit(parameter_unit), steps, |step| {
                step.parameters
                    .iter()
                    .find(|p| p.name == *name)
                    .map_or(String::new(), estimate)
            })
        })
        .collect();
    rows.push_str("</tbody><tbody>");
    let split = |step: &Step| step.outputs.iter().any(|of| of.held_out_error.is_some());
    let split = steps.iter().any(split);
    for (index, name) in diagnosis.outputs.iter().enumerate() {
        rows.push_str(&errors(diagnosis, index, name));
    }
    if findings::several(diagnosis) {
        let of = findings::TIMES_THE_NOISE;
        rows.push_str(&row("All outputs, fitted data", of, steps, |step| {
            significant(step.weighted_rmse, 3)
        }));
        if steps.iter().any(|step| step.weighted_rmse_test.is_some()) {
            rows.push_str(&row("All outputs, held-out data", of, steps, |step| {
                step.weighted_rmse_test
                    .map_or(String::new(), |error| significant(error, 3))
            }));
        }
    }
    rows.push_str(&row("BIC (smaller is better)", "", steps, |step| {
        one_decimal(step.bic)
    }));
    rows.push_str(&row(
        "Starts that reached this minimum",
        "",
        steps,
        |step| format!("{} of {}", step.starts_agree, step.starts),
    ));
    let held_out = if split {
        format!(" {}", findings::HELD_OUT_PARTS)
    } else {
        String::new()
    };
    table(
        "Parameters after each step",
        &format!("<tr><th scope=\"col\">Parameter</th><th scope=\"col\">Unit</th>{heads}</tr>"),
        &rows,
        &format!(
            "The last model first. Estimate ± standard error; * : the data do not determine it, or it is at a bound. \
             A minimum that one start alone has reached may not be the best one.{held_out}"
        ),
    )
}

/// Rows with the simulation error of an output; the output's name comes first if there are several.
fn errors(diagnosis: &Diagnosis, index: usize, name: &str) -> String {
    let steps = &diagnosis.steps;
    let unit = unit(diagnosis.unit_of(index));
    let of = |text: &str| {
        if findings::several(diagnosis) {
            format!("{}: {text}", escape(name))
        } else {
            text.to_owned()
        }
    };
    let number = |value: Option<f64>, digits: i32| {
        value.map_or(String::new(), |value| significant(value, digits))
    };
    let mut rows = row(
        &of("Simulation error, fitted data (rms)"),
        &unit,
        steps,
        |step| number(step.outputs.get(index).map(|output| output.rmse), 3),
    );
    let test = |step: &Step| step.outputs.get(index)?.rmse_test;
    if steps.iter().any(|step| test(step).is_some()) {
        rows.push_str(&row(
            &of("Simulation error, held-out data (rms)"),
            &unit,
            steps,
            |step| number(test(step), 3),
        ));
    }
    let parts = |step: &Step| {
        let error = step.outputs.get(index)?.held_out_error;
        error.map(
            |HeldOutError {
                 offset,
                 gain,
                 shape,
             }| [offset, gain, shape],
        )
    };
    if steps.iter().any(|step| parts(step).is_some()) {
        for (part, name) in ["Its offset", "Its gain", "Its shape"].iter().enumerate() {
            rows.push_str(&row(&of(name), &unit, steps, |step| {
                number(parts(step).map(|parts| parts[part]), 2)
            }));
        }
    }
    rows
}

/// Every parameter once, with its unit, in the order of the last step, which has the most parameters.
fn names(steps: &[Step]) -> Vec<(&str, &str)> {
    let mut names: Vec<(&str, &str)> = Vec::new();
    for parameter in steps.iter().rev().flat_map(|step| &step.parameters) {
        if !names.iter().any(|(name, _)| *name == parameter.name) {
            names.push((&parameter.name, &parameter.unit));
        }
    }
    names
}

/// The last model first, so that it is visible with any number of models; then the others in their order.
fn last_first(steps: &[Step]) -> impl Iterator<Item = (usize, &Step)> {
    let all = || steps.iter().enumerate();
    let before = steps.len().saturating_sub(1);
    all().skip(before).chain(all().take(before))
}

fn row(name: &str, unit: &str, steps: &[Step], cell: impl Fn(&Step) -> String) -> String {
    let cells: String = last_first(steps)
        .map(|(k, step)| format!("<td class=\"number\" data-step=\"{k}\">{}</td>", cell(step)))
        .collect();
    format!("<tr><th scope=\"row\">{name}</th><td>{unit}</td>{cells}</tr>\n")
}

fn estimate(parameter: &Parameter) -> String {
    let mut value = with_error(parameter.value, parameter.std_error);
    if parameter.std_error.is_none() {
        value += " *";
    }
    match of_prior(parameter) {
        Some(words) => format!("{value}<br><small>{}</small>", escape(&words)),
        None => value,
    }
}
