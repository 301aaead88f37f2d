//! The tour: the bundled record with a hidden effect, from the first comparison to the fall of the error.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use ct_signals::ReadOptions;
use missing_effect::{Diagnosis, Options, Problem, Verdict};

use crate::finish::say;
use crate::input::Files;
use crate::look::Look;
use crate::progress::Bar;
use crate::{Error, edit, output, terminal};

static DATA: (&str, &str) = ("tour.csv", include_str!("../records/tour.csv"));
static TEST: (&str, &str) = ("tour-test.csv", include_str!("../records/tour-test.csv"));
static MODEL: (&str, &str) = ("tour.toml", include_str!("../records/tour.toml"));

/// Files of the tour.
#[derive(Debug)]
pub struct Tour {
    /// The page of the tour.
    pub report: PathBuf,
    /// Diagnosis of the tour.
    pub diagnosis: Diagnosis,
}

/// Runs the five steps with explanations on `out`, and writes `report.html` into `folder`; if a file with this name is not from an earlier
/// tour, `report-2.html`, and so on.
///
/// # Errors
/// Where the folder or `out` cannot be written to.
pub fn run(folder: &Path, out: &mut dyn Write, look: Look, bar: &Bar) -> Result<Tour, Error> {
    // Checked before the first output: if the report cannot be written, the tour does not begin.
    let report = output::free_report(folder, DATA.0)?;
    let problem = problem()?;
    let options = Options::default();

    say(out, &introduction(look))?;
    bar.phase("fitting the model");
    let compared = missing_effect::compare(&problem, &options);
    bar.clear();
    let compared = compared?;
    say(out, &compare(&compared, look))?;
    say(out, &where_it_fails(&compared, look))?;

    let diagnosis = missing_effect::diagnose(&problem, &options, &|progress| bar.show(progress));
    bar.clear();
    let diagnosis = diagnosis?;
    report.write(&diagnosis)?;
    say(out, &what_is_missing(&diagnosis, look))?;
    say(out, &add(&diagnosis, look)?)?;
    say(out, &watch(&diagnosis, look))?;
    say(out, &end(report.path(), look))?;
    Ok(Tour {
        report: report.path().to_path_buf(),
        diagnosis,
    })
}

/// The bundled records and model, read from files like a user's.
fn problem() -> Result<Problem, Error> {
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    for (name, text) in [DATA, TEST, MODEL] {
        fs::write(path(name), text)?;
    }
    Files {
        data: vec![path(DATA.0)],
        test: vec![path(TEST.0)],
        model: path(MODEL.0),
        options: ReadOptions::default(),
    }
    .read()
    .map(|input| input.problem)
}

fn step(number: usize, title: &str, text: &str, look: Look) -> String {
    let rule = "─".repeat(look.width.saturating_sub(title.chars().count() + 6));
    format!(
        "{} {} {}\n{}\n",
        look.good(format!("── {number}")),
        look.strong(title),
        look.faint(rule),
        look.paragraph("", text)
    )
}

fn introduction(look: Look) -> String {
    let text = "A pump fills a tank, and the water leaves through a hole in the bottom. Half an hour was \
                recorded: the voltage of the pump and the level. The model file states what is known about the tank. One effect is \
                missing in it, and ctid does not know which.";
    let mut said = format!(
        "{}\n{}\n",
        look.heading("ctid: what is your model missing?"),
        look.paragraph("", text)
    );
    for line in MODEL.1.lines() {
        said += format!("    {}", look.faint(line)).trim_end();
        said.push('\n');
    }
    said + "\n"
}

fn compare(diagnosis: &Diagnosis, look: Look) -> String {
    let text = "The model is fitted, then it runs on the pump's voltage alone: a simulation, never corrected \
                by a measurement. A second record is held out; it is not used for fits or selection.";
    let mut said = step(1, "Compare", text, look) + &terminal::header(diagnosis, look);
    if let Some(first) = diagnosis.steps.first() {
        said += &terminal::overlay(diagnosis, first, look);
        said += &terminal::residuals(diagnosis, &[first], look);
    }
    said + &terminal::trail(diagnosis, look)
}

fn where_it_fails(diagnosis: &Diagnosis, look: Look) -> String {
    let text = "A single number does not show what is wrong. So the residual is divided by time, level, flow, \
                direction of change and frequency, and tested for dependence on the input.";
    let mut said = step(2, "See where it fails", text, look);
    for first in &diagnosis.steps {
        said += &terminal::failures(diagnosis, first, look);
    }
    said
}

fn what_is_missing(diagnosis: &Diagnosis, look: Look) -> String {
    let text = "Every effect of the catalogue is tried at every place where it can act, alone and together, \
                and confirmed by a refit. `detectable` is the smallest size that these data would have shown (minimum detectable size).";
    step(3, "Learn what is missing", text, look)
        + &terminal::ranking(diagnosis, look)
        + &terminal::groups(diagnosis, look)
        + &terminal::findings(diagnosis, look)
        + "\n"
}

fn add(diagnosis: &Diagnosis, look: Look) -> Result<String, Error> {
    let text = "For a model file of your own, you would now enter the command below. It changes only one line \
                of the file, which is shown after it.";
    let mut said = step(4, "Add it", text, look);
    let mut model = MODEL.1.to_string();
    for (effect, step) in diagnosis.effects.iter().zip(diagnosis.steps.iter().skip(1)) {
        model = edit::with_effect(MODEL.0, &model, effect, step.place.as_deref())?.text;
        let place = match &step.place {
            Some(place) => format!(" --where {place}"),
            None => String::new(),
        };
        let command = format!("ctid add {effect}{place} --model {}", MODEL.0);
        said += &format!("    {}\n", look.strong(command));
    }
    let line = model.lines().find(|line| line.starts_with("effects"));
    said += &format!("    {}\n\n", line.unwrap_or_default());
    Ok(said)
}

fn watch(diagnosis: &Diagnosis, look: Look) -> String {
    let text = match diagnosis.verdict {
        Verdict::Effect | Verdict::Undecided | Verdict::Partial => {
            "The same simulation, with the effect in the model. The residual is noise when the bars reach the noise \
             floor and the residual has no pattern."
        }
        Verdict::Unexplained | Verdict::Adequate => "The error, from step to step.",
    };
    let mut said = step(5, "Watch the error fall", text, look) + &terminal::trail(diagnosis, look);
    if let (Some(first), Some(last)) = (diagnosis.steps.first(), diagnosis.steps.last()) {
        let shown = if diagnosis.steps.len() > 1 {
            vec![first, last]
        } else {
            vec![first]
        };
        said += &terminal::residuals(diagnosis, &shown, look);
        said += &terminal::parameters(diagnosis, last, look);
    }
    said
}

fn end(report: &Path, look: Look) -> String {
    let report = report.strip_prefix(".").unwrap_or(report);
    let mut said = format!(
        "{}\n",
        look.good(format!(
            "{} holds all of this: open it in a browser.",
            report.display()
        ))
    );
    said +=
        "With data of your own (a CSV with time, input and output, and a model file as above):\n";
    for command in [
        "ctid compare  data.csv --model tank.toml --test other.csv",
        "ctid diagnose data.csv --model tank.toml --test other.csv --report report.html",
        "ctid add EFFECT --model tank.toml",
    ] {
        said += &format!("    {}\n", look.strong(command));
    }
    said
}
