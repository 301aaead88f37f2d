//! Whether the measured u is what the controller makes of r and y.
//!
//! Method. The controller is run on the recorded r and y; its unknown initial state and the offset of u are fitted.
//! What is left is the mismatch. Noise on y that the controller never saw is part of it, so it is split: the
//! *systematic* part is what r explains, filtered by a ladder of lags `1/(1 + T p)`, less what chance would explain. A
//! wrong gain, sign or unit of time shows there; noise does not, because r knows nothing of it.
//!
//! Assumptions: r does what its hold says; y runs in straight lines between samples, or is held, whichever fits better.
//!
//! Limits: a controller that is sampled much more slowly than the record's dynamics is not the continuous one, and shows.

use ct_lti::{Hold, Simulator, StateSpace, TransferFunction};
use serde::Serialize;

use crate::normal_equations::NormalEquations;
use crate::{Controller, Error, LoopRecord, Offsets};

/// How far a controller is from the u that was measured, unit of u.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mismatch {
    /// Root mean square of what the controller does not explain.
    pub rms: f64,
    /// Root mean square of that part of it which follows r.
    pub systematic: f64,
    /// Standard deviation of u.
    pub size: f64,
}

/// Compares the controller with a record's u; none in open loop, and where u is not recorded or does not move.
///
/// # Errors
/// [`Error::Lti`] where the controller cannot be simulated at this step; a record that is not valid.
pub fn controller_mismatch(
    record: &LoopRecord,
    controller: &Controller,
) -> Result<Option<Mismatch>, Error> {
    record.validate()?;
    let (Some(r), Some(u)) = (&record.r, &record.u) else {
        return Ok(None);
    };
    let n = u.len() as f64;
    let mean = u.iter().sum::<f64>() / n;
    let size = (u.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / n).sqrt();
    if controller.is_open_loop() || size == 0.0 {
        return Ok(None);
    }
    let law = StateSpace::controllable(&controller.law()?)?;
    // Raw signals are what the controller acts on; a known point may hold a scaling's offset.
    let (r0, y0) = match record.offsets {
        Offsets::Known(point) => (point.r, point.y),
        _ => (0.0, 0.0),
    };
    let of_r = response(&law, record.r_hold, r.iter().map(|r| r - r0), record.step)?;
    let free = free_responses(&law, u.len(), record.step)?;
    let ladder = ladder(r, record)?;
    let own_columns: Vec<&[f64]> = free.iter().map(Vec::as_slice).collect();
    let all_columns: Vec<&[f64]> = free.iter().chain(&ladder).map(Vec::as_slice).collect();
    let mut best: Option<Mismatch> = None;
    for hold in [Hold::First, Hold::Zero] {
        let of_y = response(&law, hold, record.y.iter().map(|y| y - y0), record.step)?;
        let left: Vec<f64> = (0..u.len())
            .map(|k| u[k] - mean - (of_r[k] - of_y[k]))
            .collect();
        let Some(own) = explained(&own_columns, &left) else {
            continue;
        };
        let total: f64 = left.iter().map(|v| v * v).sum::<f64>();
        let rest = (total - own).max(0.0);
        let more = explained(&all_columns, &left).map_or(0.0, |both| (both - own).max(0.0));
        let by_chance = ladder.len() as f64 * (rest - more) / n;
        let found = Mismatch {
            rms: (rest / n).sqrt(),
            systematic: ((more - by_chance).max(0.0) / n).sqrt(),
            size,
        };
        if best.is_none_or(|best| found.rms < best.rms) {
            best = Some(found);
        }
    }
    Ok(best)
}

fn response(
    law: &StateSpace,
    hold: Hold,
    input: impl Iterator<Item = f64>,
    step: f64,
) -> Result<Vec<f64>, Error> {
    let mut simulator = Simulator::new(law.clone(), hold);
    let outputs = input.map(|v| simulator.update(v, step));
    Ok(outputs.collect::<Result<_, _>>()?)
}

/// A constant, and the controller's output from each of its states.
fn free_responses(law: &StateSpace, n: usize, step: f64) -> Result<Vec<Vec<f64>>, Error> {
    let mut columns = vec![vec![1.0; n]];
    for i in 0..law.order() {
        let mut simulator = Simulator::new(law.clone(), Hold::Zero);
        let mut state = vec![0.0; law.order()];
        state[i] = 1.0;
        simulator.set_state(&state)?;
        let outputs = (0..n).map(|_| simulator.update(0.0, step));
        columns.push(outputs.collect::<Result<_, _>>()?);
    }
    Ok(columns)
}

/// r through lags from the step to a quarter of the record, and r itself.
fn ladder(r: &[f64], record: &LoopRecord) -> Result<Vec<Vec<f64>>, Error> {
    let mean = r.iter().sum::<f64>() / r.len().max(1) as f64;
    let moves: Vec<f64> = r.iter().map(|r| r - mean).collect();
    let mut columns = vec![moves.clone()];
    let mut lag = record.step;
    while lag < 0.25 * record.step * r.len() as f64 {
        let filter = TransferFunction::from_coefficients(&[1.0], &[1.0, lag])?;
        let filter = StateSpace::controllable(&filter)?;
        columns.push(response(
            &filter,
            record.r_hold,
            moves.iter().copied(),
            record.step,
        )?);
        lag *= 3.0;
    }
    Ok(columns)
}

/// The part of `sum left^2` that lies in the span of the columns, dependent ones weighed down; none where there is
/// nothing to project on.
fn explained(columns: &[&[f64]], left: &[f64]) -> Option<f64> {
    let mut sums = NormalEquations::new(columns.len());
    let columns: Vec<(usize, &[f64])> = columns.iter().copied().enumerate().collect();
    sums.add(&columns, left);
    let factor = sums.factor(|i| 1e-9 * sums.jj(i, i))?;
    let x = factor.solve(|i| sums.je(i));
    let along: f64 = x.iter().enumerate().map(|(i, x)| x * sums.je(i)).sum();
    Some(2.0 * along - sums.length_squared(&x))
}
