//! Undecided records, the experiment that `ctid design` proposes for each, and what both records then say.
//!
//! `cargo run --release -p ctid-tests --example design -- 20` takes the rows of `design_cases.rs` seed by seed, which were
//! at hand when the design was made; with `--seed 1` the rigs are drawn at random instead.
//!
//! **The rule**: a record is a case where its diagnosis is *undecided* with the truth in the one group. The experiment is
//! designed between the truth and the best other of the group that is no twin of it, within half to one and a half of
//! the middle command (in a loop: of the level), as long as the record; where the design says that it has to be applied several times
//! over, it is. Where all are twins the record is no case, and is counted apart. The first so many cases are taken.
//!
//! **The columns**: `pair`: both records diagnosed together name the truth in their one group, and the other is not in it. `alone`:
//! nothing else is in the group either. `decides` is the probability of a decision that the design predicted for one application.

use clap::Parser;
use ctid_tests::design_cases::{
    Answer, ROWS, SEEDS, Undecided, answered, drawn, proposed, rig, undecided,
};
use ctid_tests::{Drive, Rig};
use missing_effect::design::Design;
use rayon::prelude::*;

/// Most records that are diagnosed side by side, and that are drawn.
const BATCH: usize = 24;
const MOST: u64 = 960;

#[derive(Parser)]
struct Arguments {
    /// Cases.
    #[arg(default_value_t = 20)]
    cases: usize,
    /// Draw the rigs at random from this seed.
    #[arg(long)]
    seed: Option<u64>,
}

struct Found {
    case: Undecided,
    plan: Result<(String, Design), Vec<String>>,
    answer: Option<Answer>,
}

fn found(rig: Rig, seed: u64) -> Option<Found> {
    let case = undecided(rig, seed)?;
    let plan = proposed(&case);
    let answer = match &plan {
        Ok((other, plan)) => answered(&case, other, plan, 1000 + seed),
        Err(_) => None,
    };
    Some(Found { case, plan, answer })
}

/// The records in their order, in batches of so many.
fn batches(seed: Option<u64>, batch: usize) -> Box<dyn Iterator<Item = Vec<Option<Found>>>> {
    match seed {
        None => Box::new(SEEDS.flat_map(move |seed| {
            let rows = ROWS.chunks(batch);
            rows.map(move |rows| rows.par_iter().map(|row| found(rig(row), seed)).collect())
        })),
        Some(seed) => Box::new((0..MOST).step_by(batch).map(move |first| {
            (first..(first + batch as u64).min(MOST))
                .into_par_iter()
                .map(|k| {
                    let number = seed * 1_000_000 + k;
                    found(drawn(number)?, number)
                })
                .collect()
        })),
    }
}

fn main() {
    let arguments = Arguments::parse();
    let (mut cases, mut pairs, mut alone, mut looked_at, mut twins) = (0, 0, 0, 0, 0);
    let mut promised = 0.0;
    println!(
        "case  plant                 loop  truth                 against               group  experiment               power  decides  times  pair  alone  then"
    );
    let batch = arguments.cases.clamp(2, BATCH);
    for found in batches(arguments.seed, batch).flatten() {
        if cases == arguments.cases {
            break;
        }
        looked_at += 1;
        let Some(Found { case, plan, answer }) = found else {
            continue;
        };
        let plant = case.rig.plant.id();
        let closed = if case.rig.drive == Drive::Closed {
            "yes"
        } else {
            "no"
        };
        let (other, plan) = match plan {
            Ok(found) => found,
            Err(others) => {
                twins += 1;
                println!(
                    "   -  {plant:<20}  {closed:<4}  {} and its twins {others:?}",
                    case.truth
                );
                continue;
            }
        };
        cases += 1;
        let best = &plan.candidates[0];
        let answer_of = |is: fn(&Answer) -> bool| answer.as_ref().is_some_and(is);
        let (pair, single) = (
            answer_of(|answer| answer.pair_decided),
            answer_of(|answer| answer.truth_alone),
        );
        pairs += usize::from(pair);
        alone += usize::from(single);
        promised += best.power.decides;
        let yes = |is| if is { "yes" } else { "no" };
        println!(
            "{cases:>4}  {plant:<20}  {closed:<4}  {:<20}  {other:<20}  {:>5}  {:<24} {:>5.0}  {:>7.2}  {:>5}  {:<4}  {:<5}  {}",
            case.truth,
            case.others.len() + 1,
            format!("{}, {:.0} s", best.kind.name(), best.clock),
            best.power.power,
            best.power.decides,
            plan.times_as_long.unwrap_or(1),
            yes(pair),
            yes(single),
            answer.map_or(String::new(), |answer| format!("{:?}", answer.groups)),
        );
    }
    println!(
        "{looked_at} records, {twins} of them undecided between twins alone; {cases} cases: the pair is decided for the truth in {pairs} ({promised:.1} predicted), the truth is left alone in {alone}"
    );
}
