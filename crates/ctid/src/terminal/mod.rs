//! Text output for the terminal; it is derived from the [`Diagnosis`] that `--json` writes.

mod curves;
mod errors;
mod ranking;

use effect_search::{OutputStep, ResidualTests};
use missing_effect::{Diagnosis, Shown, Step, Verdict};

pub(crate) use self::curves::{overlay, residuals};
pub(crate) use self::errors::{trail, without_50};
pub(crate) use self::ranking::ranking;
use crate::findings::{self, Reader};
use crate::look::{Look, Side, table_text};
use crate::numbers;
use crate::plot;
use crate::sentences::{self, interval, placed, with_unit};

/// Number of findings about where a model fails.
pub(crate) const FAILURES: usize = 5;
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
        if diagnosis.verdict == Verdict::Partial && last.added.is_some() {
            text += &failures(diagnosis, last, look);
        }
    }
    text + &groups(diagnosis, look) + &findings(diagnosis, look)
}

/// Analysed plant and records.
pub(crate) fn header(diagnosis: &Diagnosis, look: Look) -> String {
    // The readings of all outputs are counted.
    let several = findings::several(diagnosis);
    let count = if several { "readings" } else { "samples" };
    let heading = ["record", "", count, "length", "input", "output"];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    for record in &diagnosis.records {
        let mut row = vec![
            record.name.clone(),
            if record.held_out {
                "held out"
            } else {
                "fitted"
            }
            .to_string(),
            record.samples().to_string(),
            numbers::duration(length(record)),
            range(
                record.inputs.first().map_or(&[], |input| &input.values),
                &diagnosis.input_unit,
            ),
        ];
        // Further outputs are listed below the first.
        for (name, output) in diagnosis.outputs.iter().zip(&record.outputs) {
            let range = range(output, &diagnosis.output_unit);
            row.resize(heading.len() - 1, String::new());
            row.push(if several {
                format!("{name} {range}")
            } else {
                range
            });
            rows.push(std::mem::take(&mut row));
        }
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
    text += &table_text(&sides, &rows);
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
    interval(plot::limits([values]), " .. ", unit)
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

/// The complete model of a step, in few words.
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

/// Sentences about where a model fails, output by output.
pub(crate) fn failures(diagnosis: &Diagnosis, step: &Step, look: Look) -> String {
    let outputs = step.outputs.iter();
    outputs
        .enumerate()
        .map(|(at, output)| failures_of(diagnosis, step, (at, output), look))
        .collect()
}

fn failures_of(
    diagnosis: &Diagnosis,
    step: &Step,
    (at, output): (usize, &OutputStep),
    look: Look,
) -> String {
    let name = step_name(diagnosis, step);
    let title = match diagnosis.verdict {
        Verdict::Adequate if !findings::is_comparison(diagnosis) => {
            format!("Tests of the residual of {name}")
        }
        _ => format!("Where {name} fails"),
    };
    let title = if findings::several(diagnosis) {
        format!("{title}: {}", output.name)
    } else {
        title
    };
    let mut text = format!("{}\n", look.heading(&title));
    let said = sentences::of_failures(diagnosis, output, at);
    for sentence in said.iter().take(FAILURES) {
        text += &look.paragraph("  - ", sentence);
    }
    text += &look.paragraph("  - ", &residual_tests(&output.tests));
    text.push('\n');
    text
}

/// Sentences about the residual tests.
pub(crate) fn residual_tests(tests: &ResidualTests) -> String {
    let p = |p: f64| {
        if p < 0.001 {
            "p < 0.001".to_string()
        } else {
            format!("p = {}", numbers::significant(p, 2))
        }
    };
    let input = match tests.input_p {
        value if value.is_nan() => "the residual was not tested for the input".to_string(),
        value if value < 0.01 => format!("the residual depends on the input ({})", p(value)),
        value => format!(
            "the residual has no significant linear dependence on the input ({})",
            p(value)
        ),
    };
    let white = match tests.whiteness_p {
        value if value.is_nan() => "its whiteness was not tested".to_string(),
        value if value < 0.01 => format!("it is not white noise (Ljung-Box {})", p(value)),
        value => format!("it is consistent with white noise (Ljung-Box {})", p(value)),
    };
    format!("{input}; {white}")
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
            match sentences::of_prior(parameter) {
                Some(words) => format!("{} ({words})", parameter.unit),
                None => parameter.unit.clone(),
            },
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
    text += &table_text(&[Side::Left, Side::Right, Side::Left, Side::Left], &rows);
    if step.starts > 1 {
        text += &format!(
            "  {}\n",
            look.faint(match step.starts_agree {
                0 => format!(
                    "none of {} starts around it reached an equally low minimum",
                    step.starts
                ),
                agree => format!("{agree} of {} starts ended in this minimum", step.starts),
            })
        );
    }
    text.push('\n');
    text
}

/// Effects that these data cannot distinguish.
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
    let mut text = String::new();
    if !lines.is_empty() {
        let heading = look.heading("Effects that these data do not distinguish");
        text += &format!("{heading}\n{lines}\n");
    }
    let places = findings::places(diagnosis);
    if !places.is_empty() {
        let heading = look.heading("Where it acts, with relative likelihood");
        text += &format!("{heading}\n");
        for place in places {
            text += &look.paragraph("  - ", &place);
        }
        text.push('\n');
    }
    text + &rankings(diagnosis, look)
}

/// The two rankings side by side where they disagree.
fn rankings(diagnosis: &Diagnosis, look: Look) -> String {
    let ranked = findings::rankings(diagnosis);
    if ranked.is_empty() {
        return String::new();
    }
    let [white, prewhitened] = findings::RANKINGS_HEADS.map(|head| look.faint(head));
    let mut rows = vec![vec![String::new(), white, prewhitened]];
    rows.extend(ranked.into_iter().map(|(rank, a, b)| vec![rank, a, b]));
    let mut text = format!("{}\n", look.heading("Two rankings"));
    text += &look.paragraph("  ", findings::RANKINGS_DISAGREE);
    text += &table_text(&[Side::Right, Side::Left, Side::Left], &rows);
    text.push('\n');
    text
}

/// The verdict and its sentences.
pub(crate) fn findings(diagnosis: &Diagnosis, look: Look) -> String {
    let headline = match diagnosis.verdict {
        _ if findings::is_comparison(diagnosis) => {
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
        Verdict::Partial => {
            let part = findings::partial_headline(diagnosis);
            look.warning(look.paragraph("", &part).trim_end())
        }
        Verdict::Unexplained => {
            look.warning("The residual is not noise, and no effect of the catalogue explains it")
        }
    };
    let mut text = format!("{headline}\n");
    for sentence in sentences::of_diagnosis(diagnosis) {
        text += &look.paragraph("  ", &sentence);
    }
    for sentence in findings::effort(&diagnosis.effort, Reader::Commands) {
        text += &look.paragraph("  ", &sentence);
    }
    text
}

#[cfg(test)]
mod tests;
