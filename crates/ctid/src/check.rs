//! `ctid check`: summary of a model's text.

use std::path::Path;

use ct_model::{About, Given, Linearity, ModelSpec, Variable, unit_warnings, unknown_units};
use ct_signals::{escaped, shown};

use crate::Error;
use crate::look::{Look, Side, table};
use crate::model_file;
use crate::own_model::{self, AnyModelFile};

/// Reads a model and prints a summary; for a model file, the model that it names with its effects included.
///
/// # Errors
/// One line that names the file, line and column, what is wrong and the correction.
pub(crate) fn run(path: &Path, look: Look) -> Result<String, Error> {
    if path.extension().is_none_or(|kind| kind != "toml") {
        return Ok(said(&own_model::read_model(path)?, look) + &unknown(path, look));
    }
    match AnyModelFile::read(path)?.with_effects()? {
        AnyModelFile::Own(file) => Ok(said(file.model.spec(), look) + &unknown(&file.text, look)),
        AnyModelFile::Plant(_) => Err(Error::file(
            path,
            "it names one of the plants, which has no text to check: `ctid effects --model` lists what may be added to it",
        )),
    }
}

/// Warnings about unknown units, each with its place in the text.
fn unknown(path: &Path, look: Look) -> String {
    // A file that cannot be read twice, such as a pipe, was read as a model.
    let Ok(text) = model_file::read_text(path) else {
        return String::new();
    };
    let file = path.display();
    let all = unknown_units(&text).unwrap_or_default();
    let lines = all.iter().map(|unit| {
        let words = format!("warning: {file}:{unit}");
        look.warning(&words) + "\n"
    });
    lines.collect()
}

/// Summary of a model in words.
pub(crate) fn said(model: &ModelSpec, look: Look) -> String {
    let mut text = String::new();
    let title = match model.description.as_str() {
        "" => model.name.clone(),
        description => format!("{}: {}", model.name, escaped(description)),
    };
    text += &format!("{}\n", look.heading(&title));
    text += &look.paragraph("", &linearity(model));
    let mut part = |title: &str, rows: Vec<Vec<String>>| {
        if rows.is_empty() {
            return;
        }
        text += &format!("\n{}\n", look.heading(title));
        let sides = [Side::Left, Side::Left, Side::Left, Side::Left, Side::Left];
        for line in table(&sides, &rows) {
            text += &format!("  {}\n", line.trim_end());
        }
    };
    let states = model.states.iter().map(|state| {
        let start = format!("start {}", model.write(&state.start));
        let known = if state.fixed { "known" } else { "fitted" };
        row(&state.about, &start, known)
    });
    part("States", states.collect());
    let inputs = model.inputs.iter().map(|input| row(&input.about, "", ""));
    part("Inputs", inputs.collect());
    let outputs = model.outputs.iter().map(|output| {
        let equal = match output.variable {
            Variable::Flow(i) => format!("= {}", model.write(&model.flows[i].value)),
            _ => "a state".to_string(),
        };
        row(model.about(output.variable), &equal, "")
    });
    part("Outputs", outputs.collect());
    let parameters = model.parameters.iter().map(|parameter| {
        let value = shown(parameter.value);
        let given = match parameter.given {
            Given::Fitted => "fitted",
            Given::Measured => "measured",
            Given::Constant => "constant",
        };
        row(&parameter.about, &format!("= {value}"), given)
    });
    part("Parameters", parameters.collect());
    let flows = (0..model.flows.len()).map(Variable::Flow);
    let flows = flows.filter(|&flow| !model.is_output(flow)).map(|flow| {
        let Variable::Flow(i) = flow else {
            return Vec::new();
        };
        let value = format!("= {}", model.write(&model.flows[i].value));
        row(model.about(flow), &value, "")
    });
    part("Named flows", flows.collect());
    text += &own_model::ports::summary(model, look);
    let warnings = unit_warnings(model);
    if !warnings.is_empty() {
        text.push('\n');
    }
    for warning in warnings {
        let words = format!(
            "warning: units in the equation of {}: {}",
            warning.of, warning.what
        );
        text += &(look.warning(look.paragraph("", &words).trim_end()) + "\n");
    }
    text
}

fn linearity(model: &ModelSpec) -> String {
    let count = |count: usize, what: &str| match count {
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
    };
    let size = format!(
        "{}, {}, {}, {}",
        count(model.states.len(), "state"),
        count(model.inputs.len(), "input"),
        count(model.outputs.len(), "output"),
        count(model.parameters.len(), "parameter")
    );
    match model.linearity() {
        Linearity::Linear => format!("{size}; linear in states and inputs"),
        Linearity::Nonlinear { equations } => {
            let names: Vec<&str> = equations
                .iter()
                .map(|&variable| model.about(variable).name.as_str())
                .collect();
            format!("{size}; not linear in the equation of {}", names.join(", "))
        }
    }
}

/// Name, unit, kind, bounds, description.
fn row(about: &About, value: &str, kind: &str) -> Vec<String> {
    let bounds = match (about.min.is_finite(), about.max.is_finite()) {
        (false, false) => String::new(),
        (true, false) => format!("at least {}", about.min),
        (false, true) => format!("at most {}", about.max),
        (true, true) => format!("{} to {}", about.min, about.max),
    };
    let notes: Vec<&str> = [kind, &bounds]
        .into_iter()
        .filter(|note| !note.is_empty())
        .collect();
    let unit = if about.unit.is_empty() {
        String::new()
    } else {
        format!("[{}]", escaped(&about.unit))
    };
    vec![
        about.name.clone(),
        unit,
        value.to_string(),
        notes.join(", "),
        escaped(&about.description).to_string(),
    ]
}
