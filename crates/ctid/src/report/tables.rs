//! The tables of the report.

use missing_effect::{Diagnosis, HeldOutError, Parameter, Step, Unknown};

use super::data::step_label;
use super::text::{code, escape, significant, unit, with_error};
use crate::findings;
use crate::numbers::duration;

/// What was looked at: plant, records, noise floor.
pub(super) fn facts(diagnosis: &Diagnosis) -> String {
    let several = findings::several(diagnosis);
    let mut facts = vec![("Model", escape(&diagnosis.plant))];
    if !diagnosis.known_effects.is_empty() {
        let known = escape(&diagnosis.known_effects.join(", "));
        facts.push(("Already in the model", known));
    }
    for record in &diagnosis.records {
        let role = if record.held_out {
            "Held out"
        } else {
            "Fitted to"
        };
        // The readings of all outputs are counted.
        let count = if several { "readings" } else { "samples" };
        let mut text = format!("{}: {} {count}", escape(&record.name), record.samples());
        if let (Some(first), Some(last)) = (record.time.first(), record.time.last()) {
            text.push_str(&format!(" over {}", duration(last - first)));
        }
        facts.push((role, text));
    }
    let floors = diagnosis.noise.iter().enumerate();
    for (k, floor) in floors.filter(|(_, noise)| noise.level.is_finite()) {
        let output = unit(diagnosis.unit_of(k));
        let level = significant(floor.level, 2);
        let source = escape(&floor.source);
        let of = if several {
            format!("{}: ", escape(&floor.output))
        } else {
            String::new()
        };
        facts.push((
            "Noise floor",
            format!("{of}{level} {output}, from: {source}"),
        ));
    }
    let items: String = facts
        .iter()
        .map(|(name, text)| format!("<div><dt>{name}</dt><dd>{text}</dd></div>\n"))
        .collect();
    format!("<dl class=\"facts\">\n{items}</dl>\n")
}

/// The effects that were added, each with all that cannot be told apart from it.
pub(super) fn groups(diagnosis: &Diagnosis) -> String {
    let items: String = diagnosis
        .groups
        .iter()
        .zip(&diagnosis.effects)
        .enumerate()
        .map(|(k, (group, effect))| {
            let others: Vec<String> = group
                .iter()
                .filter(|other| *other != effect)
                .map(|other| code(other))
                .collect();
            let finding = if others.is_empty() {
                "told apart from every other effect".to_owned()
            } else {
                format!("these data cannot tell it from {}", others.join(", "))
            };
            let tank = findings::tank(diagnosis, k)
                .map_or(String::new(), |tank| format!(" ({})", escape(tank)));
            let doubt = if diagnosis.in_doubt.get(k) == Some(&true) {
                "; in doubt: its size ends at the edge of what is plausible"
            } else {
                ""
            };
            let places = match diagnosis.places.get(k).map(Vec::as_slice) {
                Some(places @ [_, _, ..]) => {
                    let scores = escape(&findings::place_scores(diagnosis.domain(), places));
                    format!("; where it acts, with relative likelihood: {scores}")
                }
                _ => String::new(),
            };
            format!(
                "<li>{}{tank}: {finding}{doubt}{places}</li>\n",
                code(effect)
            )
        })
        .collect();
    if items.is_empty() {
        return String::new();
    }
    format!("<p>Added to the model, in this order:</p>\n<ol class=\"groups\">\n{items}</ol>\n")
}

/// The acceptance test in numbers, and why the effects are not the whole answer.
pub(super) fn acceptance(diagnosis: &Diagnosis) -> String {
    let Some(test) = &diagnosis.acceptance else {
        return String::new();
    };
    let rows: String = findings::acceptance_rows(test, &diagnosis.output_unit)
        .iter()
        .map(|(name, value, required)| {
            format!(
                "<tr><th scope=\"row\">{name}</th><td class=\"number\">{}</td><td>{}</td></tr>\n",
                escape(value),
                escape(required)
            )
        })
        .collect();
    let reasons = super::items(&test.reasons);
    let reasons = if reasons.is_empty() {
        reasons
    } else {
        let why = if diagnosis.effects.is_empty() {
            "Why they were refused:"
        } else {
            "Why they are a part of the answer only:"
        };
        format!("<p>{why}</p>\n<ul>{reasons}</ul>\n")
    };
    table(
        &escape(&findings::acceptance_title(diagnosis, test)),
        "<tr><th scope=\"col\">Measure</th><th scope=\"col\" class=\"number\">Found</th><th scope=\"col\">Required</th></tr>",
        &rows,
        "The squared error above the floor is the mean squared simulation error less the variance of the noise. Effects that leave \
         noise alone need no share of it.",
    ) + &reasons
}

/// The two rankings side by side where they disagree.
pub(super) fn rankings(diagnosis: &Diagnosis) -> String {
    let rows: String = findings::rankings(diagnosis)
        .iter()
        .map(|(rank, white, prewhitened)| {
            format!(
                "<tr><td class=\"number\">{rank}</td><td>{}</td><td>{}</td></tr>\n",
                code(white),
                code(prewhitened)
            )
        })
        .collect();
    if rows.is_empty() {
        return rows;
    }
    let [white, prewhitened] = findings::RANKINGS_HEADS;
    table(
        "Two rankings",
        &format!(
            "<tr><th scope=\"col\" class=\"number\">#</th><th scope=\"col\">{white}</th><th scope=\"col\">{prewhitened}</th></tr>"
        ),
        &rows,
        findings::RANKINGS_DISAGREE,
    )
}

