//! `ctid tables`: the tables of a paper, computed again.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use paper_tables::{baysse, udink};

use super::Results;
use crate::Error;
use crate::design::seed;
use crate::finish::finish;
use crate::look::Look;
use crate::output::{self, Kind};
use crate::progress::Bar;
use crate::tables::progress::for_bar;
use crate::tables::results::Studies;
use crate::tables::{baysse_text, udink_text};

#[derive(Debug, Args)]
pub(super) struct Tables {
    /// The paper
    #[arg(value_enum, default_value_t = Paper::Udink)]
    paper: Paper,
    /// Number of noises: each table is run once with each; by default the number for which a paper's bands are valid, 200 or 100
    #[arg(long, value_name = "N", value_parser = runs, allow_negative_numbers = true)]
    runs: Option<usize>,
    /// Seed of the noise
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    seed: u64,
    /// Write the record of baysse's emulated rig as CSV, for `diagnose` or `identify`
    #[arg(long, value_name = "F.csv")]
    record: Option<PathBuf>,
    #[command(flatten)]
    results: Results,
}

/// Number of runs; the limits depend on the paper.
fn runs(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| {
        let (udink, baysse) = (udink::FEWEST, baysse::FEWEST);
        format!("a whole number is needed, {udink} or more for udink, {baysse} or more for baysse")
    })
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Paper {
    /// A. J. Udink ten Cate, WP-85-54, IIASA, 1985: tables 1 to 4
    Udink,
    /// A. Baysse, F. J. Carrillo, A. Habbadi, output error in closed loop: tables I and II
    Baysse,
    /// Both
    All,
}

/// Number of runs for which the bands of each paper are valid.
const RUNS_UDINK: usize = 200;
const RUNS_BAYSSE: usize = 100;

impl Tables {
    pub(super) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        if self.record.is_some() && !matches!(self.paper, Paper::Baysse) {
            let what = "--record belongs to the rig that `ctid tables baysse` emulates; no other paper has one";
            return Err(Error::Usage(what.to_owned()));
        }
        if self.results.report.is_some() && matches!(self.paper, Paper::All) {
            let what = "--report is a page for one paper; run `ctid tables udink` and `ctid tables baysse`";
            return Err(Error::Usage(what.to_owned()));
        }
        let record = self.record.as_deref().map(|path| (Kind::Record, path));
        let wanted: Vec<_> = self.results.wanted().chain(record).collect();
        let outputs = output::plan(&wanted, &[])?;
        let bar = Bar::new();
        let progress = |progress| bar.show(for_bar(progress));
        let udink = || {
            let runs = self.runs.unwrap_or(RUNS_UDINK);
            let study = udink::study(&udink::Settings::default(), runs, self.seed, &progress);
            bar.clear();
            study
        };
        let baysse = || {
            let runs = self.runs.unwrap_or(RUNS_BAYSSE);
            let study = baysse::study(runs, self.seed, &progress);
            bar.clear();
            study
        };
        match self.paper {
            Paper::Udink => {
                let study = udink()?;
                finish(&study, &udink_text::text(&study, look), &outputs, out, look)
            }
            Paper::Baysse => {
                let study = baysse()?;
                let text = baysse_text::text(&study, look);
                finish(&study, &text, &outputs, out, look)
            }
            Paper::All => {
                let studies = Studies {
                    schema: 1,
                    udink: udink()?,
                    baysse: baysse()?,
                };
                let first = udink_text::text(&studies.udink, look);
                let text = first + "\n" + &baysse_text::text(&studies.baysse, look);
                finish(&studies, &text, &outputs, out, look)
            }
        }
    }
}
