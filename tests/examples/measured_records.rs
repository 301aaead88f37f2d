//! Diagnoses of the measured records in `../shared` next to the checkout, compared with the known facts: `cargo run --release -p ctid-tests
//! --example measured_records`; an argument selects the records whose name contains it.

use std::{error::Error, fs, path::PathBuf};

use clap::Parser;
use ctid::sentences::of_diagnosis;
use ctid_tests::measured::{Case, Mark, Source, cases, claims_feedback, folder};
use missing_effect::{Diagnosis, Options, Step, TIME_LIMIT, diagnose};
use serde_json::{Value, json};

/// Diagnoses measured records of which it is known what a simple model lacks.
#[derive(Debug, Parser)]
struct Arguments {
    /// Only records whose name contains this, as `valve_loops/S_` or `tclab`.
    #[arg(default_value = "")]
    filter: String,
    /// Writes every record's outcome.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Searches without a limit on the time.
    #[arg(long)]
    no_limit: bool,
    /// Also prints what the diagnosis says in words.
    #[arg(long)]
    sentences: bool,
}

/// Outcomes of the records of one source.
#[derive(Debug, Default)]
struct Row {
    tried: usize,
    marks: Vec<Mark>,
    slowest: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    if folder().is_none() {
        println!("the measured records are not beside the checkout");
        return Ok(());
    }
    let mut rows: Vec<(Source, Row)> = Source::ALL.map(|source| (source, Row::default())).into();
    let mut all = Vec::new();
    println!(
        "{:<46} {:<7} {:<12} {:>6} {:>17} {:>17}  groups",
        "record", "", "verdict", "s", "error", "held out"
    );
    let options = Options {
        time_limit: (!arguments.no_limit).then_some(TIME_LIMIT),
        ..Options::default()
    };
    for (name, case) in cases(&arguments.filter) {
        let case = match case {
            Ok(case) => case,
            Err(why) => {
                println!("{name:<46} not read: {why}");
                all.push(json!({ "record": name, "refused": why }));
                continue;
            }
        };
        let row = rows.iter_mut().find(|(source, _)| *source == case.source);
        let Some((_, row)) = row else { continue };
        row.tried += 1;
        match diagnose(&case.problem, &options, &|_| {}) {
            Err(why) => {
                println!("{name:<46} refused: {why}");
                all.push(json!({ "record": name, "refused": why.to_string() }));
            }
            Ok(found) => {
                let mark = case.mark(&found);
                row.marks.push(mark);
                row.slowest = row.slowest.max(found.seconds);
                println!("{}", line(&case, &found));
                if arguments.sentences {
                    for sentence in of_diagnosis(&found) {
                        println!("    {sentence}");
                    }
                }
                all.push(entry(&case, &found));
            }
        }
    }
    println!(
        "\n| records, and what is missing | tried | right | partly | silent | wrong | slowest \\[s\\] |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut sum = Row::default();
    for (source, row) in rows {
        if row.tried == 0 {
            continue;
        }
        println!("{}", row.as_markdown(source.name()));
        sum.tried += row.tried;
        sum.marks.extend(row.marks);
        sum.slowest = sum.slowest.max(row.slowest);
    }
    println!("{}", sum.as_markdown("all"));
    if let Some(path) = &arguments.json {
        fs::write(path, serde_json::to_string_pretty(&all)? + "\n")?;
        println!("wrote {}", path.display());
    }
    Ok(())
}

impl Row {
    fn as_markdown(&self, name: &str) -> String {
        let count = |mark: Mark| self.marks.iter().filter(|own| **own == mark).count();
        format!(
            "| {name} | {} | {} | {} | {} | {} | {:.1} |",
            self.tried,
            count(Mark::Right),
            count(Mark::Partly),
            count(Mark::Silent),
            count(Mark::Wrong),
            self.slowest
        )
    }
}

/// An error before and after.
fn course(found: &Diagnosis, error: impl Fn(&Step) -> Option<f64>) -> Option<(f64, f64)> {
    error(found.steps.first()?).zip(error(found.steps.last()?))
}

fn line(case: &Case, found: &Diagnosis) -> String {
    let shown = |course: Option<(f64, f64)>| {
        course.map_or("-".to_string(), |(before, after)| {
            format!("{before:.4} {after:.4}")
        })
    };
    let groups: Vec<String> = found.groups.iter().map(|group| group.join("/")).collect();
    let share = found.acceptance.as_ref().and_then(|test| test.share);
    let feedback = if claims_feedback(found) {
        "; feedback claimed"
    } else {
        ""
    };
    format!(
        "{:<46} {:<7} {:<12} {:>6.1} {:>17} {:>17}  {}{}{feedback}",
        case.name,
        case.mark(found).name(),
        format!("{:?}", found.verdict),
        found.seconds,
        shown(course(found, |step| Some(step.rmse))),
        shown(course(found, |step| step.rmse_test)),
        groups.join(" + "),
        share.map_or(String::new(), |share| format!(
            "; share {:.0} %",
            100.0 * share
        )),
    )
}

fn entry(case: &Case, found: &Diagnosis) -> Value {
    json!({
        "record": case.name,
        "mark": case.mark(found).name(),
        "verdict": found.verdict,
        "groups": found.groups,
        "error": course(found, |step| Some(step.rmse)),
        "held_out": course(found, |step| step.rmse_test),
        "acceptance": found.acceptance,
        "feedback": claims_feedback(found),
        "seconds": found.seconds,
    })
}
