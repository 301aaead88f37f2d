//! The controller of a record simulated on the measured signals.

use ct_signals::{Channel, Hold, Record};
use estimation::Triangle;
use plants::controller::{Controller, MAX_CONTROLLER_STATES};
use plants::{Dual, Scalar};

use crate::Error;

/// Checks that the reference of a record moves: a constant one drives nothing.
pub(crate) fn require_moving_reference(record: &Record) -> Result<(), Error> {
    match record.references.first().map(Channel::range) {
        Some((low, high)) if low.is_nan() || low >= high => Err(Error::ConstantReference {
            record: record.name.clone(),
            value: low,
        }),
        _ => Ok(()),
    }
}

/// The controller simulated on the measured signals.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// The controller's states when the record begins, those that fit the measured command best.
    pub states: Vec<f64>,
    /// The measured command less the controller's \[input unit\].
    pub beside: Vec<f64>,
    /// Root mean square of the additional input \[input unit\].
    pub rms: f64,
    /// The same at rows with a reading, without the largest hundredth of its values, one at least: before a controller begins, and in a hand's moves, the command is
    /// not its own.
    pub usual: f64,
    /// Standard deviation of the measured command \[input unit\].
    pub moves: f64,
}

/// Share of the additional input that may be anything.
const UNUSUAL: f64 = 0.01;
/// A command that differs by more than this number of usual differences is not the controller's: its row does not determine the initial
/// states.
const FOREIGN: f64 = 10.0;

/// Root mean square of the values without the largest ones, at rows with a reading.
fn usual(beside: &[f64], present: &[f64]) -> f64 {
    let with_reading = beside.iter().zip(present).filter(|(_, y)| !y.is_nan());
    let mut squares: Vec<f64> = with_reading.map(|(d, _)| d * d).collect();
    squares.sort_by(f64::total_cmp);
    let most = (UNUSUAL * squares.len() as f64).ceil() as usize;
    squares.truncate(squares.len().saturating_sub(most));
    rms(squares.into_iter())
}

fn rms(squares: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = squares.len().max(1) as f64;
    (squares.sum::<f64>() / count).sqrt()
}

/// The controller of these records: as it is given or, if that agrees better with the measured commands, with its integral updated first
/// ([`Controller::with_integral_first`]); and its replays, a record each.
pub(crate) fn fitting(
    controller: &Controller,
    replays: impl Fn(&Controller) -> Result<Vec<Replay>, Error>,
) -> Result<(Controller, Vec<Replay>), Error> {
    let given = replays(controller)?;
    let worst = |all: &[Replay]| all.iter().map(|replay| replay.usual).fold(0.0, f64::max);
    if let Some(other) = controller.with_integral_first() {
        let found = replays(&other)?;
        if worst(&found) < 0.5 * worst(&given) {
            return Ok((other, found));
        }
    }
    Ok((controller.clone(), given))
}

/// Rounds of the fit of initial states: without limits the first one is exact.
const ROUNDS: usize = 6;

/// Runs a controller on the measured reference and reading of a record, and compares the measured command with its own.
///
/// # Errors
/// Where the record has no reference, or its command is not held.
pub fn replay(controller: &Controller, record: &Record) -> Result<Replay, Error> {
    replay_of(controller, record, 0, Some(0))
}

/// As [`replay`], of the controller that drives an input, with the reference at a position.
pub(crate) fn replay_of(
    controller: &Controller,
    record: &Record,
    input: usize,
    reference: Option<usize>,
) -> Result<Replay, Error> {
    let Some(reference) = reference.and_then(|at| record.references.get(at)) else {
        return Err(Error::NoReference {
            record: record.name.clone(),
        });
    };
    if record.inputs[input].hold != Hold::Zero {
        return Err(Error::CommandNotHeld {
            record: record.name.clone(),
        });
    }
    record.validate()?;
    let Some(read) = record.outputs.get(controller.output()) else {
        return Err(Error::Outputs {
            record: record.name.clone(),
            given: record.outputs.len(),
            needed: controller.output() + 1,
        });
    };
    let (y, present) = (&read.interpolated(), &read.values);
    let (r, u) = (&reference.values, &record.inputs[input].values);
    let n = controller.states();
    // `of_controller`: the largest difference of a command that is the controller's.
    let run = |states: &[f64], known: &[f64], of_controller: f64| {
        let duals: Vec<Dual<MAX_CONTROLLER_STATES>> = states
            .iter()
            .enumerate()
            .map(|(lane, value)| Dual::variable(*value, lane))
            .collect();
        let mut regulator = controller.start(&duals);
        let mut triangle = Triangle::new(n + 1);
        let mut row = vec![0.0; n + 1];
        let mut beside = Vec::with_capacity(r.len());
        let mut squares = 0.0;
        for k in 0..r.len() {
            let h = step(record, k);
            // The controller used a reading that is missing in the record: the reading follows from the command, if this is within its
            // limits.
            let reading = match present[k].is_nan() {
                true => regulator.reading_for(r[k], u[k], h),
                false => None,
            };
            let reading = reading.unwrap_or(Dual::constant(y[k]));
            let given = regulator.command(r[k], reading, h);
            row[..n].copy_from_slice(&given.eps[..n]);
            row[n] = u[k] - given.re;
            beside.push(row[n]);
            let is_present = !present[k].is_nan();
            if is_present && known.get(k).is_none_or(|d| d.abs() <= of_controller) {
                triangle.push(&row);
                squares += row[n] * row[n];
            }
        }
        triangle.finish();
        (triangle, beside, squares)
    };
    let free: Vec<usize> = (0..n).collect();
    // Command at zero control error, for the state before saturation.
    let seen = controller.linear(1.0).c;
    let mut states: Vec<f64> = seen
        .iter()
        .map(|c| {
            c * (u[0] - controller.direct() * (r[0] - y[0])) / seen.iter().sum::<f64>().max(1.0)
        })
        .collect();
    let mut fitted = |known: &[f64], of_controller: f64| {
        let mut best = run(&states, known, of_controller);
        for _ in 0..ROUNDS {
            let step = best.0.solve(&free, &[], 0.0);
            let moved: Vec<f64> = states.iter().zip(&step).map(|(x, d)| x + d).collect();
            let next = run(&moved, known, of_controller);
            if next.2 >= best.2 || next.2.is_nan() {
                break;
            }
            (states, best) = (moved, next);
        }
        best.1
    };
    let mut beside = fitted(&[], f64::INFINITY);
    let of_controller = FOREIGN * usual(&beside, present);
    if beside.iter().any(|d| d.abs() > of_controller) {
        beside = fitted(&beside, of_controller);
    }
    let mean = u.iter().sum::<f64>() / u.len() as f64;
    let moves = (u.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / u.len() as f64).sqrt();
    Ok(Replay {
        rms: rms(beside.iter().map(|d| d * d)),
        usual: usual(&beside, present),
        states,
        beside,
        moves,
    })
}

/// The time from sample `k` to the next one, the last one as long as the one before.
pub(crate) fn step(record: &Record, k: usize) -> f64 {
    let k = k.min(record.len().saturating_sub(2));
    record
        .time
        .get(k + 1)
        .map_or(1.0, |next| next - record.time[k])
}
