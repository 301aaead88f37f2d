//! The report: one HTML file that holds everything it needs, to be opened beside the plant.
//!
//! The words and the tables are written here and stand without a script; the plots are drawn in the
//! browser by `report.js` with plotly.js, which the build script has packed. The page loads nothing:
//! its content security policy forbids every connection. The same diagnosis gives the same bytes.
//!
//! What every page shares is in `page.rs`, `plots.js` and `report.css`; pages whose plots are curves alone say in
//! `figures.rs` what `figures.js` draws.

mod baysse;
mod data;
mod decimate;
mod figures;
mod identification;
mod missing_term;
mod page;
mod residual;
#[cfg(test)]
pub(crate) mod sample;
mod side_by_side;
mod tables;
mod text;
mod udink;

use effect_search::OutputStep;
use missing_effect::{Diagnosis, Step, Verdict};

pub use self::baysse::html as baysse;
pub(crate) use self::data::{json as drawing, records as drawing_of_records, rounded};
pub(crate) use self::decimate::min_max;
pub use self::identification::html as identification;
pub(crate) use self::missing_term::{COMPARED, ComparedPort, MissingTerm};
pub use self::page::head;
use self::page::{NOTICES, Page, figure, items, large, section};
pub(crate) use self::page::{PLOTLY, PLOTS, STYLE};
use self::residual::{failures, residual_tests, role, unknown, variable};
pub use self::side_by_side::html as side_by_side;
use self::text::{escape, significant};
pub use self::udink::html as udink;
use crate::findings::{self, Reader};
use crate::sentences;

/// Script that draws a diagnosis, in the report and on the served page.
pub(crate) const DIAGNOSIS_FIGURES: &str = include_str!("diagnosis_figures.js");
const SCRIPT: &str = concat!(
    include_str!("diagnosis_figures.js"),
    include_str!("report.js")
);

/// The report of a diagnosis as a complete HTML file. A comparison is a diagnosis with one step and no scores; empty parts are omitted.
pub fn html(diagnosis: &Diagnosis) -> String {
    let sentences = sentences::of_diagnosis(diagnosis);
    html_with(diagnosis, &sentences, None, &verdict(diagnosis))
}

/// The report of a diagnosis with other sentences, with the unexplained error of a user's own model, and with a verdict in words.
pub(crate) fn html_with(
    diagnosis: &Diagnosis,
    sentences: &[String],
    term: Option<&MissingTerm>,
    verdict: &str,
) -> String {
    let title = format!("ctid: {}", escape(&diagnosis.plant));
    let data = data::json_with(diagnosis, term);
    let body: String = [
        headline(diagnosis, sentences, verdict),
        shown(diagnosis),
        "<main>".to_owned(),
        fit(diagnosis),
        unknown(diagnosis),
        term.map_or(String::new(), missing_term::html),
        failures(diagnosis),
        residual_tests(diagnosis),
        ranking(diagnosis),
        steps(diagnosis),
        "</main>".to_owned(),
        footer(),
    ]
    .concat();
    page::html(&Page {
        title: &title,
        body: &body,
        data: &data,
        script: SCRIPT,
    })
}

/// The verdict, the fall of the error in large numbers, and the analysed data.
fn headline(diagnosis: &Diagnosis, sentences: &[String], verdict: &str) -> String {
    let effort = findings::effort(&diagnosis.effort, Reader::Commands);
    let sentences: String = sentences
        .iter()
        .chain(&effort)
        .map(|sentence| format!("<p>{}</p>\n", text::prose(sentence)))
        .collect();
    format!(
        "<header>\n<p class=\"kicker\">ctid report · {plant}</p>\n<h1>{verdict}</h1>\n\
         <div class=\"verdict\">\n{sentences}</div>\n{trail}{facts}\
         {NOTICES}</header>\n",
        plant = escape(&diagnosis.plant),
        verdict = escape(verdict),
        trail = trail(diagnosis),
        facts = tables::facts(diagnosis),
    )
}

/// The verdict of a diagnosis or a comparison in a few words.
pub(crate) fn verdict(diagnosis: &Diagnosis) -> String {
    if findings::is_comparison(diagnosis) {
        return "Model against measurement".to_owned();
    }
    match diagnosis.verdict {
        Verdict::Effect => {
            let found = match diagnosis.effects.len() {
                0 | 1 => "The missing effect is found",
                _ => "The missing effects are found",
            };
            let rest = if diagnosis.residual_unexplained {
                "; the residual is not noise"
            } else {
                ""
            };
            return format!("{found}{rest}");
        }
        Verdict::Undecided => "Something is missing; more than one effect fits these data",
        Verdict::Partial => return findings::partial_headline(diagnosis),
        Verdict::Unexplained => {
            "The residual is not noise, and no effect of the catalogue explains it"
        }
        Verdict::Adequate => "The model is adequate",
    }
    .to_owned()
}

fn trail(diagnosis: &Diagnosis) -> String {
    if diagnosis.steps.is_empty() {
        return String::new();
    }
    let several = findings::several(diagnosis);
    let items: String = diagnosis
        .steps
        .iter()
        .map(|step| {
            let (error, unit) = findings::step_error(diagnosis, step);
            let test = findings::held_out_step_error(diagnosis, step);
            let unit = text::unit(unit);
            let mut below = test.map_or(String::new(), |error| {
                format!(
                    "<span class=\"test\">held out {} {unit}</span>",
                    significant(error, 2)
                )
            });
            if several {
                below.push_str(&errors_of_outputs(diagnosis, step));
            }
            large(&significant(error, 2), &unit, &label(step), &below)
        })
        .collect();
    let held_out = |step: &Step| step.outputs.iter().any(|output| output.rmse_test.is_some());
    let held_out = if diagnosis.steps.iter().any(held_out) {
        "; below it the same on the held-out data, which were not used for fits or selection"
    } else {
        ""
    };
    let weighted = if several {
        " The error of all outputs is their root mean square after each is divided by the noise floor of its output; \
         below it each output alone."
    } else {
        ""
    };
    format!(
        "<ol class=\"trail\">\n{items}</ol>\n<p class=\"caption\">Simulation error (root mean square; \
         the model runs on the input alone and is never corrected by a measurement) \
         on the fitted data{held_out}.{weighted}</p>\n"
    )
}

