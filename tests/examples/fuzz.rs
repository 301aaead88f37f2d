//! The program on inputs drawn at random: `cargo run --release -p ctid-tests --example fuzz -- 10000`.
//!
//! What counts as a fault is said at [`ctid_tests::fuzz::run`]. A fault is printed with the words that run its case again.

use std::process::ExitCode;

use clap::Parser;
use ctid_tests::fuzz::{Kind, as_program, run};
use indicatif::{ProgressBar, ProgressStyle};

/// Runs the program on records, model files, models as text, streams, saved states and requests drawn at random
#[derive(Debug, Parser)]
struct Cli {
    /// Cases of all kinds together
    #[arg(default_value_t = 1000)]
    cases: u64,
    /// Kinds: record, model, text, stream, state, request; all where none is given
    #[arg(long)]
    kind: Vec<Kind>,
    /// Number of the first case of a kind
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Also prints what was said where a case was refused
    #[arg(long)]
    refusals: bool,
}

fn main() -> ExitCode {
    if let Some(code) = as_program() {
        return code;
    }
    let cli = Cli::parse();
    let kinds = if cli.kind.is_empty() {
        Kind::ALL.to_vec()
    } else {
        cli.kind
    };
    let cases = cli.cases.div_ceil(kinds.len() as u64);
    let style = ProgressStyle::with_template("{msg:8} {wide_bar} {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let mut faults = 0;
    println!(
        "| what is drawn | cases | with a result | longest \\[s\\] | largest \\[MB\\] | faults |\n|---|---|---|---|---|---|"
    );
    for kind in kinds {
        let bar = ProgressBar::new(cases).with_style(style.clone());
        bar.set_message(kind.to_string());
        let report = run(kind, cli.first, cases, |done| bar.set_position(done));
        bar.finish_and_clear();
        println!(
            "| {kind} | {} | {} | {:.1} | {:.0} | {} |",
            report.cases,
            report.accepted,
            report.longest,
            report.largest,
            report.faults.len()
        );
        if cli.refusals {
            for (number, said) in &report.refusals {
                eprintln!("{kind} {number}: {said}");
            }
        }
        for (number, fault) in &report.faults {
            eprintln!("{kind} {number} (`fuzz 1 --kind {kind} --first {number}`): {fault}");
        }
        // A case that is lost is one too.
        faults += report.faults.len() + (cases - report.cases) as usize;
    }
    if faults == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
