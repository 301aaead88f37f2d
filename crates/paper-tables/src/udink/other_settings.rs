//! Tables 1 to 4 with one setting changed: which changes the comparison with the paper would notice.
//!
//! The paper leaves much open, and agreement with its cells shows only that the settings are possible. The power of this comparison is
//! tested with wrong settings: those whose tables still count as consistent cannot be distinguished from the settings that are used.

use rayon::prelude::*;
use serde::Serialize;

use super::printed::TABLES;
use super::run::run_from;
use super::{Rule, Settings, Tables, comparison};
use crate::progress::in_parallel;
use crate::{Error, Progress, Stage};

/// Runs of each setting, at most.
const MOST_RUNS: usize = 100;

/// Other settings: name, and change.
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

/// The tables with one setting changed, with Euler's rule, compared with the paper's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Changed {
    /// The changed setting, in words.
    pub setting: &'static str,
    /// Cells inside.
    pub inside: usize,
    /// Cells.
    pub of: usize,
    /// Runs that failed.
    pub failed: usize,
    /// Whether the comparison detects the change: the tables are not [consistent](super::Comparison::consistent) with the paper's.
    pub noticed: bool,
}

/// Runs the tables with each of the other settings.
pub(super) fn with_other_settings(
    settings: &Settings,
    runs: usize,
    seed: u64,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<Changed>, Error> {
    let runs = runs.min(MOST_RUNS);
    let stage = Stage::UdinkOtherSettings;
    in_parallel(OTHERS.len(), stage, progress, |other| {
        let (setting, change) = OTHERS[other];
        let mut changed = *settings;
        change(&mut changed);
        let level = changed.noise_level(Rule::Euler);
        let tables: Vec<Tables> = (0..runs)
            .into_par_iter()
            .map(|run| by_euler(&changed, (level, &changed.noise(seed, run))))
            .collect::<Result<_, _>>()?;
        let found = comparison(&tables.iter().collect::<Vec<_>>(), Rule::Euler);
        Ok(Changed {
            setting,
            inside: found.inside,
            of: found.of,
            failed: found.failed,
            noticed: !found.consistent(),
        })
    })
}

/// All tables with one noise.
fn by_euler(settings: &Settings, noise: (f64, &[f64])) -> Result<Tables, Error> {
    let mut tables = [None; TABLES.len()];
    for (cells, table) in tables.iter_mut().zip(&TABLES) {
        *cells = run_from(settings, table, Rule::Euler, 1.0, noise, |_| {})?;
    }
    Ok(tables)
}
