//! Results of the diagnosis of simulated records with each threshold halved and doubled:
//!
//! ```sh
//! cargo run --release -p ctid-tests --example thresholds -- --records 24
//! ```
//! Records are drawn as `library_study` draws them: single effects of the catalogue, candidates of a user's own, nothing, and disturbances
//! that neither describes, in equal parts; the structural error is 1 or 3 times the noise, which is white or coloured. A record is used if
//! its diagnosis with the default thresholds ends within a quarter of the time limit, so that the limit does not influence the result.
//!
//! A column has three values: with half the threshold, with the default and with twice the default. Integer thresholds are rounded, and at
//! least 1. A record with a disturbance that neither describes is not counted if the effect that was found describes it as well.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use clap::Parser;
use ctid_examples::model_records::{DrivenModel, driven_models};
use ctid_tests::library::{Job, Outcome, jobs, outcome};
use effect_search::{Options, Thresholds};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde_json::{Map, Value};

/// Each threshold of a diagnosis halved and doubled.
#[derive(Debug, Parser)]
struct Arguments {
    /// Records, in equal parts of each kind.
    #[arg(long, default_value_t = 24)]
    records: usize,
    /// Seed of everything.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Names of the thresholds to test.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Models whose diagnoses are short.
    #[arg(long, value_delimiter = ',', default_values = ["heated-block", "mass-spring", "dc-motor", "battery"])]
    models: Vec<String>,
    /// Time limit of a diagnosis \[s\].
    #[arg(long, default_value_t = 20.0)]
    limit: f64,
}

/// Kinds of records, and their columns.
const KINDS: [(&str, usize); 4] = [("single", 0), ("own", 0), ("clean", 1), ("outside", 2)];
const COLUMNS: [&str; 3] = ["named", "clean not blamed", "outside not named"];

/// Records that take part have diagnoses that end within this share of the time limit.
const WITHIN: f64 = 0.25;

/// Factors of a threshold, in addition to its default.
const FACTORS: [f64; 2] = [0.5, 2.0];

/// Runs tasks on all processors. Each has a pool of one thread: a diagnosis that waits in a common pool takes up another record, and its
/// time passes.
fn in_parallel<T: Send>(tasks: usize, run: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
        let pool = pool.build().unwrap();
        let mut done = Vec::new();
        loop {
            let task = next.fetch_add(1, Ordering::Relaxed);
            if task >= tasks {
                return done;
            }
            done.push((task, pool.install(|| run(task))));
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let mut done: Vec<(usize, T)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers.min(tasks)).map(|_| scope.spawn(work)).collect();
        let results = threads.into_iter().map(|thread| thread.join().unwrap());
        results.flatten().collect()
    });
    done.sort_by_key(|(task, _)| *task);
    done.into_iter().map(|(_, result)| result).collect()
}

struct Study {
    models: Vec<DrivenModel>,
    seed: u64,
    limit: f64,
}

impl Study {
    /// Result of a record; `None` if the record cannot be generated or is not counted.
    fn outcome(&self, job: &Job, thresholds: Thresholds) -> Option<Outcome> {
        let options = Options {
            time_limit: Some(Duration::from_secs_f64(self.limit)),
            thresholds,
            ..Options::default()
        };
        outcome(job, &self.models, self.seed, &options, false).ok()
    }

    /// Records of a kind whose diagnoses are short, with what is said of them by default.
    fn chosen(&self, mut of_kind: Vec<Job>, wanted: usize) -> Vec<(Job, Outcome)> {
        // One of each combination of structural error and noise in turn.
        let mut seen: BTreeMap<(bool, bool), usize> = BTreeMap::new();
        of_kind.sort_by_cached_key(|job| {
            let count = seen.entry((job.ratio > 1.0, job.coloured)).or_default();
            *count += 1;
            *count
        });
        let mut chosen = Vec::new();
        for batch in of_kind.chunks(wanted.max(4)) {
            let outcomes = in_parallel(batch.len(), |i| {
                self.outcome(&batch[i], Thresholds::DEFAULT)
            });
            for (job, outcome) in batch.iter().zip(outcomes) {
                if let Some(outcome) = outcome
                    .filter(|outcome| !outcome.cut_short && outcome.elapsed < WITHIN * self.limit)
                {
                    chosen.push((job.clone(), outcome));
                }
            }
            if chosen.len() >= wanted {
                break;
            }
        }
        chosen.truncate(wanted);
        chosen
    }
}

