//! Undecided records, the experiment that `ctid design` proposes for each, and what both records then say.
//!
//! `cargo run --release -p ctid-tests --example design -- 20`; the number of cases.
//!
//! **The rule**: the rows of `design_cases.rs` are gone through seed by seed; a record is a case where its diagnosis is *undecided*
//! with the truth in the one group. The experiment is designed between the truth and the best other of the group
//! that is no twin of it, within half to one and a half of the middle command (in a loop: of the level), as long as the record; where the
//! design says that it has to be played several times over, it is. Where all are twins the record is no case, and is counted apart. The first
//! so many cases are taken.
//!
//! **The columns**: `pair`: both records diagnosed together name the truth in their one group, and the other is not in it. `alone`:
//! nothing else is in the group either. `decides` is what the design had promised of playing it once.

use ctid_tests::Drive;
use ctid_tests::design_cases::{ROWS, SEEDS, answered, proposed, undecided};
use rayon::prelude::*;

fn main() {
    let wanted: usize = std::env::args()
        .nth(1)
        .and_then(|n| n.parse().ok())
        .unwrap_or(20);
    let (mut cases, mut pairs, mut alone, mut looked_at, mut twins) = (0, 0, 0, 0, 0);
    let mut promised = 0.0;
    println!(
        "case  plant     loop  truth              against            group  experiment               power  decides  times  pair  alone  then"
    );
    'all: for seed in SEEDS {
        // A row's record hangs on nothing but its seed: they are diagnosed side by side.
        let found: Vec<_> = ROWS
            .par_iter()
            .map(|row| {
                let case = undecided(row, seed)?;
                let plan = proposed(&case);
                let answer = match &plan {
                    Ok((other, plan)) => answered(&case, other, plan, 1000 + seed),
                    Err(_) => None,
                };
                Some((case, plan, answer))
            })
            .collect();
        for (row, found) in ROWS.iter().zip(found) {
            looked_at += 1;
            let Some((case, plan, answer)) = found else {
                continue;
            };
            let (other, plan) = match plan {
                Ok(found) => found,
                Err(others) => {
                    twins += 1;
                    println!(
                        "   -  {:<9} {:?}: {} and its twins {others:?}",
                        row.0, row.1, row.2
                    );
                    continue;
                }
            };
            cases += 1;
            let best = &plan.candidates[0];
            let answer_of =
                |is: fn(&ctid_tests::design_cases::Answer) -> bool| answer.as_ref().is_some_and(is);
            let (pair, single) = (
                answer_of(|answer| answer.pair_decided),
                answer_of(|answer| answer.truth_alone),
            );
            pairs += usize::from(pair);
            alone += usize::from(single);
            promised += best.power.decides;
            let yes = |is| if is { "yes" } else { "no" };
            println!(
                "{cases:>4}  {:<9} {:<5} {:<18} {other:<18} {:>5}  {:<24} {:>5.0}  {:>7.2}  {:>5}  {:<4}  {:<5}  {}",
                row.0,
                if row.1 == Drive::Closed { "yes" } else { "no" },
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
            if cases == wanted {
                break 'all;
            }
        }
    }
    println!(
        "{looked_at} records, {twins} of them undecided between twins alone; {cases} cases: the pair is decided for the truth in {pairs} ({promised:.1} promised), the truth is left alone in {alone}"
    );
}
