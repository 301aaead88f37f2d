//! Residual: where the model fails, the unexplained error, and the residual tests.

use effect_search::failures::SignalBins;
use effect_search::{Failures, ResidualTests};
use missing_effect::{Diagnosis, Shown};

use super::page::{figure, figure_with, items, section};
use super::text::escape;
use super::{tables, text};
use crate::findings;

pub(super) fn failures(diagnosis: &Diagnosis) -> String {
    let Some(last) = diagnosis.steps.last() else {
        return String::new();
    };
    let sentences = items(findings::sentences(diagnosis, last));
    let any = |bins: fn(&Failures) -> usize| {
        let outputs = diagnosis.steps.iter().flat_map(|step| &step.outputs);
        outputs
            .map(|output| bins(&output.failures))
            .any(|count| count > 0)
    };
    let mut figures = String::new();
    if !diagnosis.records.is_empty() {
        figures.push_str(&figure("by-time", "Residual against time", ""));
    }
    let mut pairs = String::new();
    if any(|failures| failures.by_output.len()) {
        pairs.push_str(&figure("by-output", "Against the model's output", BINNED));
    }
    for (k, signal) in signals(diagnosis, |failures| &failures.by_input) {
        let title = match signal {
            None => "Against the input".to_string(),
            Some(name) => format!("Against the input {name}"),
        };
        pairs.push_str(&figure(&format!("by-input-{k}"), &escape(&title), BINNED));
    }
    for (k, signal) in signals(diagnosis, |failures| &failures.by_state) {
        let title = format!("Against the state {}", signal.unwrap_or_default());
        let note = "Root mean square and mean of each bin.";
        pairs.push_str(&figure(&format!("by-state-{k}"), &escape(&title), note));
    }
    if any(|failures| failures.by_direction.len()) {
        pairs.push_str(&figure(
            "by-direction",
            "By direction of the model's output",
            "Bars: root mean square; diamonds: mean.",
        ));
    }
    if any(|failures| failures.by_frequency.len()) {
        pairs.push_str(&figure(
            "by-frequency",
            "By frequency",
            "Root mean square of the residual in each octave.",
        ));
    }
    let choices = choices(diagnosis);
    if figures.is_empty() && pairs.is_empty() && sentences.is_empty() {
        return String::new();
    }
    section(
        "failures",
        "Where the model fails",
        "The residual is the measurement minus the simulated output. \
         Hatched bars and shaded windows fail clearly; the dashed line is the noise floor.",
        &format!(
            "<ul id=\"failure-sentences\">{sentences}</ul>\n{choices}{figures}<div class=\"pairs\">{pairs}</div>\n"
        ),
    )
}

/// Positions and names of the signals with bins; a single input has no name.
fn signals(
    diagnosis: &Diagnosis,
    of: fn(&Failures) -> &Vec<SignalBins>,
) -> Vec<(usize, Option<&str>)> {
    let outputs = diagnosis.steps.iter().flat_map(|step| &step.outputs);
    let most = outputs
        .map(|output| of(&output.failures))
        .max_by_key(|signals| signals.len());
    let all = most.map_or(&[][..], |signals| signals.as_slice());
    let is_input = all.len() == 1
        && diagnosis
            .records
            .first()
            .is_some_and(|r| r.inputs.len() == 1);
    let named = all
        .iter()
        .map(|signal| (!is_input).then_some(signal.name.as_str()));
    named.enumerate().collect()
}

/// The unexplained error, if it is a function of a variable.
pub(super) fn unknown(diagnosis: &Diagnosis) -> String {
    let Some(unknown) = &diagnosis.unknown else {
        return String::new();
    };
    let mut figures = figure(
        "unknown-path",
        "The missing term against time",
        "Smoothed, with its 95 % band, on the first fitted record; shaded where the band excludes zero.",
    );
    if unknown.variable != "time" {
        figures.push_str(&figure(
            "unknown-shape",
            &format!("Against the {}", variable(unknown.variable)),
            "Fitted with all parameters of the plant; the part that these parameters explain as well is removed. With its 95 % band.",
        ));
    }
    section(
        "unknown",
        "The unexplained error",
        "The term that has to be added to the last model so that it fits the data. <code>ctid diagnose --unknown F.csv</code> writes \
         its shape, <code>ctid add NAME --from F.csv</code> keeps it as a term of your own.",
        &format!("{figures}{}", tables::shares(unknown)),
    )
}

/// A variable of a missing term in words.
pub(super) fn variable(name: &str) -> &str {
    match name {
        "rate" => "net inflow",
        "input" => "command",
        other => other,
    }
}

const BINNED: &str = "Above the samples with the mean of each bin, below the root mean square of each bin; \
                      first fitted record.";

/// Selection of the record of the residual plot and of common axes, if there is a choice.
fn choices(diagnosis: &Diagnosis) -> String {
    let mut choices = String::new();
    if diagnosis.records.len() > 1 {
        let options: String = diagnosis
            .records
            .iter()
            .enumerate()
            .map(|(k, record)| {
                let name = escape(&record.name);
                format!("<option value=\"{k}\">{name} ({})</option>", role(record))
            })
            .collect();
        choices.push_str(&format!(
            "<label>Record <select id=\"residual-record\" autocomplete=\"off\">{options}</select></label>\n"
        ));
    }
    if diagnosis.steps.len() > 1 {
        choices.push_str(
            "<label><input type=\"checkbox\" id=\"same-axes\" autocomplete=\"off\" checked> \
             same axes for every model</label>\n",
        );
    }
    if choices.is_empty() {
        return choices;
    }
    format!("<p class=\"choice\">{choices}</p>\n")
}

pub(super) fn role(record: &Shown) -> &'static str {
    if record.held_out {
        "held out"
    } else {
        "fitted"
    }
}

pub(super) fn residual_tests(diagnosis: &Diagnosis) -> String {
    let Some(last) = diagnosis.steps.last() else {
        return String::new();
    };
    let mut outputs = diagnosis.steps.iter().flat_map(|step| &step.outputs);
    let any = outputs.any(|output| {
        output.tests.autocorrelation.len() > 1 || !output.tests.cross_correlation.is_empty()
    });
    if !any {
        return String::new();
    }
    // The script shows only those of the chosen output.
    let said = |of: fn(&ResidualTests) -> String| {
        let said = last.outputs.iter().map(|output| {
            let finding = of(&output.tests);
            if findings::several(diagnosis) {
                format!("{}: {finding}", output.name)
            } else {
                finding
            }
        });
        escape(&said.collect::<Vec<_>>().join(" "))
    };
    // A model may have no input.
    let records = &diagnosis.records;
    let has_input = records.is_empty() || records.iter().any(|one| !one.inputs.is_empty());
    let input = figure_with(
        "cross-correlation",
        "Residual against past input",
        &format!(
            "<span id=\"input-test\">{}</span> Both were whitened first.",
            said(|tests| text::input_test(tests.input_p))
        ),
    );
    section(
        "tests",
        "Is the residual noise?",
        "The residual of a complete model is noise: nearly all stems are inside the \
         band. The band contains 95 % of the stems of white noise.",
        &format!(
            "<div class=\"pairs\">{}{}</div>\n",
            figure_with(
                "autocorrelation",
                "Autocorrelation of the residual",
                &format!(
                    "<span id=\"whiteness\">{}</span>",
                    said(|tests| text::whiteness(tests.whiteness_p))
                )
            ),
            if has_input { input } else { String::new() }
        ),
    )
}
