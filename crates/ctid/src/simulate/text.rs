//! Text output of a simulation.

use super::{Simulated, SimulatedOutput, StateSource};
use crate::csv_text::header;
use crate::look::{Look, Side, table_text};
use crate::numbers;
use crate::plot::{self, Axis};

/// The whole of it.
pub(crate) fn said(simulated: &Simulated, look: Look) -> String {
    let model = [std::slice::from_ref(&simulated.model), &simulated.effects];
    let model = model.concat().join(" + ");
    let title = format!("{model} on the inputs of {}", simulated.inputs);
    let mut text = format!("{}\n", look.heading(&title));
    let values = match &simulated.fitted_to[..] {
        [] => "with the values of its text, which are taken as they are: no band without --fit"
            .to_string(),
        records => format!("fitted to {}", records.join(", ")),
    };
    text += &look.paragraph("  ", &values);
    text += &look.paragraph("  ", &states(simulated));
    text.push('\n');
    for output in &simulated.outputs {
        text += &drawn(output, simulated.length, look);
    }
    text += &format!("{}\n", look.heading("Simulated outputs"));
    let head = [
        "",
        "first",
        "last",
        "lowest",
        "highest",
        "95 % band, widest",
    ];
    let mut rows = vec![head.map(|name| look.faint(name)).to_vec()];
    for output in &simulated.outputs {
        let (low, high) = plot::limits([output.mean.as_slice()]);
        let number = |value: f64| numbers::significant(value, 4);
        let ends = [output.mean.first(), output.mean.last()];
        let [first, last] = ends.map(|end| number(end.copied().unwrap_or(f64::NAN)));
        let band = output.band.as_ref().map(|band| {
            let widest = |half: &[f64]| {
                numbers::significant(half.iter().fold(0.0, |m: f64, v| m.max(*v)), 2)
            };
            format!(
                "± {}, of a reading ± {}",
                widest(&band.output),
                widest(&band.reading)
            )
        });
        rows.push(vec![
            header(&output.name, &output.unit),
            first,
            last,
            number(low),
            number(high),
            band.unwrap_or_else(|| "none".to_string()),
        ]);
    }
    let sides = [
        Side::Left,
        Side::Right,
        Side::Right,
        Side::Right,
        Side::Right,
        Side::Left,
    ];
    text += &table_text(&sides, &rows);
    if !simulated.fitted_to.is_empty() {
        text += &format!("\n{}\n", look.heading("Parameters, with standard errors"));
        let rows: Vec<Vec<String>> = simulated.parameters.iter().map(parameter).collect();
        text += &table_text(&[Side::Left, Side::Right, Side::Left], &rows);
    }
    for warning in &simulated.warnings {
        text += &look.warning_paragraph(warning);
    }
    text
}

fn parameter((name, value, error): &(String, f64, Option<f64>)) -> Vec<String> {
    let (value, error) = numbers::value_and_error(*value, *error);
    let error = error.map_or("(known, at a bound, or not determined)".to_string(), |e| {
        format!("± {e}")
    });
    vec![name.clone(), value, error]
}

fn states(simulated: &Simulated) -> String {
    let each = simulated.states.iter();
    let each: Vec<String> = each
        .map(|(name, value)| format!("{name} = {}", numbers::significant(*value, 4)))
        .collect();
    let from = match simulated.states_from {
        StateSource::Readings => "fitted to the first readings",
        StateSource::Text => "from the model text",
        StateSource::Rest => "at rest under the first inputs",
    };
    match &each[..] {
        [] => "no states".to_string(),
        [one] => format!("initial state {from}: {one}"),
        several => format!("initial states {from}: {}", several.join(", ")),
    }
}

fn drawn(output: &SimulatedOutput, length: f64, look: Look) -> String {
    let is_measured = output.measured.iter().any(|y| !y.is_nan());
    let (what, measured) = match is_measured {
        true => ("measured and model", output.measured.as_slice()),
        false => ("model", &[][..]),
    };
    format!(
        "{} {what}\n{}\n",
        look.heading(&format!("{}:", header(&output.name, &output.unit))),
        plot::overlay(measured, &output.mean, Axis::Even(0.0, length), look)
    )
}
