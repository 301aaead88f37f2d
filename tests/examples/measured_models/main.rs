//! Models that a user would write of the measured records in `../shared/real` and `../shared/data` beside the checkout: what `ctid diagnose`
//! says is missing in them, against what is known of each record.
//!
//! ```sh
//! cargo build --release && cargo run --release -p ctid-tests --example measured_models [-- --effort thorough] [PART-OF-A-NAME...]
//! ```
//! Prints for each case the verdict, the groups, the simulation error on the fitted and on the held-out record model by model, and how long
//! it took; then how many are right. The models and their model files are those of this folder; [`expected`] says what is looked for, and
//! why.
#![allow(clippy::unwrap_used)]

mod expected;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Parser;
use ctid_tests::measured::Mark;
use ctid_tests::program::{program, result};
use expected::{Case, cases};
use serde_json::Value;

/// Diagnoses measured records with models of their own.
#[derive(Debug, Parser)]
struct Arguments {
    /// Only cases whose name contains one of these, as `tclab` or `ball_drops/golf`.
    parts: Vec<String>,
    /// Effort of the search, as for `ctid diagnose --effort`.
    #[arg(long)]
    effort: Option<String>,
}

/// An answer of the program.
struct Answer {
    found: Value,
    seconds: f64,
}

fn main() {
    let arguments = Arguments::parse();
    let records = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/real");
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/measured_models");
    if !records.exists() {
        println!("skipped: {} is not there", records.display());
        return;
    }
    let Some(program) = program() else { return };
    let parts = &arguments.parts;
    let chosen = cases().into_iter().filter(|case| {
        parts.is_empty() || parts.iter().any(|part| case.name().contains(part.as_str()))
    });
    let mut marks: BTreeMap<String, Vec<(Mark, f64)>> = BTreeMap::new();
    for case in chosen {
        let missing = case.records().find(|file| !records.join(file).exists());
        if let Some(file) = missing {
            println!("{}: skipped: {file} is not there", case.name());
            continue;
        }
        let answer = match diagnosed(&program, &arguments, &case, &[&records, &models]) {
            Ok(answer) => answer,
            Err(why) => {
                println!("{}: refused: {why}", case.name());
                continue;
            }
        };
        let mark = mark(&case, &answer.found);
        println!("{}", shown(&case, &answer, mark));
        let of_folder = marks.entry(case.folder().to_string()).or_default();
        of_folder.push((mark, answer.seconds));
    }
    let all: Vec<(Mark, f64)> = marks.values().flatten().copied().collect();
    println!("\n| records | cases | right | partly | silent | wrong | slowest \\[s\\] |");
    println!("|---|---|---|---|---|---|---|");
    for (folder, marks) in &marks {
        println!("{}", row(folder, marks));
    }
    println!("{}", row("all", &all));
}

/// Result of `ctid diagnose`, or its error message.
fn diagnosed(
    program: &Path,
    arguments: &Arguments,
    case: &Case,
    [records, models]: &[&Path; 2],
) -> Result<Answer, String> {
    let in_folder = |file: &String| -> PathBuf { records.join(file) };
    let mut command = Command::new(program);
    command
        .arg("diagnose")
        .args(case.fitted.iter().map(in_folder));
    for file in &case.held_out {
        command.arg("--test").arg(in_folder(file));
    }
    command.arg("--model").arg(models.join(case.model));
    if let Some(effort) = &arguments.effort {
        command.arg("--effort").arg(effort);
    }
    let (found, seconds) = result(&mut command)?;
    Ok(Answer { found, seconds })
}

fn groups(found: &Value) -> Vec<Vec<&str>> {
    let of = |list: &Value| -> Vec<Value> { list.as_array().cloned().unwrap_or_default() };
    let count = of(&found["groups"]).len();
    let group = |i: usize| found["groups"][i].as_array().unwrap().iter();
    (0..count)
        .map(|i| group(i).filter_map(Value::as_str).collect())
        .collect()
}

fn steps(found: &Value) -> &[Value] {
    found["steps"].as_array().map_or(&[], Vec::as_slice)
}

/// The simulation errors of a model at its outputs.
fn errors(step: &Value, key: &str) -> Vec<f64> {
    let outputs = step[key].as_object();
    outputs.map_or_else(Vec::new, |outputs| {
        outputs.values().filter_map(Value::as_f64).collect()
    })
}

