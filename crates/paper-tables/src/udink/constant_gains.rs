//! Constant gains on the experiment of table 4: that of the table, and a diagonal one, which the paper "found to exhibit slow convergence"
//! (section 6).

use rayon::prelude::*;
use serde::Serialize;

use super::printed::{CELLS, TABLES, Table};
use super::run::{Cells, run_from};
use super::{Rule, Settings, median};
use crate::Error;

/// Runs of each gain, at most.
const MOST_RUNS: usize = 100;

/// A constant gain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConstantGain {
    /// P1 and P2, in words.
    pub gain: &'static str,
    /// Integration rule.
    pub rule: Rule,
    /// Runs, at most 100.
    pub runs: usize,
    /// Runs that failed.
    pub failed: usize,
    /// Medians of the criterion (6.2) at 250, 500, 750 and 1000 s, s.
    pub criterion: [f64; 4],
    /// Median of the average of K^.
    pub gain_average: f64,
    /// Median of the average of tau^, s.
    pub time_constant_average: f64,
}

/// Both gains with both rules. The paper prints no figures of the diagonal one.
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
    let runs = runs.min(MOST_RUNS);
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
                places.map(|place| median(cells.iter().flatten().map(|cells| cells[place])));
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
