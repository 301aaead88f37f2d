//! The tables of the report.

mod steps;

use missing_effect::{Diagnosis, Parameter, Unknown};

pub(super) use self::steps::parameters;
use super::text::{code, escape, significant, unit, with_error};
use crate::findings;
use crate::numbers::duration;
use crate::sentences::{of_noise_source, of_rejections};

/// Analysed plant and records, and noise floor.
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
        // Number of readings of all outputs.
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
        let source = of_noise_source(floor);
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

/// The added effects, each with the effects that cannot be distinguished from it.
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
                "distinguished from every other effect".to_owned()
            } else {
                format!(
                    "these data do not distinguish it from {}",
                    others.join(", ")
                )
            };
            let tank = findings::tank(diagnosis, k)
                .map_or(String::new(), |tank| format!(" ({})", escape(tank)));
            let doubt = if diagnosis.in_doubt.get(k) == Some(&true) {
                "; uncertain: its size is at a bound of its plausible range"
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

/// The acceptance test in numbers, and the conditions that the effects do not meet.
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
    let reasons = super::items(of_rejections(test));
    let reasons = if reasons.is_empty() {
        reasons
    } else {
        format!("<p>Why they were refused:</p>\n<ul>{reasons}</ul>\n")
    };
    table(
        &escape(&findings::acceptance_title(diagnosis, test)),
        "<tr><th scope=\"col\">Measure</th><th scope=\"col\" class=\"number\">Found</th><th scope=\"col\">Required</th></tr>",
        &rows,
        "The squared error above the floor is the mean squared simulation error less the variance of the noise. Effects whose residual is noise need \
         no minimum share.",
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

/// Share of the unexplained error that each variable predicts.
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
         A function of one variable is predicted nearly in full. Where no variable \
         predicts it, it is a function of time, as far as these data show.",
    )
}

const SCORED: &str = "Simulation error: root mean square on the fitted data after the refit.";
const SIGNATURES: &str = " Visible part: share of the effect's signature that the fitted parameters cannot compensate for. Detectable: \
     minimum detectable size; a smaller effect would not be detected in these data.";

/// The catalogue, best effect first.
pub(super) fn scores(diagnosis: &Diagnosis) -> String {
    let error_unit = if findings::several(diagnosis) {
        findings::TIMES_THE_NOISE.to_owned()
    } else {
        unit(&diagnosis.output_unit)
    };
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
            of_signature("<th scope=\"col\" class=\"number\">Detectable</th>".to_owned()),
        ),
        &rows,
        &(SCORED.to_owned() + &of_signature(SIGNATURES.to_owned())),
    )
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

/// A table that scrolls inside its box, also by the keyboard.
pub(super) fn table(name: &str, head: &str, rows: &str, caption: &str) -> String {
    format!(
        "<h3>{name}</h3>\n<div class=\"scroll\" role=\"region\" aria-label=\"{name}\" tabindex=\"0\">\n\
         <table><thead>{head}</thead>\n<tbody>{rows}</tbody></table>\n</div>\n\
         <p class=\"caption\">{caption}</p>\n"
    )
}
