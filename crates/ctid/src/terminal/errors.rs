//! Fall of the error from step to step.

use effect_search::OutputStep;
use missing_effect::Diagnosis;

use super::{BAR, model_name, step_name, with_unit};
use crate::look::{Look, Side, table_text};
use crate::sentences::of_noise_source;
use crate::{findings, numbers};

/// The error from step to step: for each output and, if there are several, for all together.
pub(crate) fn trail(diagnosis: &Diagnosis, look: Look) -> String {
    // The residual of a single model does not separate its noise from its model error.
    let floor_known = !findings::is_comparison(diagnosis);
    let several = findings::several(diagnosis);
    let mut text = String::new();
    for (index, floor) in diagnosis.noise.iter().enumerate() {
        let errors = diagnosis.steps.iter().map(|step| {
            let output = step.outputs.get(index);
            let rmse = output.map_or(f64::NAN, |output| output.rmse);
            (rmse, output.and_then(|output| output.rmse_test))
        });
        let of = if several {
            format!(" of {}", floor.output)
        } else {
            String::new()
        };
        let title = format!("Simulation error{of}, root mean square");
        let errors = Errors {
            title: &title,
            of_steps: errors.collect(),
            floor: floor.level,
            floor_known,
            unit: &diagnosis.output_unit,
        };
        text += &errors.table(diagnosis, look);
        if floor_known {
            let source = format!("(noise floor: {})", of_noise_source(floor));
            text += &look.faint(look.paragraph("  ", &source).trim_end());
            text.push('\n');
        }
        if several {
            text.push('\n');
        }
    }
    if several && floor_known {
        let errors = diagnosis.steps.iter();
        let errors = errors.map(|step| (step.weighted_rmse, step.weighted_rmse_test));
        let errors = Errors {
            title: "Simulation error of all outputs, in multiples of their noise",
            of_steps: errors.collect(),
            floor: 1.0,
            floor_known: false,
            unit: "",
        };
        text += &errors.table(diagnosis, look);
    }
    text += &held_out_errors(diagnosis, look);
    let outputs = diagnosis.steps.iter().map(|step| step.outputs.as_slice());
    text += &without_50(outputs, |_| &diagnosis.output_unit, look);
    text.push('\n');
    text
}

/// Errors on held-out records by the rule of newer benchmarks ([`OutputStep::rmse_test_50`]), from step to step, a line for each output.
pub(crate) fn without_50<'a>(
    steps: impl Iterator<Item = &'a [OutputStep]>,
    unit_of: impl Fn(&str) -> &'a str,
    look: Look,
) -> String {
    let steps: Vec<&[OutputStep]> = steps.collect();
    let names = steps.first().into_iter().flat_map(|outputs| outputs.iter());
    let lines = names
        .enumerate()
        .filter_map(|(o, OutputStep { name, .. })| {
            let errors = steps
                .iter()
                .filter_map(|outputs| outputs.get(o)?.rmse_test_50);
            let errors: Vec<String> = errors.map(|error| numbers::significant(error, 3)).collect();
            if errors.is_empty() {
                return None;
            }
            let errors = with_unit(&errors.join(", "), unit_of(name));
            let rule =
                "if the initial states are fitted to the first 50 rows and these are not scored";
            Some(look.paragraph("  ", &format!("{name}, held out, {rule}: {errors}")))
        });
    lines.collect()
}

/// The error of each step on the fitted and on the held-out records.
struct Errors<'a> {
    title: &'a str,
    of_steps: Vec<(f64, Option<f64>)>,
    floor: f64,
    /// Whether the floor is shown.
    floor_known: bool,
    unit: &'a str,
}

impl Errors<'_> {
    /// Table with bars above the noise floor.
    fn table(&self, diagnosis: &Diagnosis, look: Look) -> String {
        let held_out = self.of_steps.iter().any(|(_, test)| test.is_some());
        let fitted = self.of_steps.iter().map(|(rmse, _)| Some(*rmse));
        let fitted: Vec<Option<f64>> = fitted.chain([Some(self.floor)]).collect();
        let scored = self.of_steps.iter().map(|(_, test)| *test);
        // The same number of decimals for both columns, so that they are easy to compare.
        let all: Vec<Option<f64>> = fitted.iter().copied().chain(scored).collect();
        let numbers = numbers::column(&all);
        let (fitted_text, scored_text) = numbers.split_at(fitted.len());
        let worst = self
            .of_steps
            .iter()
            .map(|(rmse, _)| *rmse)
            .fold(0.0, f64::max);

        let mut heading = vec![String::new(), look.faint("fitted data")];
        let mut sides = vec![Side::Left, Side::Right];
        if held_out {
            heading.push(look.faint("held-out data"));
            sides.push(Side::Right);
        }
        sides.push(Side::Left);
        let mut rows = vec![heading];
        for (index, (step, (rmse, test))) in diagnosis.steps.iter().zip(&self.of_steps).enumerate()
        {
            let mut row = vec![
                step_name(diagnosis, step),
                with_unit(&fitted_text[index], self.unit),
            ];
            if held_out {
                row.push(match test {
                    Some(_) => with_unit(&scored_text[index], self.unit),
                    None => "-".to_string(),
                });
            }
            row.push(bar(*rmse, worst));
            rows.push(row);
        }
        if self.floor_known {
            let mut row = vec![
                look.faint("noise floor"),
                look.faint(with_unit(&fitted_text[self.of_steps.len()], self.unit)),
            ];
            if held_out {
                row.push(String::new());
            }
            row.push(look.faint(bar(self.floor, worst)));
            rows.push(row);
        }
        let mut text = format!("{}\n", look.heading(self.title));
        text += &table_text(&sides, &rows);
        text
    }
}

/// Parts of the error on held-out data, for the first and the last model.
fn held_out_errors(diagnosis: &Diagnosis, look: Look) -> String {
    let last = diagnosis.steps.len().saturating_sub(1);
    let mut text = String::new();
    for (index, step) in diagnosis.steps.iter().enumerate() {
        if index > 0 && index < last {
            continue;
        }
        let of = if last > 0 {
            format!("{}, ", model_name(diagnosis, step))
        } else {
            String::new()
        };
        for error in findings::held_out_errors(diagnosis, step) {
            text += &look.paragraph("  ", &format!("{of}{error}"));
        }
    }
    text
}

/// A bar whose length is the value's share of the largest, to an eighth of a character.
fn bar(value: f64, largest: f64) -> String {
    if !(value.is_finite() && largest > 0.0) {
        return String::new();
    }
    let eighths = ((value / largest).clamp(0.0, 1.0) * (8 * BAR) as f64).round() as usize;
    let rest = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"][eighths % 8];
    "█".repeat(eighths / 8) + rest
}
