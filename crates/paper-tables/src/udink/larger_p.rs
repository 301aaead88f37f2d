//! Table 1 with larger `P(0)`. The paper warns that a large `P(0)` leads to numerical difficulties (section 6).

use serde::Serialize;

use super::printed::{CELLS, TABLES};
use super::run::run_from;
use super::{Rule, Settings, median};
use crate::progress::in_parallel;
use crate::{Error, Progress, Stage};

/// Factors of `P(0)`.
const FACTORS: [f64; 12] = [
    1.0, 10.0, 15.0, 18.0, 20.0, 30.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e8,
];

/// Runs for each factor, at most.
const MOST_RUNS: usize = 50;

/// Table 1 with `P(0)` times a factor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LargerP {
    /// The factor, 1 to 1e8.
    pub factor: f64,
    /// Runs, at most 50.
    pub runs: usize,
    /// Runs that failed by Euler's rule.
    pub euler_failed: usize,
    /// Runs that failed by the exact step.
    pub exact_failed: usize,
    /// Median of the criterion (6.2) at 1000 s by Euler's rule, of the runs that did not fail, s; NaN where all did.
    pub euler_criterion: f64,
    /// Criterion with the exact step.
    pub exact_criterion: f64,
}

/// Results of each factor with the first of the tables' noises.
pub(super) fn larger_p(
    settings: &Settings,
    runs: usize,
    seed: u64,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<LargerP>, Error> {
    let runs = runs.min(MOST_RUNS);
    let [table, ..] = &TABLES;
    let place = CELLS.iter().position(|name| *name == "E1000");
    let total = FACTORS.len() * runs;
    let levels = Rule::ALL.map(|rule| settings.noise_level(rule));
    let criteria: Vec<[Option<f64>; 2]> =
        in_parallel(total, Stage::UdinkLargerP, progress, |index| {
            let factor = FACTORS[index / runs];
            let noise = settings.noise(seed, index % runs);
            let mut criterion = [None; 2];
            for ((rule, level), criterion) in Rule::ALL.iter().zip(levels).zip(&mut criterion) {
                let cells = run_from(settings, table, *rule, factor, (level, &noise), |_| {})?;
                *criterion = cells.zip(place).map(|(cells, place)| cells[place]);
            }
            Ok(criterion)
        })?;
    Ok(FACTORS
        .iter()
        .zip(criteria.chunks(runs))
        .map(|(&factor, runs)| {
            let of = |rule: usize| runs.iter().filter_map(move |run| run[rule]);
            let failed = |rule| runs.len() - of(rule).count();
            LargerP {
                factor,
                runs: runs.len(),
                euler_failed: failed(0),
                exact_failed: failed(1),
                euler_criterion: median(of(0)),
                exact_criterion: median(of(1)),
            }
        })
        .collect())
}
