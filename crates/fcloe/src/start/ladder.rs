//! Start values of the batch fit, from orders alone.
//!
//! For each bandwidth of a ladder: least squares, instruments up to three times, refinement. What comes out at each stage
//! is kept if its loop is stable, and ranked by how well its loop, simulated from r, gives the record. Which stage wins
//! depends on the noise, so all are tried: a bandwidth that is too high makes least squares useless, one that is too low
//! forgets the fast poles.

use ct_lti::Polynomial;
use serde::{Deserialize, Serialize};

use super::regression::{instruments, least_squares, srivc};
use super::signals::Signals;
use crate::controller::positive;
use crate::{ClosedLoop, Controller, Error, LoopRecord, Orders, PlantModel};

/// Bandwidths over the loop's poles.
const RUNGS: [f64; 4] = [2.0, 3.5, 6.0, 10.0];

/// Source of a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// Least squares.
    LeastSquares,
    /// Instruments from the loop.
    Instruments,
    /// SRIVC: filter and instruments updated with the estimates.
    Srivc,
    /// All poles at one place, and the gain from the correlation of y and u with r: no other candidate had a stable loop.
    Guess,
}

/// A plant with a stable loop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// The plant.
    pub plant: PlantModel,
    /// Source of the candidate.
    pub stage: Stage,
    /// Bandwidth of the first filter \[1/time\].
    pub lambda: f64,
    /// Root mean square of `y - y^` with its loop simulated from r, unit of y.
    pub residual_rms: f64,
}

/// Settings of the pipeline.
#[derive(Debug, Clone, PartialEq)]
pub struct PipelineSettings {
    /// Bandwidths \[1/time\]; empty for those of [`lambda_ladder`] without a guess.
    pub lambdas: Vec<f64>,
    /// Most regressions of a refinement.
    pub refinements: usize,
    /// Most candidates that are given.
    pub candidates: usize,
}

impl Default for PipelineSettings {
    fn default() -> Self {
        Self {
            lambdas: Vec::new(),
            refinements: 10,
            candidates: 3,
        }
    }
}

/// Bandwidths to try \[1/time\], ascending: 2 to 10 times the mean pole of the loop with the guess, or, without one, from
/// 10 over the longest record's duration to half the sampling rate, three to a decade.
///
/// # Errors
/// [`Error::NoRecord`]; [`Error::Setting`] for a sampling interval, or where the records are longer than the largest number;
/// [`Error::Lti`].
pub fn lambda_ladder(
    records: &[LoopRecord],
    controller: &Controller,
    guess: Option<&PlantModel>,
) -> Result<Vec<f64>, Error> {
    if let Some(guess) = guess {
        let p = ClosedLoop::new(guess, controller)?.characteristic().clone();
        let n = p.degree().unwrap_or(1).max(1) as f64;
        let pole = (p.coefficient(0) / p.leading()).abs().powf(1.0 / n);
        positive("the mean pole of the guess", pole)?;
        return Ok(RUNGS.map(|rung| rung * pole).to_vec());
    }
    let step = records.iter().map(|r| r.step).fold(f64::INFINITY, f64::min);
    if records.is_empty() {
        return Err(Error::NoRecord);
    }
    positive("the sampling interval", step)?;
    let length = |r: &LoopRecord| r.step * r.len() as f64;
    let longest = records.iter().map(length).fold(20.0 * step, f64::max);
    positive("the duration of the longest record", longest)?;
    let (low, high) = (10.0 / longest, 0.5 / step);
    let rungs = (3.0 * (high / low).log10()).ceil().max(1.0);
    let at = |k: usize| low * (high / low).powf(k as f64 / rungs);
    Ok((0..=rungs as usize).map(at).collect())
}

