//! Checks whether the measured u is the output of the controller for r and y.
//!
//! Method. The controller is simulated on the recorded r and y, and its output compared with u. Both are filtered by `H = (p/(p +
//! lambda))^q` with q the number of integrators in S and 1/lambda a twentieth of the record; otherwise noise on y that the controller did
//! not read would be integrated to a random walk, which correlates with anything. The unknown initial states and the offset of u are
//! fitted. The difference is the mismatch. It contains noise, so it is split: its *systematic* part is what a regression on r, filtered by
//! several lags `1/(1 + T p)`, explains, less what noise with the same spectrum would explain. A wrong gain, sign or unit of time is in the
//! systematic part; noise is not, because it is independent of r.
//!
//! Assumptions: r does what its hold says; y is linear between samples, or is held, whichever fits better. Where readings of y are
//! missing, y is interpolated linearly between the available ones: the response of the controller to the missing readings adds to the
//! mismatch, but is small compared with 10 % of u unless gaps are long and many.
//!
//! Limits: what is wrong only at frequencies below lambda is not seen; a controller that is sampled much more slowly than the record's
//! dynamics is not the continuous one, and shows.

use ct_lti::{Hold, Polynomial, Simulator, StateSpace, TransferFunction};
use ct_signals::ArModel;
use estimation::Triangle;
use serde::Serialize;

use crate::{Controller, Error, LoopRecord, Offsets};

/// Frequencies below this over the length of the record are left out.
const SLOWEST: f64 = 20.0;

/// Added to the diagonal, as a share of it, so that dependent columns do no harm.
const RIDGE: f64 = 1e-9;

/// Difference between the controller's output and the measured u, unit of u.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mismatch {
    /// Added to the diagonal, as a share of it, to regularise dependent columns.
    pub rms: f64,
    /// Root mean square of that part of it which follows r.
    pub systematic: f64,
    /// Root mean square of the part of it that is correlated with r.
    pub by_chance: f64,
    /// Root mean square of u, without its slowest changes if the controller integrates.
    pub size: f64,
}

/// The controller acts on raw signals; a known operating point may contain an offset of the scaling.
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
    if controller.is_open_loop() || record.is_empty() {
        return Ok(None);
    }
    let (n, length) = (u.len() as f64, record.step * u.len() as f64);
    let law = controller.law()?;
    let s = law.denominator().coefficients();
    let integrators = s.iter().take_while(|s| **s == 0.0).count();
    let slow = Polynomial::new([SLOWEST / length, 1.0])?.pow(integrators);
    let rest = &Polynomial::new(&s[integrators..])? * &slow;
    let law = TransferFunction::new(law.numerator().clone(), rest)?;
    let law = StateSpace::controllable(&law)?;
    let high = TransferFunction::new(Polynomial::p().pow(integrators), slow)?;
    let high = StateSpace::controllable(&high)?;
    // u has steps with r because of the direct term; the remaining part of u is smooth.
    let direct = law.d();
    let smooth = u.iter().zip(r).map(|(u, r)| u - direct * r);
    let mean = smooth.clone().sum::<f64>() / n;
    let smooth = response(&high, Hold::First, smooth.map(|u| u - mean), record.step)?;
    // Also subtract the mean, as for the smooth part: otherwise raw levels count as a step at the beginning.
    let level = r.iter().sum::<f64>() / n;
    let moves = r.iter().map(|r| r - level);
    let jumps = response(&high, record.r_hold, moves, record.step)?;
    let u: Vec<f64> = smooth
        .iter()
        .zip(jumps)
        .map(|(u, r)| u + direct * r)
        .collect();
    let size = (u.iter().map(|u| u * u).sum::<f64>() / n).sqrt();
    if size == 0.0 {
        return Ok(None);
    }
    // Raw signals are what the controller acts on; a known point may hold a scaling's offset.
    let (r0, y0) = match record.offsets {
        Offsets::Known(point) => (point.r, point.y),
        _ => (0.0, 0.0),
    };
    let of_r = response(&law, record.r_hold, r.iter().map(|r| r - r0), record.step)?;
    let free = free_responses(&law, u.len(), record.step)?;
    let ladder: Vec<Vec<f64>> = ladder(r, record)?
        .iter()
        .map(|column| residual(&free, column))
        .collect();
    let y = record.y_on_lines();
    let mut best: Option<Mismatch> = None;
    for hold in [Hold::First, Hold::Zero] {
        let of_y = response(&law, hold, y.iter().map(|y| y - y0), record.step)?;
        let missed: Vec<f64> = (0..u.len()).map(|k| u[k] - (of_r[k] - of_y[k])).collect();
        let missed = residual(&free, &missed);
        let rms = (missed.iter().map(|v| v * v).sum::<f64>() / n).sqrt();
        if rms.is_finite() && best.is_none_or(|best| rms < best.rms) {
            let (follows, by_chance) = following(&free, &ladder, &missed)?;
            best = Some(Mismatch {
                rms,
                systematic: ((follows - by_chance).max(0.0) / n).sqrt(),
                by_chance: (by_chance / n).sqrt(),
                size,
            });
        }
    }
    Ok(best)
}