/// The defaults with one of them times a factor.
fn scaled(all: &Map<String, Value>, name: &str, factor: f64) -> Thresholds {
    let mut all = all.clone();
    let value = match (all[name].as_u64(), all[name].as_f64()) {
        (Some(whole), _) => Value::from(((whole as f64 * factor).round() as u64).max(1)),
        (None, Some(value)) => Value::from(value * factor),
        (None, None) => all[name].clone(),
    };
    all.insert(name.to_string(), value);
    serde_json::from_value(Value::Object(all)).unwrap()
}

/// Number of correct records of a column, and number of counted ones.
fn right(jobs: &[Job], outcomes: &[Option<Outcome>], column: usize) -> String {
    let in_column = |job: &Job| KINDS.contains(&(job.kind, column));
    let pairs = jobs.iter().zip(outcomes).filter(|(job, _)| in_column(job));
    let counted: Vec<&Outcome> = pairs.filter_map(|(_, outcome)| outcome.as_ref()).collect();
    let right = counted.iter().filter(|outcome| outcome.right).count();
    format!("{right} of {}", counted.len())
}

fn median_seconds(outcomes: &[Option<Outcome>]) -> String {
    let counted = outcomes.iter().flatten();
    let mut seconds: Vec<f64> = counted.map(|outcome| outcome.elapsed).collect();
    seconds.sort_by(f64::total_cmp);
    let middle = seconds.get(seconds.len() / 2);
    middle.map_or("-".to_string(), |middle| format!("{middle:.2}"))
}

fn row(cells: &[String]) {
    println!("| {} |", cells.join(" | "));
}

fn main() {
    let arguments = Arguments::parse();
    let Value::Object(all) = serde_json::to_value(Thresholds::DEFAULT).unwrap() else {
        unreachable!("thresholds are an object");
    };
    for name in &arguments.only {
        if !all.contains_key(name) {
            let names: Vec<&String> = all.keys().collect();
            eprintln!("there is no threshold `{name}`: {names:?}");
            std::process::exit(2);
        }
    }
    let study = Study {
        models: driven_models().unwrap(),
        seed: arguments.seed,
        limit: arguments.limit,
    };
    let begun = Instant::now();
    let mut rng = ChaCha8Rng::seed_from_u64(arguments.seed);
    let mut drawn = jobs(&study.models, &arguments.models, &[1.0, 3.0], 1, &mut rng);
    drawn.shuffle(&mut rng);
    let mut records: Vec<Job> = Vec::new();
    let mut by_default: Vec<Option<Outcome>> = Vec::new();
    for (kind, _) in KINDS {
        let of_kind = drawn.iter().filter(|job| job.kind == kind);
        let wanted = arguments.records.div_ceil(KINDS.len());
        for (job, outcome) in study.chosen(of_kind.cloned().collect(), wanted) {
            let seconds = outcome.elapsed;
            eprintln!("{kind}: {}, {seconds:.1} s", job.name(&study.models));
            records.push(job);
            by_default.push(Some(outcome));
        }
    }
    let mut head = vec!["threshold".to_string(), "value".to_string()];
    head.extend(COLUMNS.map(|column| format!("{column}: half, default, double")));
    head.push("median s: half, default, double".to_string());
    row(&head);
    row(&vec!["---".to_string(); head.len()]);
    // In the order of the steps of a diagnosis.
    let text = serde_json::to_string(&Thresholds::DEFAULT).unwrap();
    let mut names: Vec<&String> = all.keys().collect();
    names.sort_by_key(|name| text.find(&format!("\"{name}\"")));
    let wanted = |name: &String| arguments.only.is_empty() || arguments.only.contains(name);
    for name in names.into_iter().filter(|name| wanted(name)) {
        let count = records.len();
        let both = FACTORS.map(|factor| scaled(&all, name, factor));
        let mut of_half = in_parallel(2 * count, |i| {
            study.outcome(&records[i % count], both[i / count])
        });
        let of_double = of_half.split_off(count);
        let three = [&of_half, &by_default, &of_double];
        let mut cells = vec![format!("`{name}`"), all[name].to_string()];
        for column in 0..COLUMNS.len() {
            cells.push(three.map(|of| right(&records, of, column)).join(", "));
        }
        cells.push(three.map(|of| median_seconds(of)).join(", "));
        row(&cells);
        let seconds = begun.elapsed().as_secs_f64();
        eprintln!("{name}, {seconds:.0} s since the beginning");
    }
}