/// Candidates for the batch fit, the best first, without duplicates; the recursive estimator uses the first.
///
/// # Errors
/// Those of [`LoopRecord::validate`]; [`Error::NoRecord`]; [`Error::RegressionWithoutInput`], [`Error::MissingReference`];
/// [`Error::Setting`]; [`Error::NoStart`] where no plant that was tried has a stable loop.
pub fn pipeline(
    records: &[LoopRecord],
    controller: &Controller,
    orders: Orders,
    settings: &PipelineSettings,
) -> Result<Vec<Candidate>, Error> {
    orders.check()?;
    let lambdas = if settings.lambdas.is_empty() {
        lambda_ladder(records, controller, None)?
    } else {
        settings.lambdas.clone()
    };
    for record in records {
        Signals::measured(record, controller)?;
        record.drive(controller)?;
    }
    let mut found = Vec::new();
    let mut keep = |plant: &PlantModel, stage, lambda| {
        if let Some(residual_rms) = residual(records, controller, plant) {
            found.push(Candidate {
                plant: plant.clone(),
                stage,
                lambda,
                residual_rms,
            });
        }
    };
    for &lambda in &lambdas {
        positive("the filter's bandwidth lambda", lambda)?;
        let filter = Polynomial::new([lambda, 1.0])?.pow(orders.n);
        let Ok(first) = least_squares(records, controller, orders, &filter) else {
            continue;
        };
        keep(&first, Stage::LeastSquares, lambda);
        let mut last = first;
        for _ in 0..3 {
            let Ok(next) = instruments(records, controller, &filter, &last) else {
                break;
            };
            keep(&next, Stage::Instruments, lambda);
            last = next;
        }
        if let Ok(refined) = srivc(records, controller, &last, settings.refinements)
            && refined.iterations > 0
        {
            keep(&refined.plant, Stage::Srivc, lambda);
        }
    }
    if found.is_empty() {
        // Poles at the lower end of the range for which a filter of this bandwidth is suitable.
        for lambda in lambda_ladder(records, controller, None)? {
            for plant in guesses(records, controller, orders, lambda / RUNGS[2]) {
                if let Some(residual_rms) = residual(records, controller, &plant) {
                    found.push(Candidate {
                        plant,
                        stage: Stage::Guess,
                        lambda,
                        residual_rms,
                    });
                }
            }
        }
    }
    if found.is_empty() {
        return Err(Error::NoStart {
            tried: lambdas.len(),
        });
    }
    found.sort_by(|a, b| a.residual_rms.total_cmp(&b.residual_rms));
    let mut best: Vec<Candidate> = Vec::new();
    for candidate in found {
        if best.len() < settings.candidates.max(1)
            && !best
                .iter()
                .any(|other| alike(&other.plant, &candidate.plant))
        {
            best.push(candidate);
        }
    }
    Ok(best)
}

/// Within 1 %.
fn alike(a: &PlantModel, b: &PlantModel) -> bool {
    let mut pairs = a.theta().iter().zip(b.theta());
    pairs.all(|(a, b)| (a - b).abs() <= 0.01 * a.abs())
}

/// Error of the loop simulated from r; none if the loop is not stable.
fn residual(records: &[LoopRecord], controller: &Controller, plant: &PlantModel) -> Option<f64> {
    let closed = ClosedLoop::new(plant, controller).ok()?;
    if !closed.is_stable() {
        return None;
    }
    let (mut sum, mut samples) = (0.0, 0);
    for record in records {
        let simulated = Signals::simulated(plant, record, controller).ok()?;
        let level = record.operating_point().y;
        let readings = record.y.iter().zip(&simulated.y);
        let errors = readings
            .filter(|(y, _)| !y.is_nan())
            .map(|(y, m)| y - level - m);
        sum += errors.map(|e| e * e).sum::<f64>();
        samples += record.readings();
    }
    let rms = (sum / samples.max(1) as f64).sqrt();
    rms.is_finite().then_some(rms)
}

/// `K/(1 + p/pole)^n` with the gain from the correlation of y and u with r, and fractions of it; in open loop, with u.
fn guesses(
    records: &[LoopRecord],
    controller: &Controller,
    orders: Orders,
    pole: f64,
) -> Vec<PlantModel> {
    let (mut ry, mut ru) = (0.0, 0.0);
    for record in records {
        let (Ok(signals), Ok((drive, _))) = (
            Signals::measured(record, controller),
            record.drive(controller),
        ) else {
            continue;
        };
        let mean = drive.iter().sum::<f64>() / drive.len().max(1) as f64;
        let rows = drive.iter().zip(&signals.y).zip(&signals.u);
        for ((r, y), u) in rows.filter(|((_, y), _)| !y.is_nan()) {
            ry += (r - mean) * y;
            ru += (r - mean) * u;
        }
    }
    let guess = |share: f64| {
        let a = Polynomial::new([1.0, 1.0 / pole]).ok()?.pow(orders.n);
        let mut b = vec![0.0; orders.m + 1];
        b[0] = share * ry / ru;
        PlantModel::new(&a.coefficients()[1..], &b).ok()
    };
    [1.0, 0.3, 0.1].into_iter().filter_map(guess).collect()
}
