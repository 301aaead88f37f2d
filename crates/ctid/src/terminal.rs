//! What a person reads in the terminal; all of it is derived from the [`Diagnosis`] that `--json` writes.

use console::Style;
use missing_effect::{Diagnosis, Parameter, ResidualTests, Score, Shown, Step, Verdict};

use crate::findings;
use crate::look::{Look, Side, table};
use crate::numbers;
use crate::plot::{self, Curve, plot};

/// How many effects the ranking shows.
const RANKED: usize = 8;
/// How many findings say where a model fails.
const FAILURES: usize = 5;
const BAR: usize = 20;

/// What `ctid compare` prints.
#[must_use]
pub fn comparison(diagnosis: &Diagnosis, look: Look) -> String {
    let mut text = header(diagnosis, look);
    for step in &diagnosis.steps {
        text += &overlay(diagnosis, step, look);
        text += &residuals(diagnosis, &[step], look);
        text += &trail(diagnosis, look);
        text += &parameters(diagnosis, step, look);
        text += &failures(diagnosis, step, look);
    }
    text + &findings(diagnosis, look)
}

/// What `ctid diagnose` prints.
#[must_use]
pub fn diagnosis(diagnosis: &Diagnosis, look: Look) -> String {
    let mut text = header(diagnosis, look);
    if let Some(first) = diagnosis.steps.first() {
        text += &failures(diagnosis, first, look);
    }
    text += &ranking(diagnosis, look);
    text += &trail(diagnosis, look);
    if let (Some(first), Some(last)) = (diagnosis.steps.first(), diagnosis.steps.last()) {
        let shown = if diagnosis.steps.len() > 1 {
            vec![first, last]
        } else {
            vec![first]
        };
        text += &residuals(diagnosis, &shown, look);
        text += &parameters(diagnosis, last, look);
    }
    text + &groups(diagnosis, look) + &findings(diagnosis, look)
}

/// What was looked at.
pub(crate) fn header(diagnosis: &Diagnosis, look: Look) -> String {
    let heading = ["record", "", "samples", "length", "input", "output"];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    for record in &diagnosis.records {
        rows.push(vec![
            record.name.clone(),
            if record.held_out {
                "held out"
            } else {
                "fitted"
            }
            .to_string(),
            record.time.len().to_string(),
            numbers::duration(length(record)),
            range(&record.input, &diagnosis.input_unit),
            range(&record.output, &diagnosis.output_unit),
        ]);
    }
    let sides = [
        Side::Left,
        Side::Left,
        Side::Right,
        Side::Right,
        Side::Left,
        Side::Left,
    ];
    let mut text = format!("{}\n", look.heading(&base_name(diagnosis)));
    for line in table(&sides, &rows) {
        text += &format!("  {line}\n");
    }
    text.push('\n');
    text
}

fn length(record: &Shown) -> f64 {
    match (record.time.first(), record.time.last()) {
        (Some(first), Some(last)) => last - first,
        _ => 0.0,
    }
}

fn range(values: &[f64], unit: &str) -> String {
    let (low, high) = plot::limits([values]);
    let text = format!(
        "{} .. {} {unit}",
        numbers::significant(low, 3),
        numbers::significant(high, 3)
    );
    text.trim_end().to_string()
}

/// The plant with the effects that the model file already has.
fn base_name(diagnosis: &Diagnosis) -> String {
    let mut parts = vec![diagnosis.plant.as_str()];
    parts.extend(diagnosis.known_effects.iter().map(String::as_str));
    parts.join(" + ")
}

fn step_name(diagnosis: &Diagnosis, step: &Step) -> String {
    match &step.added {
        None => base_name(diagnosis),
        Some(effect) => format!("+ {}", placed(effect, step.place.as_deref())),
    }
}

/// The whole model of a step, in few words.
fn model_name(diagnosis: &Diagnosis, step: &Step) -> String {
    let added = diagnosis
        .steps
        .iter()
        .position(|other| std::ptr::eq(other, step));
    match added {
        Some(count @ 2..) => format!("with {count} effects added"),
        _ => step_name(diagnosis, step),
    }
}

fn placed(effect: &str, place: Option<&str>) -> String {
    match place {
        Some(place) => format!("{effect} ({place})"),
        None => effect.to_string(),
    }
}

