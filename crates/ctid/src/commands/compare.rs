//! `ctid compare` and `ctid diagnose`: a physical model against records.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use missing_effect::{Options, Problem};

use super::{Results, finish};
use crate::input::Files;
use crate::look::Look;
use crate::progress::Bar;
use crate::{Error, terminal};

/// What waits in the model file, and all that was read.
fn read(files: &Files) -> Result<(Vec<String>, Problem), Error> {
    let model = files.read_model()?;
    Ok((model.waiting.clone(), files.read_with(model)?))
}

#[derive(Debug, Args)]
pub(super) struct Compare {
    /// Records (CSV); several are fitted together
    #[arg(required = true, value_name = "DATA.csv")]
    data: Vec<PathBuf>,
    /// Model file
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
    /// Held-out record: takes no part in any fit or choice, and is only scored; may be repeated
    #[arg(long, value_name = "T.csv")]
    test: Vec<PathBuf>,
    /// In a loop whose [controller] is known: simulate it from its reference, or run on the measured command
    #[arg(long = "loop", value_enum, default_value_t = LoopWay::Simulated, value_name = "WAY")]
    way: LoopWay,
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
    /// Write the shape of what nothing explains as CSV, for `ctid add NAME --from F`
    #[arg(long, value_name = "F.csv")]
    unknown: Option<PathBuf>,
    /// Add at most so many effects
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..), allow_negative_numbers = true)]
    max_effects: Option<u8>,
}

impl Compare {
    fn files(&self) -> Files {
        Files {
            data: self.data.clone(),
            test: self.test.clone(),
            model: self.model.clone(),
        }
    }

    /// What stands in the model file and has no effect, where there is such.
    fn notes(waiting: &[String], look: Look) -> String {
        let note = |table: &String| {
            let name = table.split_once('.').map_or("", |(_, name)| name);
            look.paragraph(
                "",
                &format!("note: [{table}] has no effect until `ctid add {name}`"),
            )
        };
        waiting.iter().map(note).collect()
    }

    fn options(&self) -> Options<'static> {
        Options {
            simulate_loop: self.way == LoopWay::Simulated,
            ..Options::default()
        }
    }

    pub(super) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = self.files();
        let (waiting, problem) = read(&files)?;
        let outputs = self.results.plan(&files.all(), None)?;
        let bar = Bar::new();
        bar.phase("fitting the model");
        let diagnosis = missing_effect::compare(&problem, &self.options());
        bar.clear();
        let diagnosis = diagnosis.map_err(|error| files.blame(error))?;
        finish(
            &diagnosis,
            &(Self::notes(&waiting, look) + &terminal::comparison(&diagnosis, look)),
            &outputs,
            out,
            look,
        )
    }
}

impl Diagnose {
    pub(super) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = self.compare.files();
        let (waiting, problem) = read(&files)?;
        let unknown = self.unknown.as_deref();
        let outputs = self.compare.results.plan(&files.all(), unknown)?;
        let mut options = self.compare.options();
        if let Some(most) = self.max_effects {
            options.max_effects = usize::from(most);
        }
        let bar = Bar::new();
        let diagnosis =
            missing_effect::diagnose(&problem, &options, &|progress| bar.show(progress));
        bar.clear();
        let diagnosis = diagnosis.map_err(|error| files.blame(error))?;
        finish(
            &diagnosis,
            &(Compare::notes(&waiting, look) + &terminal::diagnosis(&diagnosis, look)),
            &outputs,
            out,
            look,
        )
    }
}
