//! Operating point (zero) of the signals.

use fcloe::{LoopRecord, Offsets};
use serde::Serialize;

use super::Task;
use crate::{Error, Method, residual::limits};

/// A loop is at rest in the first rows if the drive is constant in at least [`ROWS_AT_REST`] rows, and if output and command, at their rate
/// of change there, would change by at most [`MOVES`] of their ranges within the memory of the record.
const ROWS_AT_REST: usize = 6;
const MOVES: f64 = 0.03;
/// A difference below this number of standard errors is noise.
const NOISE: f64 = 3.0;
/// Without an integrator, rows over this number of time constants are long enough to come to rest, whatever the noise.
const LONG: f64 = 3.0;

/// Zero of reference, input and output. The loop has to be at rest there when the record begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum LevelChoice {
    /// Estimated by fcloe; otherwise the means of the rows before the first change of the reference, or of all rows
    #[default]
    Auto,
    /// Estimated with the parameters, by fcloe alone
    Estimated,
    /// Means of the first rows, in which the reference is constant
    Rest,
    /// Means of the record
    Mean,
    /// The signals are deviations already
    Zero,
}

impl Task<'_> {
    /// Zero of the signals for methods that cannot estimate it.
    pub(super) fn offsets_at_rest(&self) -> Result<Offsets, Error> {
        let zero = self.centred(Offsets::Deviations)?;
        let (drive, _) = zero.drive(&self.controller)?;
        let still = drive
            .iter()
            .take_while(|v| Some(*v) == drive.first())
            .count();
        Ok(match self.request.levels {
            LevelChoice::Zero => Offsets::Deviations,
            LevelChoice::Mean => Offsets::Means,
            LevelChoice::Rest => Offsets::FirstRows(still),
            LevelChoice::Estimated if self.request.method != Method::Fcloe => {
                return Err(Error::LevelsEstimated {
                    method: self.request.method,
                });
            }
            _ if self.rests(&zero, still) => Offsets::FirstRows(still),
            _ => Offsets::Means,
        })
    }

    /// Whether output and command are constant as long as the drive is. With an integrator the output at rest equals the reference. Without
    /// this knowledge, there must be enough rows to see a slow transient.
    fn rests(&self, record: &LoopRecord, still: usize) -> bool {
        if still < ROWS_AT_REST || still >= record.len() {
            return false;
        }
        let readings = record.y[..still].iter().filter(|y| !y.is_nan()).count();
        if readings < ROWS_AT_REST {
            return false;
        }
        let memory = forgets_after(&ct_signals::interpolated(&record.y)) as f64;
        let stands = |signal: &[f64]| {
            let (low, high) = limits(signal);
            let trend = Trend::new(&signal[..still]);
            let unseen = NOISE * trend.slope_error * memory;
            let room = MOVES * (high - low);
            (trend.slope.abs() * memory <= room + unseen, unseen <= room)
        };
        let (y_stands, would_be_seen) = stands(&record.y);
        let u_stands = record.u.as_deref().is_none_or(|u| stands(u).0);
        let integrates = self.controller.s().coefficient(0) == 0.0;
        let at_its_level = match record.r.as_deref() {
            Some(r) if integrates && !self.controller.is_open_loop() => {
                let (low, high) = limits(&record.y);
                let y = Trend::new(&record.y[..still]);
                (y.mean - r[0]).abs() <= MOVES * (high - low) + NOISE * y.mean_error
            }
            _ => would_be_seen || still as f64 >= LONG * memory,
        };
        y_stands && u_stands && at_its_level
    }

    /// The levels of drive and output that are subtracted.
    pub(super) fn levels_of(&self, record: &LoopRecord) -> [f64; 2] {
        let point = record.operating_point();
        if self.controller.is_open_loop() {
            [point.u, point.y]
        } else {
            [point.r, point.y]
        }
    }
}

/// A line through the first rows of a signal, in rows and in its own unit.
struct Trend {
    mean: f64,
    mean_error: f64,
    slope: f64,
    slope_error: f64,
}

impl Trend {
    /// Statistics of the values that are present.
    fn new(y: &[f64]) -> Self {
        let rows = y.iter().enumerate().filter(|(_, y)| !y.is_nan());
        let n = rows.clone().count() as f64;
        let mean = rows.clone().map(|(_, y)| y).sum::<f64>() / n;
        let (middle, across) = match rows.clone().count() == y.len() {
            true => (0.5 * (n - 1.0), n * (n * n - 1.0) / 12.0),
            false => {
                let middle = rows.clone().map(|(k, _)| k as f64).sum::<f64>() / n;
                let squares = rows.clone().map(|(k, _)| (k as f64 - middle).powi(2));
                (middle, squares.sum())
            }
        };
        let about = |(k, y): (usize, &f64)| (k as f64 - middle) * (y - mean);
        let slope = rows.clone().map(about).sum::<f64>() / across;
        let off = |(k, y): (usize, &f64)| (y - mean - slope * (k as f64 - middle)).powi(2);
        let variance = rows.map(off).sum::<f64>() / (n - 2.0);
        Self {
            mean,
            mean_error: (variance / n).sqrt(),
            slope,
            slope_error: (variance / across).sqrt(),
        }
    }
}

/// Number of rows after which the autocorrelation of a record falls below 1/e; accurate to a factor 2.
fn forgets_after(y: &[f64]) -> usize {
    let mean = y.iter().sum::<f64>() / y.len().max(1) as f64;
    let together = |lag: usize| {
        let pairs = y.iter().zip(&y[lag..]);
        pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / (y.len() - lag) as f64
    };
    let own = together(0);
    let lags = std::iter::successors(Some(1_usize), |lag| lag.checked_mul(2));
    lags.take_while(|lag| *lag < y.len())
        .find(|lag| together(*lag) <= own / std::f64::consts::E)
        .unwrap_or(y.len())
}

/// Source of the levels of a record.
pub(super) fn chosen(record: &LoopRecord) -> LevelChoice {
    match record.offsets {
        Offsets::Estimated => LevelChoice::Estimated,
        Offsets::FirstRows(_) => LevelChoice::Rest,
        Offsets::Means => LevelChoice::Mean,
        _ => LevelChoice::Zero,
    }
}
