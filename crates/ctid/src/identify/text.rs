//! What `ctid identify` prints.

mod facts;

use linear_identification::{Identification, Order, deviation};

pub(crate) use self::facts::{condition, facts, refined_facts};
use crate::csv_text::header;
use crate::look::{Look, Side, table_text};
use crate::numbers;
use crate::plot::{self, Axis};
use crate::sentences;

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
    text += &in_loop(found, look);
    text += &refined(found, look);
    text += &drift(found, look);
    text += &error(found, look);
    for warning in sentences::of_identification(found) {
        text += &look.warning("note: ");
        text += look.paragraph("      ", &warning).trim_start();
    }
    text
}

/// The equation.
pub(crate) fn model(found: &Identification) -> String {
    let sum = |letter: char, from: usize, to: usize, behind: &str| {
        let term = |i: usize| match i {
            0 => format!("{letter}0{behind}"),
            1 => format!("{letter}1{behind} s"),
            i => format!("{letter}{i}{behind} s^{i}"),
        };
        (from..=to).map(term).collect::<Vec<_>>().join(" + ")
    };
    let Order { n, m } = found.order;
    if let Some(refined) = &found.refined {
        let a = match (refined.integrator, n) {
            (true, 1) => "s".to_owned(),
            (true, n) => format!("(s + {})", sum('a', 2, n, "")),
            (false, n) => format!("(1 + {})", sum('a', 1, n, "")),
        };
        let inputs = refined.delays.iter().enumerate().map(|(j, delay)| {
            let (behind, signal) = match j {
                0 => (String::new(), "u".to_owned()),
                j => (format!("_{}", j + 1), format!("u_{}", j + 1)),
            };
            let late = if *delay > 0.0 {
                format!("(t - delay{behind})")
            } else {
                String::new()
            };
            format!("({}) {signal}{late}", sum('b', 0, m, &behind))
        });
        let inputs = inputs.collect::<Vec<_>>().join(" + ");
        return format!("{a} y = {inputs} + offset");
    }
    let (a, b) = (sum('a', 1, n, ""), sum('b', 0, m, ""));
    match &found.in_loop {
        None => format!("(1 + {a}) y = ({b}) u + offset"),
        Some(_) => format!("(1 + {a}) y = ({b}) u, y and u as deviations"),
    }
}

fn overlay(found: &Identification, look: Look) -> String {
    let shown = &found.shown;
    format!(
        "{}\n{}\n",
        header(&look.heading("Measured and simulated"), &shown.output.unit),
        plot::overlay(
            &shown.output.values,
            &shown.simulated,
            Axis::Times(&shown.time),
            look
        )
    )
}

