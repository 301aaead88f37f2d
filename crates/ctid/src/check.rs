//! `ctid check`: summary of a model's text.

use std::collections::BTreeMap;
use std::path::Path;

use ct_model::{About, Given, Linearity, Method, Model, ModelSpec, Variable};
use ct_signals::{escaped, shown};

use crate::Error;
use crate::look::{Look, Side, table_text};
use crate::model_file;
use crate::numbers;
use crate::own_model::{self, AnyModelFile, units};

/// Reads a model and prints a summary; for a model file, the model that it names with its effects included.
///
/// # Errors
/// One line that names the file, line and column, what is wrong and the correction.
pub(crate) fn run(path: &Path, look: Look) -> Result<String, Error> {
    if path.extension().is_none_or(|kind| kind != "toml") {
        let model = own_model::read_model(path)?;
        // A file that cannot be read twice, such as a pipe, was read as a model.
        let text = model_file::read_text(path).unwrap_or_default();
        let warnings = units::warnings(Some(path), &text, &model, look);
        return Ok(said(&model, look) + &ideal(&model, &BTreeMap::new(), look) + &warnings);
    }
    match AnyModelFile::read(path)?.with_effects()? {
        AnyModelFile::Own(file) => {
            let model = file.model.spec();
            let unit = file.declared_time_unit();
            let of_time = unit.map_or(String::new(), |unit| file.time_unit_warning(unit, look));
            let warnings = file.unit_warnings(look) + &of_time;
            Ok(said(model, look) + &ideal(model, &file.known, look) + &warnings)
        }
        AnyModelFile::Plant(_) => Err(Error::file(
            path,
            "it names one of the plants, which has no text to check: `ctid effects --model` lists what may be added to it",
        )),
    }
}

/// How the model is simulated, and which parameters no record of it determines.
pub(crate) fn ideal(spec: &ModelSpec, known: &BTreeMap<String, f64>, look: Look) -> String {
    let driven = if spec.inputs.is_empty() {
        "from displaced initial states"
    } else {
        "all inputs stepped"
    };
    let heading = format!("With records without noise, {driven}");
    let mut text = format!("\n{}\n", look.heading(&heading));
    let found = match greybox::ideal_records(&Model::new(spec.clone()), known) {
        Ok(found) => found,
        Err(why) => return text + &look.paragraph("  ", &format!("not simulated: {why}")),
    };
    let way = match found.method {
        _ if spec.states.is_empty() => "no states to simulate",
        Method::Exact => "simulated exactly",
        Method::Explicit => "simulated by explicit Runge-Kutta steps",
        Method::Implicit => "stiff, simulated by implicit Runge-Kutta steps",
    };
    let constants: Vec<String> = found
        .time_constants
        .iter()
        .map(|value| numbers::significant(*value, 3))
        .collect();
    let constants = match constants.as_slice() {
        [] => String::new(),
        [only] => {
            format!("; time constant at the start values {only}, in the equations' unit of time")
        }
        all => format!(
            "; time constants at the start values {}, in the equations' unit of time",
            all.join(", ")
        ),
    };
    text += &look.paragraph("  ", &format!("{way}{constants}"));
    if found.not_determined.is_empty() {
        text += &look.paragraph(
            "  ",
            "such records determine all parameters that are fitted",
        );
    }
    for together in &found.not_determined {
        let what = match together.as_slice() {
            [one] => format!(
                "{one} has no effect of its own on the outputs of such records: fix it under [known], or let the {} reach where it has one",
                if spec.inputs.is_empty() {
                    "states"
                } else {
                    "inputs"
                }
            ),
            all => format!(
                "such records determine only a combination of {}: fix one of them under [known], or give a [prior]",
                all.join(", ")
            ),
        };
        text += &look.paragraph("  ", &what);
    }
    if !found.assumed.is_empty() {
        let ranges = found
            .assumed
            .iter()
            .map(|(name, (low, high))| format!("{name} {} to {}", shown(*low), shown(*high)));
        let ranges: Vec<String> = ranges.collect();
        let what = format!(
            "inputs without min and max in the text are taken as {}",
            ranges.join(", ")
        );
        text += &look.paragraph("  ", &what);
    }
    text
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
        text += &table_text(&sides, &rows);
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
