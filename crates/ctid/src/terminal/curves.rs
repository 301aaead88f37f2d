//! The plots: measurement and model over time, and what lies between them.

use console::Style;
use missing_effect::{Diagnosis, Shown, Step};

use super::{length, model_name};
use crate::look::Look;
use crate::plot::{self, Curve, plot};

/// Measurement and model over time, in the first record.
pub(crate) fn overlay(diagnosis: &Diagnosis, step: &Step, look: Look) -> String {
    let Some((record, model)) = first_record(diagnosis, step) else {
        return String::new();
    };
    let curves = [
        Curve {
            values: &record.output,
            colour: plot::MEASURED,
        },
        Curve {
            values: model,
            colour: plot::MODEL,
        },
    ];
    let key = if look.colour {
        format!(
            "measured {} and model {}",
            look.paint(Style::new().fg(plot::MEASURED), "━━"),
            look.paint(Style::new().fg(plot::MODEL), "━━")
        )
    } else {
        "measured and model".to_string()
    };
    let limits = plot::limits([record.output.as_slice(), model]);
    format!(
        "{} {key}{}\n{}\n",
        look.heading(&format!("{}:", record.name)),
        in_unit(&diagnosis.output_unit),
        plot(&curves, (0.0, length(record)), limits, 9, look)
    )
}

fn in_unit(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        format!(" [{unit}]")
    }
}

/// The residual of each of these steps over time in the first record, all on one scale.
pub(crate) fn residuals(diagnosis: &Diagnosis, steps: &[&Step], look: Look) -> String {
    let residuals: Vec<(&&Step, &Shown, Vec<f64>)> = steps
        .iter()
        .filter_map(|step| {
            let (record, model) = first_record(diagnosis, step)?;
            let residual = record
                .output
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
        let title = format!("Measured minus model{}:", in_unit(&diagnosis.output_unit));
        text += &format!(
            "{} {}\n{}\n",
            look.heading(&title),
            model_name(diagnosis, step),
            plot(
                &[curve],
                (0.0, length(record)),
                (-largest, largest),
                5,
                look
            )
        );
    }
    text
}

fn first_record<'a>(diagnosis: &'a Diagnosis, step: &'a Step) -> Option<(&'a Shown, &'a [f64])> {
    let record = diagnosis.records.first()?;
    let model = step.simulated.first()?;
    (model.len() == record.output.len() && model.len() > 1).then_some((record, model))
}