/// The held-out errors of a model at its outputs, if its initial states are fitted to the first 50 rows, which are not scored.
fn errors_50(step: &Value) -> Vec<f64> {
    let outputs = step["outputs"].as_array();
    let all = outputs.into_iter().flatten();
    all.filter_map(|output| output["rmse_test_50"].as_f64())
        .collect()
}

/// Right: all that is known to be missing is named, nothing else, and the error is as low as it was reached by hand. Partly: some of it.
fn mark(case: &Case, found: &Value) -> Mark {
    let claims = ["effect", "undecided", "partial"].contains(&found["verdict"].as_str().unwrap());
    let groups = groups(found);
    if !claims || groups.is_empty() {
        let nothing = case.missing.is_empty() && found["verdict"] == "adequate";
        return if nothing { Mark::Right } else { Mark::Silent };
    }
    let holds = |group: &[&str], names: &[&str]| group.iter().any(|id| names.contains(id));
    let met = |names: &&[&str]| groups.iter().any(|group| holds(group, names));
    let met_count = case.missing.iter().filter(|names| met(names)).count();
    let known = |group: &&Vec<&str>| {
        holds(group, case.allowed) || case.missing.iter().any(|names| holds(group, names))
    };
    let foreign = groups.iter().filter(|group| !known(group)).count();
    let last = steps(found).last().unwrap();
    let low = case.error.is_none_or(|limit| {
        let all = errors(last, "rmse_per_output");
        all.iter().copied().fold(0.0, f64::max) <= limit
    });
    if foreign == groups.len() || met_count == 0 && !case.missing.is_empty() {
        Mark::Wrong
    } else if met_count == case.missing.len() && foreign == 0 && low && vanished(case, last) {
        Mark::Right
    } else {
        Mark::Partly
    }
}

/// Whether the term that the effects should replace is gone: its parameter is at its bound, or within two standard errors of zero.
fn vanished(case: &Case, last: &Value) -> bool {
    let Some(name) = case.replaced else {
        return true;
    };
    let parameters = last["parameters"].as_array().unwrap();
    let own = parameters.iter().find(|own| own["name"] == name).unwrap();
    let error = own["std_error"].as_f64();
    error.is_none_or(|error| own["value"].as_f64().unwrap() < 2.0 * error)
}

fn shown(case: &Case, answer: &Answer, mark: Mark) -> String {
    let found = &answer.found;
    let groups = groups(found);
    let named: Vec<String> = groups.iter().map(|group| group.join("/")).collect();
    let joined = |errors: &dyn Fn(&Value) -> Vec<f64>| -> String {
        let of_step = |step: &Value| {
            let all: Vec<String> = errors(step).iter().map(|error| number(*error)).collect();
            all.join(" ")
        };
        let all: Vec<String> = steps(found).iter().map(of_step).collect();
        all.join(" -> ")
    };
    let course = |key: &str| joined(&|step| errors(step, key));
    let limit = case.error.map_or(String::new(), |limit| {
        format!(" (by hand {})", number(limit))
    });
    let held_out = match case.held_out.is_empty() {
        true => String::new(),
        false => format!(
            "\n    held out  {}\n    held out, 50 rows  {}",
            course("rmse_test_per_output"),
            joined(&|step| errors_50(step))
        ),
    };
    format!(
        "{}: {mark:?}: {} {} ({:.1} s)\n    expected  {}\n    fitted    {}{limit}{held_out}",
        case.name(),
        found["verdict"].as_str().unwrap(),
        match named.is_empty() {
            true => "-".to_string(),
            false => named.join(" + "),
        },
        answer.seconds,
        case.why,
        course("rmse_per_output"),
    )
}

/// Three digits.
fn number(value: f64) -> String {
    let digits = 2 - value.abs().max(1e-12).log10().floor() as i32;
    format!("{value:.*}", digits.clamp(0, 8) as usize)
}

fn row(name: &str, marks: &[(Mark, f64)]) -> String {
    let count = |mark: Mark| marks.iter().filter(|own| own.0 == mark).count();
    format!(
        "| {name} | {} | {} | {} | {} | {} | {:.1} |",
        marks.len(),
        count(Mark::Right),
        count(Mark::Partly),
        count(Mark::Silent),
        count(Mark::Wrong),
        marks.iter().map(|own| own.1).fold(0.0, f64::max)
    )
}