fn with_unit(number: &str, unit: &str) -> String {
    format!("{number} {unit}").trim_end().to_string()
}

/// The error from step to step.
pub(crate) fn trail(diagnosis: &Diagnosis, look: Look) -> String {
    let steps = &diagnosis.steps;
    let unit = &diagnosis.output_unit;
    let held_out = steps.iter().any(|step| step.rmse_test.is_some());
    let mut fitted: Vec<Option<f64>> = steps.iter().map(|step| Some(step.rmse)).collect();
    fitted.push(Some(diagnosis.noise_floor));
    let mut scored: Vec<Option<f64>> = steps.iter().map(|step| step.rmse_test).collect();
    scored.push(None);
    // One number of decimals for both, so that they can be compared at a glance.
    let numbers = numbers::column(&[fitted.clone(), scored].concat());
    let (fitted_text, scored_text) = numbers.split_at(fitted.len());
    let worst = steps.iter().map(|step| step.rmse).fold(0.0, f64::max);

    let mut heading = vec![String::new(), look.faint("fitted data")];
    let mut sides = vec![Side::Left, Side::Right];
    if held_out {
        heading.push(look.faint("held-out data"));
        sides.push(Side::Right);
    }
    sides.push(Side::Left);
    let mut rows = vec![heading];
    for (index, step) in steps.iter().enumerate() {
        let mut row = vec![
            step_name(diagnosis, step),
            with_unit(&fitted_text[index], unit),
        ];
        if held_out {
            row.push(match step.rmse_test {
                Some(_) => with_unit(&scored_text[index], unit),
                None => "-".to_string(),
            });
        }
        row.push(bar(step.rmse, worst));
        rows.push(row);
    }
    // One model's residual does not tell its noise from its faults.
    let floor_known = !compared(diagnosis);
    let mut floor = vec![
        look.faint("noise floor"),
        look.faint(with_unit(&fitted_text[steps.len()], unit)),
    ];
    if held_out {
        floor.push(String::new());
    }
    floor.push(look.faint(bar(diagnosis.noise_floor, worst)));
    if floor_known {
        rows.push(floor);
    }

    let mut text = format!("{}\n", look.heading("Simulation error, root mean square"));
    for line in table(&sides, &rows) {
        text += &format!("  {line}\n");
    }
    if floor_known && !diagnosis.noise.source.is_empty() {
        let source = format!("(noise floor: {})", diagnosis.noise.source);
        text += &look.faint(look.paragraph("  ", &source).trim_end());
        text.push('\n');
    }
    text.push('\n');
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

/// Where a model fails, in words.
pub(crate) fn failures(diagnosis: &Diagnosis, step: &Step, look: Look) -> String {
    let name = step_name(diagnosis, step);
    let title = match diagnosis.verdict {
        Verdict::Adequate if !compared(diagnosis) => {
            format!("What is left in the residual of {name}")
        }
        _ => format!("Where {name} fails"),
    };
    let mut text = format!("{}\n", look.heading(&title));
    for sentence in step.failures.sentences.iter().take(FAILURES) {
        text += &look.paragraph("  - ", sentence);
    }
    if step.failures.sentences.is_empty() {
        text += "  - nowhere in particular\n";
    }
    text += &look.paragraph("  - ", &residual_tests(&step.tests));
    text.push('\n');
    text
}

/// What the residual tests say.
fn residual_tests(tests: &ResidualTests) -> String {
    let p = |p: f64| {
        if p < 0.001 {
            "p < 0.001".to_string()
        } else {
            format!("p = {}", numbers::significant(p, 2))
        }
    };
    let input = match tests.input_p {
        value if value.is_nan() => "the input was not looked for in the residual".to_string(),
        value if value < 0.01 => format!("the input is still seen in the residual ({})", p(value)),
        value => format!(
            "no linear trace of the input is left in the residual ({})",
            p(value)
        ),
    };
    let white = match tests.whiteness_p {
        value if value.is_nan() => "its whiteness was not tested".to_string(),
        value if value < 0.01 => format!("it is not white noise (Ljung-Box {})", p(value)),
        value => format!(
            "it cannot be told from white noise (Ljung-Box {})",
            p(value)
        ),
    };
    format!("{input}; {white}")
}

/// The columns of the ranking, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ranked {
    Place,
    Effect,
    Gain,
    Error,
    Size,
    SizeAlone,
    Visible,
}

