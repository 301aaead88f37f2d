//! `ctid compare` and `ctid diagnose`: a physical model against records.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use greybox::FitOptions;
use missing_effect::Options;

use super::{Results, plant_options};
use crate::effort::EffortLevel;
use crate::finish::finish;
use crate::input::excitation;
use crate::input::{self, Files, Input, ReadArguments};
use crate::look::Look;
use crate::output::Kind;
use crate::own_model::report::{self, Paged};
use crate::own_model::{self, AnyModelFile, OwnModelFile, RecordNumbers};
use crate::progress::Bar;
use crate::{Error, terminal};

#[derive(Debug, Args)]
pub(super) struct Compare {
    /// Records (CSV); several are fitted together
    #[arg(required = true, value_name = "DATA.csv")]
    data: Vec<PathBuf>,
    /// Model file
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
    /// Held-out record: only scored, not used for fits or selection; may be repeated
    #[arg(long, value_name = "T.csv")]
    test: Vec<PathBuf>,
    /// In a loop with a known controller: simulate the loop from its reference (default), or run the model on the measured command
    #[arg(long = "loop", value_enum, value_name = "WAY")]
    way: Option<LoopWay>,
    /// Limit on the time of the search; Ctrl-C ends it earlier with the best result so far
    #[arg(long, value_enum, default_value_t = EffortLevel::Normal, value_name = "LEVEL")]
    effort: EffortLevel,
    /// Seed of the random starts for your own model: the result should not depend on it
    #[arg(long, default_value_t = FitOptions::default().seed, value_name = "N", hide = true)]
    seed: u64,
    #[command(flatten)]
    reading: ReadArguments,
    #[command(flatten)]
    results: Results,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LoopWay {
    Simulated,
    Measured,
}

#[derive(Debug, Args)]
pub(super) struct Diagnose {
    #[command(flatten)]
    compare: Compare,
    /// Write the shape of the unexplained error as CSV, for `ctid add NAME --from F`
    #[arg(long, value_name = "F.csv")]
    unknown: Option<PathBuf>,
    /// Largest number of effects to add
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..), allow_negative_numbers = true)]
    max_effects: Option<u8>,
}

impl Compare {
    fn files(&self) -> Files {
        Files {
            data: self.data.clone(),
            test: self.test.clone(),
            model: self.model.clone(),
            options: self.reading.options(),
        }
    }

    /// Notes on entries of the model file that have no effect, and on what the records cannot show.
    fn notes(waiting: &[String], input: &Input, look: Look) -> String {
        let Input { problem, summaries } = input;
        let note = |table: &String| {
            let name = table.split_once('.').map_or("", |(_, name)| name);
            look.paragraph(
                "",
                &format!("note: [{table}] has no effect until `ctid add {name}`"),
            )
        };
        let warnings = excitation::of_problem(problem);
        let warnings = warnings.iter().map(|it| look.warning_paragraph(it));
        let clock = greybox::common_clock(&problem.records).map(|_| {
            let names: Vec<&str> = problem.records.iter().map(|r| r.name.as_str()).collect();
            let what = "the time stamps continue from file to file, so drifts, steps and periods run through them";
            look.paragraph("", &format!("note: {}: {what}", names.join(", ")))
        });
        let notes = std::iter::once(input::notes(summaries, look));
        let notes = notes.chain(waiting.iter().map(note)).chain(clock);
        notes.chain(warnings).collect()
    }

    fn options(&self) -> Options<'static> {
        Options {
            simulate_loop: self.way != Some(LoopWay::Measured),
            ..plant_options(self.effort)
        }
    }

    pub(super) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = self.files();
        files.check_repetition()?;
        let model = match AnyModelFile::read(&self.model)? {
            AnyModelFile::Plant(model) => *model,
            AnyModelFile::Own(model) => return self.run_own(&model, &files, out, look),
        };
        let waiting = model.waiting.clone();
        let input = files.read_with(model)?;
        let outputs = self.results.plan(&files.all(), None)?;
        let options = self.options();
        let bar = Bar::with_limit(options.time_limit);
        bar.phase("fitting the model");
        let diagnosis = missing_effect::compare(&input.problem, &options);
        bar.clear();
        let diagnosis = diagnosis.map_err(|error| files.blame(error))?;
        finish(
            &diagnosis,
            &(Self::notes(&waiting, &input, look) + &terminal::comparison(&diagnosis, look)),
            &outputs,
            out,
            look,
        )
    }
}

