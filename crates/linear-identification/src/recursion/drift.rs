//! Test whether the estimates depend on the level. Near a single level any process is linear, so estimates that depend on the level show
//! that the process is not linear, or not of this order.
//!
//! An estimate at time t belongs to the mean of the output with the exponential weights of the recursion, with forgetting rate eta,
//! ```text
//! level(t) = int y e^{-eta (t - s)} ds / int e^{-eta (t - s)} ds
//! ```
//! The range of this level is divided into [`STRETCHES`] equal intervals, and the estimates in each are averaged.
//!
//! Constant estimates show linearity only if the level has moved: if the memory of the recursion is a small part of the record, and the
//! level covers a large part of the output's range.

use serde::Serialize;

use super::scaled::Scaled;
use crate::{Order, Trajectory};

/// Number of intervals of the level.
const STRETCHES: usize = 8;

/// The estimates depend on the level if their values at both ends of the level's range differ by this number of standard errors.
const APART: f64 = 3.0;

/// The longest memory, as a share of the record's length, and the least range of the remembered level, as a share of the output's range,
/// for which constant estimates are significant. The default memory of a long record is a fifth of it.
const LONGEST_MEMORY: f64 = 0.21;
const LEAST_WAY: f64 = 0.2;

/// Gain and time constant over the level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Drift {
    /// Mean output within the recursion's memory, in the output's unit, rising.
    pub level: Vec<f64>,
    /// Static gain `b_0` as a function of the level.
    pub gain: OverLevel,
    /// `a_1`: the time constant for n = 1, otherwise the sum of the time constants, s.
    pub time_constant: OverLevel,
    /// Memory over the length of the record.
    pub memory_part: f64,
    /// Range of the remembered level, as a share of the output's range.
    pub level_part: f64,
}

impl Drift {
    /// Whether gain or time constant change by more than chance.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.gain.moves() || self.time_constant.moves()
    }

    /// Whether the range of the level is large enough to conclude from constant estimates that the process is linear.
    #[must_use]
    pub fn tells(&self) -> bool {
        self.memory_part <= LONGEST_MEMORY && self.level_part >= LEAST_WAY
    }
}

/// One parameter as a function of the level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverLevel {
    /// Values of the parameter.
    pub values: Vec<f64>,
    /// Standard errors of the means.
    pub std_errors: Vec<f64>,
    /// Difference between the highest and the lowest level, in its standard errors. The two estimates are treated as independent; with
    /// common data the difference is more accurate.
    pub difference: f64,
}

impl OverLevel {
    fn new(stretches: &[&Stretch], of: impl Fn(&Stretch) -> (f64, f64)) -> Self {
        let (values, std_errors): (Vec<f64>, Vec<f64>) = stretches.iter().map(|s| of(s)).unzip();
        let ends = [0, values.len().saturating_sub(1)].map(|i| (values[i], std_errors[i]));
        let [(low, low_error), (high, high_error)] = ends;
        Self {
            difference: (high - low) / low_error.hypot(high_error),
            values,
            std_errors,
        }
    }

    /// Whether the parameter changes by more than chance.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.difference.abs() > APART
    }

    /// The values at the lowest and the highest level.
    #[must_use]
    pub fn ends(&self) -> Option<[(f64, f64); 2]> {
        let at = |i: usize| Some((*self.values.get(i)?, *self.std_errors.get(i)?));
        Some([at(0)?, at(self.values.len().checked_sub(1)?)?])
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Stretch {
    count: f64,
    level: f64,
    gain: (f64, f64),
    time_constant: (f64, f64),
}

impl Stretch {
    fn add(&mut self, level: f64, gain: (f64, f64), time_constant: (f64, f64)) {
        self.count += 1.0;
        let share = 1.0 / self.count;
        let move_to = |mean: &mut f64, value: f64| *mean += share * (value - *mean);
        move_to(&mut self.level, level);
        for (mean, value) in [
            (&mut self.gain, gain),
            (&mut self.time_constant, time_constant),
        ] {
            move_to(&mut mean.0, value.0);
            move_to(&mut mean.1, value.1);
        }
    }
}

/// `None` if the level is constant, or if the record is too short for standard errors.
pub(super) fn over_level(trajectory: &Trajectory, scaled: &Scaled, order: Order) -> Option<Drift> {
    let levels = remembered(scaled);
    let at = |i: usize, k: usize| (trajectory.values[i][k], trajectory.std_errors[i][k]);
    let settled = trajectory.settled();
    let points: Vec<_> = trajectory
        .time
        .iter()
        .zip(&trajectory.samples)
        .enumerate()
        .filter(|(_, (time, _))| **time >= settled)
        .map(|(k, (_, &sample))| (levels[sample], at(order.n, k), at(0, k)))
        .filter(|(_, gain, time_constant)| gain.1.is_finite() && time_constant.1.is_finite())
        .collect();
    let of = |pick: fn(f64, f64) -> f64, from| points.iter().map(|p| p.0).fold(from, pick);
    let (low, high) = (of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY));
    // Without points the range is from infinity down to minus infinity.
    if high <= low {
        return None;
    }
    let mut stretches = [Stretch::default(); STRETCHES];
    for (level, gain, time_constant) in points {
        let place = (STRETCHES as f64 * (level - low) / (high - low)) as usize;
        stretches[place.min(STRETCHES - 1)].add(level, gain, time_constant);
    }
    let range = ct_signals::range_of(&scaled.y);
    let duration = scaled.time.last().copied().unwrap_or(f64::NAN);
    let seen: Vec<&Stretch> = stretches.iter().filter(|s| s.count > 0.0).collect();
    let drift = Drift {
        level: seen.iter().map(|s| scaled.output(s.level)).collect(),
        gain: OverLevel::new(&seen, |s| s.gain),
        time_constant: OverLevel::new(&seen, |s| s.time_constant),
        memory_part: 1.0 / (scaled.eta * duration),
        level_part: (high - low) / (range.1 - range.0),
    };
    // a single interval, or standard errors of 0: no comparison
    let known = [&drift.gain, &drift.time_constant].map(|over| over.difference.is_finite());
    (known == [true, true]).then_some(drift)
}

/// The remembered level at every sample, scaled.
fn remembered(scaled: &Scaled) -> Vec<f64> {
    let (mut level, mut length) = (0.0, 0.0);
    let mut levels = Vec::with_capacity(scaled.y.len());
    for (y, step) in scaled.y.iter().zip(scaled.steps()) {
        if y.is_nan() {
            levels.push(level);
            continue;
        }
        let faded = (-scaled.eta * step).exp();
        // in units of the memory: the whole past counts as 1
        let new = 1.0 - faded;
        length = faded * length + new;
        if length > 0.0 {
            level += new / length * (y - level);
        } else {
            level = *y;
        }
        levels.push(level);
    }
    levels
}
