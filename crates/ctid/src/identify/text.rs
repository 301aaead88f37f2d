//! What `ctid identify` prints.

use super::{Identification, rms};
use crate::look::{Look, Side, table};
use crate::numbers;
use crate::plot::{self, Curve, plot};

/// The whole of it.
#[must_use]
pub fn text(found: &Identification, look: Look) -> String {
    let title = format!(
        "{}: order {} by {}",
        found.record,
        found.order,
        found.method.id()
    );
    let mut text = format!("{}\n", look.heading(&title));
    text += &look.paragraph("  ", &model(found));
    text.push('\n');
    text += &overlay(found, look);
    text += &parameters(found, look);
    text += &dynamics(found);
    text.push('\n');
    text += &error(found, look);
    for warning in &found.warnings {
        text += &look.warning("note: ");
        text += look.paragraph("      ", warning).trim_start();
    }
    text
}

/// The equation.
pub(crate) fn model(found: &Identification) -> String {
    let sum = |letter: char, from: usize, to: usize| {
        let term = |i: usize| match i {
            0 => format!("{letter}0"),
            1 => format!("{letter}1 s"),
            i => format!("{letter}{i} s^{i}"),
        };
        (from..=to).map(term).collect::<Vec<_>>().join(" + ")
    };
    format!(
        "(1 + {}) y = ({}) u + offset",
        sum('a', 1, found.order.n),
        sum('b', 0, found.order.m)
    )
}

fn overlay(found: &Identification, look: Look) -> String {
    let shown = &found.shown;
    let curves = [
        Curve {
            values: &shown.output.values,
            colour: plot::MEASURED,
        },
        Curve {
            values: &shown.simulated,
            colour: plot::MODEL,
        },
    ];
    let limits = plot::limits([shown.output.values.as_slice(), &shown.simulated]);
    let (Some(first), Some(last)) = (shown.time.first(), shown.time.last()) else {
        return String::new();
    };
    format!(
        "{}{}\n{}\n",
        look.heading("Measured and simulated"),
        bracketed(&shown.output.unit),
        plot(&curves, (0.0, last - first), limits, 9, look)
    )
}

fn bracketed(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        format!(" [{unit}]")
    }
}

fn parameters(found: &Identification, look: Look) -> String {
    let heading = ["parameter", "value", "std. error", "", "over the record"];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    for (i, parameter) in found.parameters.iter().enumerate() {
        let (value, error) = numbers::value_and_error(parameter.value, parameter.std_error);
        let range = found.trajectory.as_ref().and_then(|trajectory| {
            let values = settled(trajectory.values.get(i)?);
            let (low, high) = plot::limits([values]);
            let digits = |value| numbers::significant(value, 4);
            Some(format!("{} .. {}", digits(low), digits(high)))
        });
        rows.push(vec![
            parameter.name.clone(),
            value,
            error.unwrap_or("not known".to_owned()),
            parameter.unit.clone(),
            range.unwrap_or_default(),
        ]);
    }
    let sides = [Side::Left, Side::Right, Side::Right, Side::Left, Side::Left];
    let mut text = format!("{}\n", look.heading("Parameters at the end of the record"));
    for line in table(&sides, &rows) {
        text += &format!("  {line}\n");
    }
    let note = format!(
        "(memory {}, filters of {} 1/s, started from a time constant of {}; the last column is of the second half)",
        numbers::duration(found.settings.memory),
        numbers::significant(found.settings.bandwidth, 3),
        numbers::duration(found.settings.first_order),
    );
    text += &look.faint(look.paragraph("  ", &note).trim_end());
    text.push('\n');
    text
}

/// The second half: the start is not the record's.
fn settled(values: &[f64]) -> &[f64] {
    values.get(values.len() / 2..).unwrap_or_default()
}

fn dynamics(found: &Identification) -> String {
    let mut parts: Vec<String> = found
        .time_constants
        .iter()
        .map(|t| format!("time constant {} s", numbers::significant(*t, 4)))
        .collect();
    parts.extend(found.oscillations.iter().map(|pair| {
        format!(
            "period {} s with damping {}",
            numbers::significant(pair.period, 4),
            numbers::significant(pair.damping, 2)
        )
    }));
    format!("  {}\n", parts.join(", "))
}

fn error(found: &Identification, look: Look) -> String {
    let unit = &found.shown.output.unit;
    let deviation = {
        let values = &found.shown.output.values;
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        rms(values.iter().map(|y| y - mean))
    };
    let line = format!(
        "{} {unit} root mean square, of an output that deviates by {} {unit}: fit {} %",
        numbers::significant(found.simulation_rmse, 3),
        numbers::significant(deviation, 3),
        numbers::significant(found.fit_percent, 3),
    );
    let title = "Simulation error of the final model";
    let mut text = format!("{}\n", look.heading(title));
    text += &look.paragraph("  ", &line);
    let note = "(the model runs on the input alone, from a fitted initial state; it is not a prediction error)";
    text + &look.faint(look.paragraph("  ", note).trim_end()) + "\n\n"
}
