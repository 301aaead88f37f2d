//! How often the diagnosis finds the effect that is hidden in a record of a model of `examples/models`:
//!
//! ```sh
//! cargo run --release -p ctid-tests --example library_study -- --sample 60
//! ```
//! Hidden are: every effect at every port, alone and in pairs; a candidate of the user's own, beside wrong candidates; nothing; and
//! disturbances that neither the catalogue nor a candidate describes. The true model is the text with other parameters and the effect; the
//! noise is scaled so that the residual of the refitted model without the effect, on the noise-free record, is 1 or 3 times the noise (root
//! mean square over the outputs). The start values of the parameters are up to 40 % off; some records have two parts, missing cells, or an
//! output that is sampled less often.
//!
//! A record counts if, with its true noise model, it shows the hidden effect. A miss is printed with a name that `--only` runs again.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use clap::Parser;
use ctid_examples::model_records::driven_models;
use ctid_tests::library::{Outcome, jobs, outcome};
use effect_search::{Options, Verdict};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// A study of simulated records of the model library.
#[derive(Debug, Parser)]
struct Arguments {
    /// Records in a cell.
    #[arg(long, default_value_t = 1)]
    records: u64,
    /// Number of records, drawn at random.
    #[arg(long)]
    sample: Option<usize>,
    /// Kinds of records: single, own, pair, clean, outside.
    #[arg(long, value_delimiter = ',', default_values = ["single", "own", "pair", "clean", "outside"])]
    kinds: Vec<String>,
    /// Names of the models; all if none is given.
    #[arg(long, value_delimiter = ',')]
    models: Vec<String>,
    /// Structural errors over the noise.
    #[arg(long, value_delimiter = ',', default_values_t = [1.0, 3.0])]
    ratios: Vec<f64>,
    /// Only records whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// Seed of everything.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Time limit of a diagnosis \[s\].
    #[arg(long, default_value_t = 40.0)]
    limit: f64,
    /// Diagnose records of a closed loop on their measured inputs.
    #[arg(long)]
    measured: bool,
    /// Says more of each record.
    #[arg(long)]
    verbose: bool,
}

fn main() {
    let arguments = Arguments::parse();
    let models = driven_models().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(arguments.seed);
    let mut jobs = jobs(
        &models,
        &arguments.models,
        &arguments.ratios,
        arguments.records,
        &mut rng,
    );
    jobs.retain(|job| {
        arguments.kinds.iter().any(|kind| kind == job.kind)
            && job.name(&models).contains(&arguments.only)
    });
    if let Some(sample) = arguments.sample {
        // The same number of each kind.
        jobs.shuffle(&mut rng);
        let share = sample.div_ceil(arguments.kinds.len());
        let mut taken: BTreeMap<&str, usize> = BTreeMap::new();
        jobs.retain(|job| {
            let count = taken.entry(job.kind).or_default();
            *count += 1;
            *count <= share
        });
    }
    let begun = Instant::now();
    let mut cells: BTreeMap<String, Vec<Outcome>> = BTreeMap::new();
    let mut skipped: BTreeMap<String, usize> = BTreeMap::new();
    let options = Options {
        time_limit: Some(Duration::from_secs_f64(arguments.limit)),
        simulate_loop: !arguments.measured,
        ..Options::default()
    };
    for job in &jobs {
        let name = job.name(&models);
        match outcome(job, &models, arguments.seed, &options, arguments.verbose) {
            Ok(outcome) => {
                if !outcome.right || arguments.verbose {
                    let mark = if outcome.right { "right" } else { "MISS" };
                    println!("{mark} {} `{name}`: {}", job.kind, outcome.told);
                }
                let noise = if job.coloured { "coloured" } else { "white" };
                let cell = match job.kind {
                    "clean" => format!("clean, {noise}"),
                    kind => format!("{kind}, {noise}, {}x", job.ratio),
                };
                cells.entry(cell).or_default().push(outcome.clone());
                cells
                    .entry(format!("{}, all", job.kind))
                    .or_default()
                    .push(outcome);
            }
            Err(why) => *skipped.entry(format!("{}: {why}", job.kind)).or_default() += 1,
        }
    }
    table(&cells);
    for (why, count) in skipped {
        println!("left out, {why}: {count}");
    }
    println!("{:.0} s", begun.elapsed().as_secs_f64());
}

fn table(cells: &BTreeMap<String, Vec<Outcome>>) {
    println!(
        "{:<26}{:>8}{:>8}{:>9}{:>8}{:>8}{:>8}{:>9}{:>9}{:>6}",
        "", "records", "right", "in group", "first", "group", "claims", "median s", "most s", "cut"
    );
    for (cell, outcomes) in cells {
        let share = |of: &dyn Fn(&Outcome) -> bool| {
            let count = outcomes.iter().filter(|o| of(o)).count();
            format!("{:.0} %", 100.0 * count as f64 / outcomes.len() as f64)
        };
        let middle = |of: &dyn Fn(&Outcome) -> f64| {
            let mut all: Vec<f64> = outcomes.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            (all[all.len() / 2], all[all.len() - 1])
        };
        let (median, most) = middle(&|o| o.seconds);
        println!(
            "{cell:<26}{:>8}{:>8}{:>9}{:>8}{:>8}{:>8}{median:>9.1}{most:>9.1}{:>6}",
            outcomes.len(),
            share(&|o| o.right),
            share(&|o| o.in_group),
            share(&|o| o.first),
            middle(&|o| o.group as f64).0,
            share(&|o| !matches!(o.verdict, Verdict::Adequate | Verdict::Unexplained)),
            outcomes.iter().filter(|o| o.cut_short).count(),
        );
    }
}