/// The single effects at the first step, best first.
pub(crate) fn ranking(diagnosis: &Diagnosis, look: Look) -> String {
    use Ranked::{Effect, Error, Gain, Place, Size, SizeAlone, Visible};
    if diagnosis.scores.is_empty() {
        return String::new();
    }
    // As much as the width takes. The verdict refers to what would have been visible: sizes go before it. What an effect does
    // to the error goes last.
    let variants: [&[Ranked]; 7] = [
        &[Place, Effect, Gain, Error, Size, Visible],
        &[Place, Effect, Gain, Error, SizeAlone, Visible],
        &[Place, Effect, Error, SizeAlone, Visible],
        &[Place, Effect, Gain, Error, Visible],
        &[Place, Effect, Error, Visible],
        &[Place, Effect, Error],
        &[Effect, Error],
    ];
    let fits = |lines: &Vec<String>| {
        lines
            .iter()
            .all(|line| console::measure_text_width(line) + 2 <= look.width)
    };
    let tables = variants.map(|columns| ranking_table(diagnosis, columns, look));
    let lines = tables
        .iter()
        .find(|lines| fits(lines))
        .unwrap_or(&tables[6]);

    let title = match diagnosis.verdict {
        Verdict::Adequate => "The catalogue, one effect at a time: none is called for",
        _ => "The catalogue, one effect at a time, refitted: simulation error on fitted data",
    };
    let mut text = format!("{}\n", look.heading(title));
    for line in lines {
        text += &format!("  {line}\n");
    }
    if diagnosis.scores.len() > RANKED {
        let more = format!("and {} more", diagnosis.scores.len() - RANKED);
        text += &format!("  {}\n", look.faint(more));
    }
    text.push('\n');
    text
}

fn ranking_table(diagnosis: &Diagnosis, columns: &[Ranked], look: Look) -> Vec<String> {
    let scores: Vec<&Score> = diagnosis.scores.iter().take(RANKED).collect();
    let errors: Vec<Option<f64>> = scores.iter().map(|score| Some(score.rmse)).collect();
    let errors = numbers::column(&errors);
    let heading = |column: &Ranked| match column {
        Ranked::Place => String::new(),
        Ranked::Effect => look.faint("effect"),
        Ranked::Gain => look.faint("BIC falls"),
        Ranked::Error => look.faint("error after"),
        Ranked::Size | Ranked::SizeAlone => look.faint("size found"),
        Ranked::Visible => look.faint("visible from"),
    };
    let mut rows = vec![columns.iter().map(heading).collect::<Vec<_>>()];
    for (index, score) in scores.iter().enumerate() {
        let size = |with_error: bool| {
            score
                .size
                .as_ref()
                .map_or(String::new(), |found| size(found, with_error))
        };
        let cell = |column: &Ranked| match column {
            Ranked::Place => (index + 1).to_string(),
            Ranked::Effect => {
                let name = placed(&score.effect, score.place.as_deref());
                if findings::is_added(diagnosis, score) {
                    look.good(name)
                } else {
                    name
                }
            }
            Ranked::Gain => numbers::whole(score.bic_gain),
            Ranked::Error => with_unit(&errors[index], &diagnosis.output_unit),
            Ranked::Size => size(true),
            Ranked::SizeAlone => size(false),
            Ranked::Visible => visible_from(score),
        };
        rows.push(columns.iter().map(cell).collect());
    }
    let sides: Vec<Side> = columns
        .iter()
        .map(|column| match column {
            Ranked::Place | Ranked::Gain | Ranked::Error => Side::Right,
            _ => Side::Left,
        })
        .collect();
    table(&sides, &rows)
}

/// `rim 21.30 ± 0.12 cm`, or without the error, to the digits that it leaves.
fn size(parameter: &Parameter, with_error: bool) -> String {
    let name = parameter.name.rsplit('.').next().unwrap_or_default();
    let (value, error) = numbers::value_and_error(parameter.value, parameter.std_error);
    let value = match error.filter(|_| with_error) {
        Some(error) => format!("{value} ± {error}"),
        None => value,
    };
    format!("{name} {}", with_unit(&value, &parameter.unit))
}