fn parameters(found: &Identification, look: Look) -> String {
    let (title, last) = match &found.trajectory {
        Some(_) => ("Parameters at the end of the record", "over the record"),
        None => ("Parameters", ""),
    };
    let heading = ["parameter", "value", "std. error", "", last];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    for (i, parameter) in found.parameters.iter().enumerate() {
        let (value, error) = numbers::value_and_error(parameter.value, parameter.std_error);
        let values = found.trajectory.as_ref().and_then(|t| t.values.get(i));
        let range = values.map(|values| {
            let (low, high) = plot::limits([settled(values)]);
            let digits = |value| numbers::significant(value, 4);
            format!("{} .. {}", digits(low), digits(high))
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
    let mut text = format!("{}\n", look.heading(title));
    text += &table_text(&sides, &rows);
    let note = match (&found.settings, &found.trajectory) {
        (Some(settings), _) => format!(
            "(memory {}, filters of {} 1/s, started from a time constant of {}; the last column is of the second half)",
            numbers::duration(settings.memory),
            numbers::significant(settings.bandwidth, 3),
            numbers::duration(settings.first_order),
        ),
        (None, Some(_)) => {
            "(the last column is of the second half; standard errors assume a white residual)"
                .to_owned()
        }
        (None, None) => return text,
    };
    text += &look.faint(look.paragraph("  ", &note).trim_end());
    text.push('\n');
    text
}

/// The second half, where the start has no influence.
fn settled(values: &[f64]) -> &[f64] {
    values.get(values.len() / 2..).unwrap_or_default()
}

fn dynamics(found: &Identification) -> String {
    let integrates = found.refined.as_ref().is_some_and(|r| r.integrator);
    let mut parts: Vec<String> = integrates
        .then(|| "integrator".to_owned())
        .into_iter()
        .collect();
    let constants = found.time_constants.iter();
    parts.extend(constants.map(|t| format!("time constant {} s", numbers::significant(*t, 4))));
    parts.extend(found.oscillations.iter().map(|pair| {
        format!(
            "period {} s with damping {}",
            numbers::significant(pair.period, 4),
            numbers::significant(pair.damping, 2)
        )
    }));
    format!("  {}\n", parts.join(", "))
}

fn drift(found: &Identification, look: Look) -> String {
    let Some(drift) = &found.drift else {
        return String::new();
    };
    let (Some(low), Some(high)) = (drift.level.first(), drift.level.last()) else {
        return String::new();
    };
    let unit = &found.shown.output.unit;
    let heading = [
        "",
        &format!("near {} {unit}", numbers::significant(*low, 3)),
        &format!("near {} {unit}", numbers::significant(*high, 3)),
        "",
        "apart by",
    ];
    let mut rows = vec![heading.map(|name| look.faint(name.trim_end())).to_vec()];
    let time_constant = time_constant_name(found);
    let gain_unit = found
        .parameters
        .get(found.order.n)
        .map_or("", |b0| &b0.unit);
    for (name, unit, over_level) in [
        ("gain b0", gain_unit, &drift.gain),
        (time_constant, "s", &drift.time_constant),
    ] {
        let Some(ends) = over_level.ends() else {
            continue;
        };
        let [low, high] = ends.map(|(value, error)| numbers::with_error(value, Some(error)));
        let apart = format!(
            "{} std. errors",
            numbers::decimals(over_level.difference.abs(), 1)
        );
        let apart = if over_level.moves() {
            look.warning(apart)
        } else {
            apart
        };
        rows.push(vec![name.to_owned(), low, high, unit.to_owned(), apart]);
    }
    let sides = [Side::Left, Side::Right, Side::Right, Side::Left, Side::Left];
    let mut text = format!("{}\n", look.heading("Drift with the level"));
    text += &table_text(&sides, &rows);
    text += &look.paragraph("  ", &drift_verdict(found));
    text.push('\n');
    text
}

/// Name of `a_1`.
pub(crate) fn time_constant_name(found: &Identification) -> &'static str {
    match found.order.n {
        1 => "time constant a1",
        _ => "sum of the time constants a1",
    }
}

/// Sentence about the drift; empty if it is not known.
pub(crate) fn drift_verdict(found: &Identification) -> String {
    let Some(drift) = &found.drift else {
        return String::new();
    };
    if drift.moves() {
        return "The estimates change with the level by more than chance: the process is not linear over this range, or not of this order."
            .to_owned();
    }
    if drift.tells() {
        return "The estimates do not change with the level beyond their standard errors; a shorter --memory follows faster changes with larger standard errors."
            .to_owned();
    }
    let percent = |part: f64| numbers::significant(100.0 * part, 2);
    format!(
        "This record is too short to tell whether the estimates change with the level: the memory is {} % of it, and the level within the memory \
         covers {} % of the output's range; record longer, or try a shorter --memory.",
        percent(drift.memory_part),
        percent(drift.level_part)
    )
}

fn error(found: &Identification, look: Look) -> String {
    let unit = match found.shown.output.unit.as_str() {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let deviation = deviation(&found.shown.output);
    let line = format!(
        "{}{unit} root mean square, of an output that deviates by {}{unit}: fit {} %",
        numbers::significant(found.simulation_rmse, 3),
        numbers::significant(deviation, 3),
        numbers::significant(found.fit_percent, 3),
    );
    let title = "Simulation error of the final model";
    let mut text = format!("{}\n", look.heading(title));
    text += &look.paragraph("  ", &line);
    let several = found.refined.as_ref().is_some_and(|r| r.records.len() > 1);
    let note = match found.in_loop.as_ref().map(|looped| looped.r.is_empty()) {
        None if several => {
            "(of all records together, of which the first is drawn; the model runs on the input alone, from a fitted initial state)"
        }
        None => {
            "(the model runs on the input alone, from a fitted initial state; it is not a prediction error)"
        }
        Some(true) => {
            "(the model runs on the input alone, from rest; it is not a prediction error)"
        }
        Some(false) => {
            "(the model's loop runs on the reference alone, from rest; it is not a prediction error)"
        }
    };
    text + &look.faint(look.paragraph("  ", note).trim_end()) + "\n\n"
}

fn in_loop(found: &Identification, look: Look) -> String {
    let Some(in_loop) = &found.in_loop else {
        return String::new();
    };
    let mut text = format!("{}\n", look.heading("The loop, and how it was estimated"));
    for (name, sentence) in facts(found, in_loop) {
        text += &look.paragraph("  - ", &format!("{name}: {sentence}"));
    }
    text.push('\n');
    text
}

fn refined(found: &Identification, look: Look) -> String {
    let Some(refined) = &found.refined else {
        return String::new();
    };
    let mut text = format!("{}\n", look.heading("Instruments and noise"));
    for (name, sentence) in refined_facts(found, refined) {
        text += &look.paragraph("  - ", &format!("{name}: {sentence}"));
    }
    text.push('\n');
    text
}