/// The square of the part of the command's error that follows the controller's polynomial terms, and its expected value for noise of the
/// same spectrum, by generalised least squares.
fn following(free: &[Vec<f64>], ladder: &[Vec<f64>], missed: &[f64]) -> Result<(f64, f64), Error> {
    let plain = Projection::new(ladder, missed);
    let noise = ArModel::fit(&[&plain.left(ladder, missed)], 4)?;
    let whitened: Vec<Vec<f64>> = ladder.iter().chain(free).map(|c| noise.whiten(c)).collect();
    let whole = Projection::new(&whitened, &noise.whiten(missed));
    let Some(covariance) = whole.damped.covariance(&whole.all) else {
        return Ok((0.0, 0.0));
    };
    let mut x = whole.solution();
    x.truncate(ladder.len());
    let plain = plain.triangle;
    let variance = noise.sigma() * noise.sigma();
    // The trace of the covariance times J'J = R'R, J the columns of the filtered references.
    let columns = 0..ladder.len();
    let by_row = |k: usize| -> f64 {
        let times = |i: usize| -> f64 {
            let own = columns.clone().map(|j| covariance[i][j] * plain.at(k, j));
            own.sum()
        };
        columns.clone().map(|i| plain.at(k, i) * times(i)).sum()
    };
    let by_chance: f64 = columns.clone().map(by_row).sum();
    Ok((plain.squared_length(&x), variance * by_chance))
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

/// Regressors: a constant, and the controller's free response to the unit value of each of its states.
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

/// Residual of a signal after projection on the columns.
fn residual(columns: &[Vec<f64>], signal: &[f64]) -> Vec<f64> {
    Projection::new(columns, signal).left(columns, signal)
}

/// Least squares of a signal on columns, with a ridge for dependent ones.
struct Projection {
    /// R factor of the columns and the signal.
    triangle: Triangle,
    /// The same R factor with the ridge.
    damped: Triangle,
    all: Vec<usize>,
}

impl Projection {
    fn new(columns: &[Vec<f64>], signal: &[f64]) -> Self {
        let mut triangle = Triangle::new(columns.len() + 1);
        let mut with_signal: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        with_signal.push(signal);
        triangle.push_columns(&with_signal);
        triangle.finish();
        let all: Vec<usize> = (0..columns.len()).collect();
        let norms: Vec<f64> = all.iter().map(|&j| triangle.column_norm(j)).collect();
        Self {
            damped: triangle.damped(&norms, RIDGE),
            triangle,
            all,
        }
    }

    /// The coefficient of each column.
    fn solution(&self) -> Vec<f64> {
        self.damped.solve(&self.all, &[], 0.0)
    }

    /// The signal without its projection.
    fn left(&self, columns: &[Vec<f64>], signal: &[f64]) -> Vec<f64> {
        let mut left = signal.to_vec();
        for (x, column) in self.solution().iter().zip(columns) {
            for (left, c) in left.iter_mut().zip(column) {
                *left -= x * c;
            }
        }
        left
    }
}
