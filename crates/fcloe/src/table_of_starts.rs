//! Table of starts from which the recursive estimator converges, compared with condition (14).
//!
//! A start is the true plant with its gain times one factor and its time scale times another, `B -> k B(t p)`,
//! `A -> A(t p)`; for `K/(1 + tau p)` these are `K0/K` and `tau0/tau`.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    Condition, Controller, Error, Filter, LoopSample, PlantModel, RecursiveFcloe,
    RecursiveSettings, Verdict,
};
use ct_rls::RecursiveEstimator;

/// The run from one start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StartRun {
    /// Gain of the start over that of the plant.
    pub gain_factor: f64,
    /// Time scale of the start over that of the plant.
    pub time_factor: f64,
    /// Condition (14) with the filter of the start.
    pub condition: Condition,
    /// The final estimates; none if the start's loop is not stable, so that there is no run.
    pub end: Option<Vec<f64>>,
    /// The largest relative error of a parameter at the end; infinite without a run.
    pub error: f64,
    /// Number of steps that were rejected to keep the loop stable.
    pub refused: u64,
}

/// Runs from a grid of starts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TableOfStarts {
    /// The filter of the runs.
    pub filter: Filter,
    /// Samples of a run.
    pub samples: usize,
    /// Gain factors outside, time factors inside.
    pub runs: Vec<StartRun>,
}

impl TableOfStarts {
    /// Runs the estimator over r and y, `step` apart, from each start, in parallel. The truth is that of the simulation, or a reliable
    /// estimate. None of its parameters may be 0.
    ///
    /// # Errors
    /// [`Error::SignalLength`]; [`Error::Setting`] for a factor that is not above 0; [`Error::UnstableLoop`] for the
    /// truth, and those of [`RecursiveFcloe::new`] other than for an unstable start.
    pub fn run(
        truth: &PlantModel,
        controller: &Controller,
        (step, r, y): (f64, &[f64], &[f64]),
        (gain_factors, time_factors): (&[f64], &[f64]),
        settings: RecursiveSettings,
    ) -> Result<Self, Error> {
        if r.len() != y.len() {
            return Err(Error::SignalLength {
                record: "the record".into(),
                signal: "r",
                expected: y.len(),
                found: r.len(),
            });
        }
        crate::ClosedLoop::new(truth, controller)?.require_stable()?;
        let pairs: Vec<(f64, f64)> = gain_factors
            .iter()
            .flat_map(|k| time_factors.iter().map(|t| (*k, *t)))
            .collect();
        let runs = pairs.into_par_iter().map(|factors| {
            let start = scaled(truth, factors)?;
            run_from(&start, factors, truth, controller, (step, r, y), settings)
        });
        Ok(Self {
            filter: settings.filter,
            samples: y.len(),
            runs: runs.collect::<Result<_, _>>()?,
        })
    }

    /// `(converged, all)` of the starts with this result of the condition: converged if every parameter is within `tolerance` (relative) at
    /// the end.
    pub fn converged(&self, verdict: Verdict, tolerance: f64) -> (usize, usize) {
        let such = || {
            self.runs
                .iter()
                .filter(|run| run.condition.verdict == verdict)
        };
        let good = such().filter(|run| run.error <= tolerance).count();
        (good, such().count())
    }
}

/// `n` factors from 1/5 to 5, evenly spaced on a logarithmic scale.
pub fn factors_to_five(n: usize) -> Vec<f64> {
    let last = n.saturating_sub(1).max(1) as f64;
    let at = |k: usize| 5.0_f64.powf(2.0 * k as f64 / last - 1.0);
    (0..n).map(at).collect()
}

fn scaled(truth: &PlantModel, (gain, time): (f64, f64)) -> Result<PlantModel, Error> {
    crate::controller::positive("a gain factor", gain)?;
    crate::controller::positive("a time factor", time)?;
    let power = |first: usize| move |(i, c): (usize, &f64)| c * time.powi((i + first) as i32);
    let a: Vec<f64> = truth.a().iter().enumerate().map(power(1)).collect();
    let b: Vec<f64> = truth.b().iter().enumerate().map(power(0)).collect();
    let b: Vec<f64> = b.iter().map(|b| gain * b).collect();
    PlantModel::new(&a, &b)
}

fn run_from(
    start: &PlantModel,
    (gain_factor, time_factor): (f64, f64),
    truth: &PlantModel,
    controller: &Controller,
    (step, r, y): (f64, &[f64], &[f64]),
    settings: RecursiveSettings,
) -> Result<StartRun, Error> {
    let mut run = StartRun {
        gain_factor,
        time_factor,
        condition: Condition::between(start, truth, controller)?,
        end: None,
        error: f64::INFINITY,
        refused: 0,
    };
    let mut estimator = match RecursiveFcloe::new(start, controller, settings) {
        Ok(estimator) => estimator,
        Err(Error::UnstableLoop { .. }) => return Ok(run),
        Err(error) => return Err(error),
    };
    for (&drive, &y) in r.iter().zip(y) {
        estimator.update(&LoopSample { drive, y }, step);
    }
    let end = estimator.theta().to_vec();
    let errors = end.iter().zip(truth.theta());
    run.error = errors.fold(0.0, |worst, (e, t)| (e / t - 1.0).abs().max(worst));
    run.end = Some(end);
    [_, run.refused, _] = estimator.counts();
    Ok(run)
}