/// The smallest size that the data would have shown.
fn visible_from(score: &Score) -> String {
    match (score.smallest_visible, &score.size) {
        (Some(smallest), Some(size)) => with_unit(&numbers::significant(smallest, 2), &size.unit),
        (Some(smallest), None) => numbers::significant(smallest, 2),
        (None, _) => String::new(),
    }
}

/// The parameters of a step.
pub(crate) fn parameters(diagnosis: &Diagnosis, step: &Step, look: Look) -> String {
    let mut rows = Vec::new();
    for parameter in &step.parameters {
        let (value, error) = numbers::value_and_error(parameter.value, parameter.std_error);
        rows.push(vec![
            parameter.name.clone(),
            value,
            error.map_or(
                "(no error: at a bound, fixed, or not determined)".to_string(),
                |error| format!("± {error}"),
            ),
            parameter.unit.clone(),
        ]);
    }
    let model = match diagnosis.effects.as_slice() {
        [] => base_name(diagnosis),
        _ if step.added.is_none() => base_name(diagnosis),
        effects => format!("{} + {}", base_name(diagnosis), effects.join(" + ")),
    };
    let mut text = format!(
        "{}\n",
        look.heading(&format!("Parameters of {model}, with standard errors"))
    );
    for line in table(&[Side::Left, Side::Right, Side::Left, Side::Left], &rows) {
        text += &format!("  {line}\n");
    }
    if step.starts > 1 {
        text += &format!(
            "  {}\n",
            look.faint(format!(
                "{} of {} starts ended in this minimum",
                step.starts_agree, step.starts
            ))
        );
    }
    text.push('\n');
    text
}

/// What cannot be told apart on these data.
pub(crate) fn groups(diagnosis: &Diagnosis, look: Look) -> String {
    let mut lines = String::new();
    for (effect, group) in diagnosis.effects.iter().zip(&diagnosis.groups) {
        let others: Vec<&str> = group
            .iter()
            .map(String::as_str)
            .filter(|other| other != effect)
            .collect();
        if !others.is_empty() {
            lines += &look.paragraph(
                "  - ",
                &format!("{effect}: {} would fit as well", others.join(", ")),
            );
        }
    }
    if lines.is_empty() {
        return lines;
    }
    format!(
        "{}\n{lines}\n",
        look.heading("What these data cannot tell apart")
    )
}

/// Nothing was scored: a comparison.
fn compared(diagnosis: &Diagnosis) -> bool {
    diagnosis.scores.is_empty() && diagnosis.steps.len() < 2
}

/// The verdict and its sentences.
pub(crate) fn findings(diagnosis: &Diagnosis, look: Look) -> String {
    let headline = match diagnosis.verdict {
        _ if compared(diagnosis) => {
            look.strong("`ctid diagnose` says whether anything is missing, and what")
        }
        Verdict::Adequate => look.good("The model is adequate"),
        Verdict::Effect => {
            let missing = format!("Missing: {}", diagnosis.effects.join(", "));
            look.good(look.paragraph("", &missing).trim_end())
        }
        Verdict::Undecided => {
            look.warning("Something is missing, and more than one effect fits these data")
        }
        Verdict::Unexplained => {
            look.warning("What is left is not noise, and no effect of the catalogue explains it")
        }
    };
    let mut text = format!("{headline}\n");
    for sentence in &diagnosis.sentences {
        text += &look.paragraph("  ", sentence);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn a_narrow_ranking_keeps_what_would_have_been_visible() {
        let mut diagnosis = sample::two_tanks();
        diagnosis.scores[0].effect = "an_effect_whose_name_is_rather_long".to_owned();
        let seen = |width: usize| {
            let text = ranking(
                &diagnosis,
                Look {
                    width,
                    ..Look::plain()
                },
            );
            let widest = text.lines().skip(1).map(|line| line.chars().count()).max();
            assert!(widest <= Some(width), "{text}");
            ["size found", "visible from", "error after"].map(|column| text.contains(column))
        };
        assert_eq!(seen(200), [true, true, true]);
        assert_eq!(seen(80), [false, true, true]);
        assert_eq!(seen(65), [false, false, true]);
    }
}
