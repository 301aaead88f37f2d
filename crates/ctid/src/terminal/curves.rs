//! Plots of measurement and model over time, and of the residual.

use console::Style;
use missing_effect::{Diagnosis, Shown, Step};

use super::model_name;
use crate::csv_text::header;
use crate::findings;
use crate::look::Look;
use crate::plot::{self, Axis, Curve, plot};

/// Measurement and model over time, in the first record, output by output.
pub(crate) fn overlay(diagnosis: &Diagnosis, step: &Step, look: Look) -> String {
    let outputs = 0..diagnosis.outputs.len();
    outputs
        .map(|output| overlay_of(diagnosis, step, output, look))
        .collect()
}

fn overlay_of(diagnosis: &Diagnosis, step: &Step, output: usize, look: Look) -> String {
    let Some((record, measured, model)) = first_record(diagnosis, step, output) else {
        return String::new();
    };
    let key = if look.colour {
        format!(
            "measured {} and model {}",
            look.paint(Style::new().fg(plot::MEASURED), "━━"),
            look.paint(Style::new().fg(plot::MODEL), "━━")
        )
    } else {
        "measured and model".to_string()
    };
    let title = format!("{}{}:", record.name, of_output(diagnosis, output));
    format!(
        "{} {}\n{}\n",
        look.heading(&title),
        header(&key, &diagnosis.output_unit),
        plot::overlay(measured, model, Axis::Times(&record.time), look)
    )
}

/// ` upper` after a comma, if there are several outputs.
fn of_output(diagnosis: &Diagnosis, output: usize) -> String {
    let name = diagnosis.outputs.get(output);
    let name = name.filter(|_| findings::several(diagnosis));
    name.map_or(String::new(), |name| format!(", {name}"))
}

/// The residual of each of these steps over time in the first record, those of an output with a common scale.
pub(crate) fn residuals(diagnosis: &Diagnosis, steps: &[&Step], look: Look) -> String {
    let outputs = 0..diagnosis.outputs.len();
    outputs
        .map(|output| residuals_of(diagnosis, steps, output, look))
        .collect()
}

fn residuals_of(diagnosis: &Diagnosis, steps: &[&Step], output: usize, look: Look) -> String {
    let residuals: Vec<(&&Step, &Shown, Vec<f64>)> = steps
        .iter()
        .filter_map(|step| {
            let (record, measured, model) = first_record(diagnosis, step, output)?;
            let residual = measured
                .iter()
                .zip(model)
                .map(|(y, model)| y - model)
                .collect();
            Some((step, record, residual))
        })
        .collect();
    let (low, high) = plot::limits(residuals.iter().map(|(_, _, residual)| residual.as_slice()));
    let largest = low.abs().max(high.abs());
    let mut text = String::new();
    for (step, record, residual) in &residuals {
        let curve = Curve {
            values: residual,
            colour: plot::RESIDUAL,
        };
        let title = format!("Measured minus model{}", of_output(diagnosis, output));
        let title = header(&title, &diagnosis.output_unit) + ":";
        text += &format!(
            "{} {}\n{}\n",
            look.heading(&title),
            model_name(diagnosis, step),
            plot(
                &[curve],
                Axis::Times(&record.time),
                (-largest, largest),
                5,
                look
            )
        );
    }
    text
}

/// The first record, with the measured and simulated values of this output.
fn first_record<'a>(
    diagnosis: &'a Diagnosis,
    step: &'a Step,
    output: usize,
) -> Option<(&'a Shown, &'a [f64], &'a [f64])> {
    let record = diagnosis.records.first()?;
    let measured = record.outputs.get(output)?;
    let model = step.simulated.get(output)?;
    (model.len() == measured.len() && model.len() > 1).then_some((record, measured, model))
}