/// How much of a missing term each variable predicts.
pub(super) fn shares(unknown: &Unknown) -> String {
    let rows: String = unknown
        .shares
        .iter()
        .map(|share| {
            let error = if share.std_error.is_finite() {
                format!(" ± {:.0}", (100.0 * share.std_error).max(1.0))
            } else {
                String::new()
            };
            format!(
                "<tr><td>{}</td><td>{}</td><td class=\"number\">{:.0}{error} %</td></tr>\n",
                escape(&share.place),
                super::variable(share.variable),
                100.0 * share.share.clamp(-9.99, 1.0),
            )
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    table(
        "What it depends on",
        "<tr><th>place</th><th>variable</th><th class=\"number\">predicted</th></tr>",
        &rows,
        "How much of it a curve in one variable predicts on parts of the data that were left out of its fit. \
         What depends on a variable alone is predicted nearly in full; where none is, it is a function of time, as far as \
         these data tell.",
    )
}

const SCORED: &str = "Simulation error: root mean square on the fitted data after the refit.";
const SIGNATURES: &str = " Visible part: how much of the effect's signature the fitted parameters cannot imitate. Visible from: an effect of a smaller \
     size would have stayed hidden in these data.";

/// The catalogue, best effect first.
pub(super) fn scores(diagnosis: &Diagnosis) -> String {
    let error_unit = if findings::several(diagnosis) {
        findings::TIMES_THE_NOISE.to_owned()
    } else {
        unit(&diagnosis.output_unit)
    };
    // A model of its user's own is scored without a signature of each effect.
    let visible = diagnosis.scores.iter().any(|s| s.visibility.is_finite());
    let of_signature = |cell: String| if visible { cell } else { String::new() };
    let rows: String = diagnosis
        .scores
        .iter()
        .enumerate()
        .map(|(k, score)| {
            let place = score
                .place
                .as_ref()
                .map_or(String::new(), |place| format!(" ({})", escape(place)));
            let class = if findings::is_added(diagnosis, score) {
                " class=\"added\""
            } else {
                ""
            };
            let size_unit = score.size.as_ref().map_or("", |size| size.unit.as_str());
            let smallest = score.smallest_visible.map_or("–".to_owned(), |smallest| {
                format!("{} {}", significant(smallest, 2), unit(size_unit))
            });
            format!(
                "<tr{class}><td class=\"number\">{}</td><th scope=\"row\">{}{place}</th>\
                 <td class=\"number\">{}</td><td class=\"number\">{}</td>{}\
                 <td class=\"number\">{}</td>{}</tr>\n",
                k + 1,
                code(&score.effect),
                one_decimal(score.bic_gain),
                significant(findings::score_error(diagnosis, score).0, 3),
                of_signature(format!(
                    "<td class=\"number\">{}</td>",
                    percent(score.visibility)
                )),
                size(score.size.as_ref()),
                of_signature(format!("<td class=\"number\">{smallest}</td>")),
            )
        })
        .collect();
    table(
        "The catalogue, best first",
        &format!(
            "<tr><th scope=\"col\" class=\"number\">#</th><th scope=\"col\">Effect</th>\
             <th scope=\"col\" class=\"number\">Fall of BIC</th>\
             <th scope=\"col\" class=\"number\">Simulation error [{error_unit}]</th>\
             {}\
             <th scope=\"col\" class=\"number\">Size ± standard error</th>{}</tr>",
            of_signature("<th scope=\"col\" class=\"number\">Visible part</th>".to_owned()),
            of_signature("<th scope=\"col\" class=\"number\">Visible from</th>".to_owned()),
        ),
        &rows,
        &(SCORED.to_owned() + &of_signature(SIGNATURES.to_owned())),
    )
}

/// The parameters of every step side by side, with what the fit reached.
pub(super) fn parameters(diagnosis: &Diagnosis) -> String {
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
            "The last model first. Estimate ± standard error; * : the data do not determine it, or it sits at a bound. \
             A minimum that one start alone has reached may not be the best one.{held_out}"
        ),
    )
}

/// The rows of the simulation error of an output; its name stands before them where there are several.
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

/// Every parameter once, with its unit, in the order of the last step, which has the most.
fn names(steps: &[Step]) -> Vec<(&str, &str)> {
    let mut names: Vec<(&str, &str)> = Vec::new();
    for parameter in steps.iter().rev().flat_map(|step| &step.parameters) {
        if !names.iter().any(|(name, _)| *name == parameter.name) {
            names.push((&parameter.name, &parameter.unit));
        }
    }
    names
}

/// The last model first, so that it is seen however many there are; then the others in their order.
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
    match parameter.prior_words() {
        Some(words) => format!("{value}<br><small>{}</small>", escape(&words)),
        None => value,
    }
}

fn size(size: Option<&Parameter>) -> String {
    size.map_or("–".to_owned(), |size| {
        format!(
            "{} {}",
            with_error(size.value, size.std_error),
            unit(&size.unit)
        )
    })
}

fn one_decimal(value: f64) -> String {
    if value.is_finite() {
        format!("{value:.1}").replace('-', "−")
    } else {
        "–".to_owned()
    }
}

fn percent(part: f64) -> String {
    if part.is_finite() {
        format!("{} %", significant(100.0 * part, 2))
    } else {
        "–".to_owned()
    }
}

/// A table that scrolls inside its own box, also by the keyboard.
pub(super) fn table(name: &str, head: &str, rows: &str, caption: &str) -> String {
    format!(
        "<h3>{name}</h3>\n<div class=\"scroll\" role=\"region\" aria-label=\"{name}\" tabindex=\"0\">\n\
         <table><thead>{head}</thead>\n<tbody>{rows}</tbody></table>\n</div>\n\
         <p class=\"caption\">{caption}</p>\n"
    )
}
