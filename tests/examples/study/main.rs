//! How often a hidden effect is named rightly: `cargo run --release -p ctid-tests --example study` prints the tables of
//! `docs/study.md`.
//!
//! Every effect of the catalogue, in four sizes, in open and closed loop, under white and coloured noise, in plants that
//! are drawn at random; pairs of effects; records that miss nothing, also under integrated noise; and disturbances that the
//! catalogue does not hold. `--records 2 --pairs 2` is a quick run. Every record has a seed of its own, whatever else is run.

mod as_text;
mod mark;
mod outcome;
mod record;
mod table;

use std::{
    collections::BTreeMap,
    error::Error,
    fs,
    path::PathBuf,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    time::Instant,
};

use clap::Parser;
use ctid_tests::{Drive, draw::Levels};
use indicatif::{ProgressBar, ProgressStyle};
use outcome::Outcome;
use plants::{CATALOGUE, EffectInfo};
use record::{Job, kinds_of_unknown};
use serde_json::json;

/// Structural error over noise.
const RATIOS: [f64; 4] = [0.5, 1.0, 3.0, 10.0];
/// Ratios of each effect of a pair alone.
const PAIR_RATIOS: [f64; 2] = [1.0, 3.0];

/// A study of simulated records: how often an effect is seen, named, and named rightly.
#[derive(Debug, Parser)]
struct Arguments {
    /// Records in a cell.
    #[arg(long, default_value_t = 20)]
    records: u64,
    /// Effects, all where none is given.
    #[arg(long, value_delimiter = ',')]
    effects: Vec<String>,
    /// Of two tanks both levels are measured, each with separate noise; no other plants are drawn. Single effects only.
    #[arg(long)]
    both_levels: bool,
    /// Structural errors over the noise.
    #[arg(long, value_delimiter = ',', default_values_t = RATIOS)]
    ratios: Vec<f64>,
    /// Records with a pair of effects in a cell.
    #[arg(long, default_value_t = 20)]
    pairs: u64,
    /// Records in which nothing is missing.
    #[arg(long, default_value_t = 200)]
    null: u64,
    /// Records in which nothing is missing, with white noise beside a random walk, and time stamps that jitter by 3 %.
    #[arg(long, default_value_t = 100)]
    integrated: u64,
    /// Records of each disturbance from outside the catalogue.
    #[arg(long, default_value_t = 20)]
    unknown: u64,
    /// Samples of a record.
    #[arg(long, default_value_t = 600)]
    samples: usize,
    /// Records that are diagnosed at a time, each on one core; all cores where none is given.
    #[arg(long)]
    threads: Option<usize>,
    /// Only records whose name contains this, as `nothing 83` or `closed, coloured 4`.
    #[arg(long, default_value = "")]
    only: String,
    /// For records whose effect is not in the group, also reports whether an exhaustive refit with the known noise spectrum names the
    /// effect.
    #[arg(long)]
    mark: bool,
    /// The plants are diagnosed as models written as text; the effects have their names in the catalogue of tanks.
    #[arg(long)]
    text: bool,
    /// Writes every record's outcome.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Writes the tables as Markdown.
    #[arg(long)]
    markdown: Option<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let begun = Instant::now();
    let effects = chosen(&arguments.effects)?;
    let levels = if arguments.both_levels {
        Levels::Both
    } else {
        Levels::Last
    };
    let mut jobs = Vec::new();
    for &effect in &effects {
        for &ratio in &arguments.ratios {
            for drive in [Drive::Open, Drive::Closed] {
                for coloured in [false, true] {
                    jobs.extend((0..arguments.records).map(|number| Job::Effect {
                        effect,
                        levels,
                        ratio,
                        drive,
                        coloured,
                        number,
                    }));
                }
            }
        }
    }
    let others = !arguments.both_levels;
    for ratio in PAIR_RATIOS.into_iter().filter(|_| others) {
        for drive in [Drive::Open, Drive::Closed] {
            for coloured in [false, true] {
                jobs.extend((0..arguments.pairs).map(|number| Job::Pair {
                    ratio,
                    drive,
                    coloured,
                    number,
                }));
            }
        }
    }
    jobs.extend((0..arguments.null).map(|number| Job::Nothing { levels, number }));
    jobs.extend(
        (0..arguments.integrated)
            .filter(|_| others)
            .map(Job::Integrated),
    );
    for kind in (0..kinds_of_unknown()).filter(|_| others) {
        jobs.extend((0..arguments.unknown).map(|number| Job::Unknown { kind, number }));
    }
    jobs.retain(|job| job.name().contains(&arguments.only));
    let threads = arguments
        .threads
        .or_else(|| std::thread::available_parallelism().ok().map(usize::from))
        .unwrap_or(1);
    let outcomes = each(&jobs, threads, &arguments)?;

    let seconds = begun.elapsed().as_secs_f64();
    let took = format!(
        "{} records of {} samples in {:.0} min on {threads} cores, {:.2} s of one core each.",
        outcomes.len(),
        arguments.samples,
        seconds / 60.0,
        seconds * threads as f64 / outcomes.len().max(1) as f64
    );
    print!("{}", table::text(&jobs, &outcomes));
    println!("{took}");
    if let Some(path) = &arguments.markdown {
        fs::write(
            path,
            table::markdown(&jobs, &outcomes) + "\n" + &took + "\n",
        )?;
        println!("wrote {}", path.display());
    }
    if let Some(path) = &arguments.json {
        let records: Vec<_> = jobs
            .iter()
            .zip(&outcomes)
            .map(|(job, outcome)| json!({ "record": job.name(), "outcome": outcome.as_json() }))
            .collect();
        let all = json!({ "seconds": seconds, "threads": threads, "records": records });
        fs::write(path, serde_json::to_string_pretty(&all)? + "\n")?;
        println!("wrote {}", path.display());
    }
    Ok(())
}

fn chosen(names: &[String]) -> Result<Vec<&'static EffectInfo>, String> {
    if names.is_empty() {
        return Ok(CATALOGUE.to_vec());
    }
    names
        .iter()
        .map(|name| EffectInfo::find(name).ok_or(format!("there is no effect {name}")))
        .collect()
}

/// The outcomes in the order of the jobs. A record is diagnosed on one core: many records keep all cores busier than many
/// threads a record, and its seconds are then those of one core.
fn each(
    jobs: &[Job],
    threads: usize,
    arguments: &Arguments,
) -> Result<Vec<Outcome>, Box<dyn Error>> {
    let bar = ProgressBar::new(jobs.len() as u64).with_style(ProgressStyle::with_template(
        "{bar:40} {pos}/{len} {elapsed} (left: {eta}) {msg}",
    )?);
    let (next, done) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    let pools = (0..threads)
        .map(|_| rayon::ThreadPoolBuilder::new().num_threads(1).build())
        .collect::<Result<Vec<_>, _>>()?;
    std::thread::scope(|scope| {
        for pool in &pools {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(job) = jobs.get(at) else { break };
                    let outcome =
                        pool.install(|| job.run(arguments.samples, arguments.mark, arguments.text));
                    bar.set_message(job.name());
                    bar.inc(1);
                    if let Ok(mut done) = done.lock() {
                        done.insert(at, outcome);
                    }
                }
            });
        }
    });
    bar.finish_and_clear();
    Ok(done
        .into_inner()
        .map_err(|_| "a thread broke down")?
        .into_values()
        .collect())
}