/// Notes on effects whose numbers come from the records of this run.
fn not_kept(model: &OwnModelFile, used: &RecordNumbers, look: Look) -> String {
    let notes = model.not_kept(used).into_iter();
    notes
        .map(|note| look.paragraph("", &format!("note: {note}")))
        .collect()
}

/// Tables of a model file that a comparison does not use, in a line.
fn unused(tables: &[String], look: Look) -> String {
    const NAMED: usize = 3;
    if tables.is_empty() {
        return String::new();
    }
    let named: Vec<String> = tables
        .iter()
        .take(NAMED)
        .map(|table| format!("[{table}]"))
        .collect();
    let more = match tables.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let verb = if tables.len() == 1 { "has" } else { "have" };
    let note = format!(
        "note: {}{more} {verb} no part in a comparison",
        named.join(", ")
    );
    look.paragraph("", &note)
}

impl Compare {
    /// Options for a user's own model.
    fn own_options(&self) -> effect_search::Options<'static> {
        effect_search::Options {
            simulate_loop: self.way != Some(LoopWay::Measured),
            ..own_model::options(self.seed, self.effort)
        }
    }

    /// A user's own model.
    fn run_own(
        &self,
        model: &OwnModelFile,
        files: &Files,
        out: &mut dyn Write,
        look: Look,
    ) -> Result<(), Error> {
        let records = model.records(files)?;
        let outputs = self.results.plan(&files.all(), None)?;
        let options = self.own_options();
        let bar = Bar::with_limit(options.time_limit);
        bar.phase("fitting the model");
        let comparison = own_model::compare(model, &records, &options);
        bar.clear();
        let notes = model.unit_warnings(look)
            + &model.time_unit_warning(records.time_unit, look)
            + &input::notes(&records.summaries, look)
            + &unused(&model.unused, look);
        let comparison = comparison?;
        let notes = notes + &not_kept(model, &comparison.record_numbers, look);
        let text = notes + &own_model::said(model, &comparison, look);
        let page = outputs.iter().any(|output| output.kind() == Kind::Report);
        let page = page.then(|| report::compared(model, &records, &comparison));
        let found = Paged::new(&comparison, page.as_ref());
        finish(&found, &text, &outputs, out, look)
    }
}

impl Diagnose {
    pub(super) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = self.compare.files();
        files.check_repetition()?;
        let model = match AnyModelFile::read(&self.compare.model)? {
            AnyModelFile::Plant(model) => *model,
            AnyModelFile::Own(model) => return self.run_own(&model, &files, out, look),
        };
        let waiting = model.waiting.clone();
        let input = files.read_with(model)?;
        let unknown = self.unknown.as_deref();
        let outputs = self.compare.results.plan(&files.all(), unknown)?;
        let mut options = self.compare.options();
        if let Some(most) = self.max_effects {
            options.max_effects = usize::from(most);
        }
        let bar = Bar::with_limit(options.time_limit);
        let diagnosis =
            missing_effect::diagnose(&input.problem, &options, &|progress| bar.show(progress));
        bar.clear();
        let diagnosis = diagnosis.map_err(|error| files.blame(error))?;
        finish(
            &diagnosis,
            &(Compare::notes(&waiting, &input, look) + &terminal::diagnosis(&diagnosis, look)),
            &outputs,
            out,
            look,
        )
    }
    /// A user's own model.
    fn run_own(
        &self,
        model: &OwnModelFile,
        files: &Files,
        out: &mut dyn Write,
        look: Look,
    ) -> Result<(), Error> {
        let records = model.records(files)?;
        let unknown = self.unknown.as_deref();
        let outputs = self.compare.results.plan(&files.all(), unknown)?;
        let mut options = self.compare.own_options();
        if let Some(most) = self.max_effects {
            options.max_effects = usize::from(most);
        }
        let bar = Bar::with_limit(options.time_limit);
        let diagnosis = own_model::diagnose(model, &records, &options, &|progress| {
            bar.phase(progress.phase);
        });
        bar.clear();
        let diagnosis = diagnosis?;
        let text = model.unit_warnings(look)
            + &model.time_unit_warning(records.time_unit, look)
            + &input::notes(&records.summaries, look)
            + &not_kept(model, &diagnosis.record_numbers, look)
            + &own_model::diagnosis_said(model, &records, &diagnosis, look);
        let page = outputs.iter().any(|output| output.kind() == Kind::Report);
        let page = page.then(|| report::diagnosed(model, &records, &diagnosis));
        let unknown = diagnosis.unknown.as_ref().map(own_model::unknown_file);
        let found = Paged::new(&diagnosis, page.as_ref()).with_unknown(unknown);
        finish(&found, &text, &outputs, out, look)
    }
}
