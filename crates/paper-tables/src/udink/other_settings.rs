//! What the comparison with tables 1 to 4 would notice, and the gain of which the paper says that it is slow.
//!
//! The paper leaves much open, and agreement with its cells says only that the settings can be so. How much it says is seen from settings
//! that are not so: those that are called consistent all the same are not told apart from the ones that are used.
//!
//! Reference: [`paper_udink`](super::paper_udink).

use std::sync::atomic::{AtomicUsize, Ordering};

use missing_effect::Progress;
use rayon::prelude::*;
use serde::Serialize;

use super::paper_udink::{CELLS, TABLES, Table};
use super::udink::{Tables, comparison};
use super::udink_run::{Cells, Rule, Settings, run_from};
use crate::Error;

/// What the runs with other settings are called.
pub const TITLE: &str = "What the comparison would not notice";

/// What the constant gains are called.
pub const SLOW: &str =
    "Constant gains: that of table 4, and the diagonal one that the paper found slow";

/// Runs of each setting, at most.
const RUNS: usize = 100;

/// Other settings: name, and what is changed.
type Other = (&'static str, fn(&mut Settings));

const OTHERS: [Other; 20] = [
    ("step 0.25 s instead of 0.3125 s", |s| s.dt = 0.25),
    ("step 0.5 s", |s| s.dt = 0.5),
    ("differences over 3 steps instead of 5", |s| s.span = 3),
    ("half a period of 21 s instead of 31.5 s", |s| {
        s.half_period = 21.0;
    }),
    ("half a period of 30 s", |s| s.half_period = 30.0),
    ("half a period of 42 s", |s| s.half_period = 42.0),
    ("half a period of 63 s", |s| s.half_period = 63.0),
    ("y0 = 0 instead of 0.5", |s| s.y0 = 0.0),
    ("y0 = 1", |s| s.y0 = 1.0),
    ("tau^(0) = 1 s instead of 0.95 s", |s| {
        s.time_constant_start = 1.0;
    }),
    ("tau^(0) = 2 s", |s| s.time_constant_start = 2.0),
    ("tau^(0) = 5 s", |s| s.time_constant_start = 5.0),
    ("K^(0) = 0.5 instead of 0", |s| s.gain_start = 0.5),
    ("c^(0) = 1 s instead of 0", |s| s.filter_start = 1.0),
    ("noise with 0.05 of the power instead of 0.1", |s| {
        s.noise_ratio = 0.05;
    }),
    ("noise with 0.2 of the power", |s| s.noise_ratio = 0.2),
    ("noise with 0.01 of the power (0.1 of amplitudes)", |s| {
        s.noise_ratio = 0.01;
    }),
    ("c_p = gamma = 0.5 instead of 1", |s| s.weight = 0.5),
    ("c_p = gamma = 2", |s| s.weight = 2.0),
    ("a tank with K = 1.02 and tau = 10.2 s", |s| {
        s.gain = 1.02;
        s.time_constant = 10.2;
    }),
];

/// The tables with one setting changed, by Euler's rule.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Changed {
    /// What is changed.
    pub setting: &'static str,
    /// Cells inside.
    pub inside: usize,
    /// Cells.
    pub of: usize,
    /// Runs that did not come to their end.
    pub failed: usize,
    /// Whether the comparison notices: it does not call the tables consistent.
    pub noticed: bool,
}

/// What can be said of the comparison's power.
#[must_use]
pub fn sentence(changed: &[Changed]) -> String {
    let unnoticed = changed.iter().filter(|changed| !changed.noticed).count();
    format!(
        "The tables by Euler's rule with one setting changed: {unnoticed} of {} changes leave the tables \"consistent\", cell by cell. So \
         much remains open after the comparison.",
        changed.len()
    )
}

/// Runs the tables with each of the other settings.
pub(super) fn power(
    settings: &Settings,
    runs: usize,
    seed: u64,
    progress: &(impl Fn(Progress) + Sync),
) -> Result<Vec<Changed>, Error> {
    let runs = runs.min(RUNS);
    let done = AtomicUsize::new(0);
    OTHERS
        .into_par_iter()
        .map(|(setting, change)| {
            let mut changed = *settings;
            change(&mut changed);
            let level = changed.noise_level(Rule::Euler);
            let tables: Vec<Tables> = (0..runs)
                .into_par_iter()
                .map(|run| of_noise(&changed, (level, &changed.noise(seed, run))))
                .collect::<Result<_, _>>()?;
            let found = comparison(&tables.iter().collect::<Vec<_>>(), Rule::Euler);
            progress(Progress {
                phase: "running tables 1 to 4 with other settings",
                done: done.fetch_add(1, Ordering::Relaxed) + 1,
                total: OTHERS.len(),
            });
            Ok(Changed {
                setting,
                inside: found.inside,
                of: found.of,
                failed: found.failed,
                noticed: !found.consistent(),
            })
        })
        .collect()
}

fn of_noise(settings: &Settings, noise: (f64, &[f64])) -> Result<Tables, Error> {
    let mut tables = [None; TABLES.len()];
    for (cells, table) in tables.iter_mut().zip(&TABLES) {
        *cells = run_from(settings, table, Rule::Euler, 1.0, noise, |_| {})?;
    }
    Ok(tables)
}

/// A constant gain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConstantGain {
    /// P1 and P2.
    pub gain: &'static str,
    /// How it is carried over a step.
    pub rule: Rule,
    /// Runs.
    pub runs: usize,
    /// Runs that did not come to their end.
    pub failed: usize,
    /// Medians of the criterion at 250, 500, 750 and 1000 s, s.
    pub criterion: [f64; 4],
    /// Median of the average of K^.
    pub gain_average: f64,
    /// Median of the average of tau^, s.
    pub time_constant_average: f64,
}

/// The constant gain of table 4, and the diagonal one that "was found to exhibit slow convergence" (section 6).
pub(super) fn constant_gains(
    settings: &Settings,
    runs: usize,
    seed: u64,
) -> Result<Vec<ConstantGain>, Error> {
    let [_, _, _, table_4] = TABLES;
    let diagonal = Table {
        p1: [0.8, 0.0, 0.008],
        p2: 0.8,
        ..table_4
    };
    let of = |name: &str| CELLS.iter().position(|cell| *cell == name).unwrap_or(0);
    let places = ["E250", "E500", "E750", "E1000", "K avg", "tau avg"].map(of);
    let runs = runs.min(RUNS);
    let mut found = Vec::new();
    for (gain, table) in [("of table 4", table_4), ("diag(0.8, 0.008), 0.8", diagonal)] {
        for rule in Rule::ALL {
            let level = settings.noise_level(rule);
            let cells: Vec<Option<Cells>> = (0..runs)
                .into_par_iter()
                .map(|run| {
                    let noise = settings.noise(seed, run);
                    run_from(settings, &table, rule, 1.0, (level, &noise), |_| {})
                })
                .collect::<Result<_, _>>()?;
            let [e250, e500, e750, e1000, gain_average, time_constant_average] =
                places.map(|place| super::median(cells.iter().flatten().map(|cells| cells[place])));
            found.push(ConstantGain {
                gain,
                rule,
                runs,
                failed: cells.iter().filter(|cells| cells.is_none()).count(),
                criterion: [e250, e500, e750, e1000],
                gain_average,
                time_constant_average,
            });
        }
    }
    Ok(found)
}