/// The error of each output by its name, a line each.
fn errors_of_outputs(diagnosis: &Diagnosis, step: &Step) -> String {
    let line = |(k, output): (usize, &OutputStep)| {
        let unit = text::unit(diagnosis.unit_of(k));
        let test = output.rmse_test.map_or(String::new(), |error| {
            format!(", held out {} {unit}", significant(error, 2))
        });
        format!(
            "<span class=\"test\">{}: {} {unit}{test}</span>",
            escape(&output.name),
            significant(output.rmse, 2)
        )
    };
    step.outputs.iter().enumerate().map(line).collect()
}

/// Controls of the plots: buttons that choose the model, and a choice of the output, each only if there are several.
fn shown(diagnosis: &Diagnosis) -> String {
    let (buttons, output) = (step_buttons(diagnosis), output_choice(diagnosis));
    if buttons.is_empty() && output.is_empty() {
        return String::new();
    }
    format!(
        "<nav id=\"steps\" aria-label=\"Model that the plots show\">\n<span>Show</span>\n{buttons}{output}\
         <span id=\"shown\" class=\"unseen\" aria-live=\"polite\"></span>\n</nav>\n"
    )
}

/// Selection of the output for the plots of one output.
fn output_choice(diagnosis: &Diagnosis) -> String {
    if !findings::several(diagnosis) || diagnosis.steps.is_empty() {
        return String::new();
    }
    let outputs = diagnosis.outputs.iter().enumerate();
    let options: String = outputs
        .map(|(k, name)| format!("<option value=\"{k}\">{}</option>", escape(name)))
        .collect();
    format!(
        "<label>Output <select id=\"shown-output\" autocomplete=\"off\">{options}</select></label>\n"
    )
}

fn step_buttons(diagnosis: &Diagnosis) -> String {
    if diagnosis.steps.len() < 2 {
        return String::new();
    }
    let last = diagnosis.steps.len() - 1;
    let buttons: String = diagnosis
        .steps
        .iter()
        .enumerate()
        .map(|(k, step)| {
            let (error, unit) = findings::step_error(diagnosis, step);
            format!(
                "<button type=\"button\" data-step=\"{k}\" aria-pressed=\"{}\">\
                 <i class=\"swatch\"></i>{} <b>{} {}</b></button>\n",
                k == last,
                label(step),
                significant(error, 2),
                text::unit(unit)
            )
        })
        .collect();
    format!(
        "{buttons}<button type=\"button\" id=\"play\" aria-pressed=\"false\">▶ watch the error fall</button>\n"
    )
}

fn fit(diagnosis: &Diagnosis) -> String {
    if diagnosis.records.is_empty() {
        return String::new();
    }
    let figures: String = diagnosis
        .records
        .iter()
        .enumerate()
        .map(|(k, record)| {
            let role = role(record);
            let heading = format!(
                "{} <span class=\"badge\">{role}</span>",
                escape(&record.name)
            );
            figure(&format!("record-{k}"), &heading, "")
        })
        .collect();
    let above = if findings::several(diagnosis) {
        "Above the readings of each output and the models"
    } else {
        "Above the reading and the models"
    };
    section(
        "fit",
        "Measured against model",
        &format!(
            "{above}, below the input. Shaded: where the error of the chosen model clearly exceeds the noise on the \
             first fitted record; a darker shade is a larger error. Drag to zoom (on a touch screen choose the \
             magnifier first), double-click to see all again; the names switch the curves on and off."
        ),
        &figures,
    )
}

fn ranking(diagnosis: &Diagnosis) -> String {
    if diagnosis.scores.is_empty() {
        return String::new();
    }
    section(
        "ranking",
        "Which effect is missing?",
        "Each effect of the catalogue was added to the base model alone and everything was fitted again. \
         The larger the fall of the Bayesian information criterion (BIC), the better; a fall below 6 is not significant, and effects within 6 \
         of each other are not distinguished.",
        &format!(
            "{}{}{}{}{}",
            tables::groups(diagnosis),
            tables::acceptance(diagnosis),
            tables::rankings(diagnosis),
            figure(
                "scores",
                "Fall of BIC with one effect added",
                "Blue: added to the model; hatched: these data do not distinguish it from an added one."
            ),
            tables::scores(diagnosis)
        ),
    )
}

fn steps(diagnosis: &Diagnosis) -> String {
    if diagnosis.steps.is_empty() {
        return String::new();
    }
    let (title, lead, plot) = if diagnosis.steps.len() < 2 {
        ("The fitted parameters", "", String::new())
    } else {
        (
            "How the error fell",
            "One effect more with each step; every parameter is fitted again.",
            figure("trail", "Simulation error after each step", ""),
        )
    };
    section(
        "parameters",
        title,
        lead,
        &format!("{plot}{}", tables::parameters(diagnosis)),
    )
}

fn footer() -> String {
    "<footer><p>Written by ctid. The simulation error is that of a model that runs on the input alone; \
     it is not a prediction error. Standard errors are one standard deviation. \
     This file holds all its data and loads nothing.</p></footer>"
        .to_owned()
}

fn label(step: &Step) -> String {
    escape(&data::step_label(step))
}

#[cfg(test)]
mod tests;
