//! Isolation: the effect of the catalogue, and its onset, that explains the latest rows.
//!
//! An effect that begins at row `k` is fitted by `greybox` to the rows of all outputs from `k` on, prewhitened by the learned noise model.
//! The parameters of the learned plant and its levels at row `k` are fixed; only the effect's parameters are fitted. The onsets that are
//! tried lie on a grid that is finer for recent rows, then between the neighbours of the best. With the innovations `e` of the learned model,
//! ```text
//! evidence = sum_o (sum_{j >= k} e_jo^2 - cost_o/sigma_o^2) - (parameters + 1) ln n
//! ```
//! is the fall of the Bayesian information criterion. The onset counts as a parameter; `n` is the number of stored rows times that of the
//! outputs `o`.
//! Effects within [`GROUP_MARGIN`] of the best cannot be distinguished yet.

mod search;

use ct_signals::{ArModel, Hold};
use greybox::Stopping;
use missing_effect::GROUP_MARGIN;
use plants::{Placed, Structure, Unit};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::search::Search;
use crate::{Each, intake::Sample, learn::Learned, lost::interpolated};

/// Effects that can begin while a plant runs. The plant's shape, a wrong law or a lag are not among them.
const BEGIN: [&str; 12] = [
    "stiction_backlash",
    "pump_deadzone",
    "pump_saturation",
    "pump_gain_drift",
    "valve_drift",
    "valve_step",
    "const_leak",
    "leak_at_height",
    "overflow",
    "sensor_offset",
    "sensor_drift",
    "sensor_saturation",
];

/// Onsets, in slowest time constants before now.
const ONSETS: [f64; 13] = [
    0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 11.0, 15.0, 20.0,
];
/// At every such onset the catalogue's starts are tried again.
const AFRESH: usize = 4;
/// Least number of rows after an onset.
pub(crate) const FEWEST: usize = 8;
/// A drift of the pump is linear if its settling time is at its upper bound.
const EVEN: (&str, &str) = ("pump_gain_drift", "time_constant");
pub(crate) const ROUGH: Stopping = Stopping {
    evaluations: 8,
    cost: 1e-3,
};
pub(crate) const FINE: Stopping = Stopping {
    evaluations: 40,
    cost: 1e-8,
};
/// The residual is larger than noise if its sum of squares exceeds that of the noise by this number of standard errors ...
const BEYOND: f64 = 4.0;
/// ... and if the excess is more than this share of the excess without the effect: no learned model is exact, and its errors are visible in
/// the presence of a large effect.
const LEFT: f64 = 0.1;

/// A stored row with the output of the learned model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Kept {
    pub sample: Sample,
    /// States of the learned model: the levels of a plant.
    pub states: Each<f64>,
    /// State of the actuator's backlash in the input's unit: backlash has unlimited memory, so the state cannot be found by simulating a
    /// few rows.
    pub stands: f64,
    /// Simulated readings of the learned model.
    pub modelled: Each<f64>,
    /// Whitened residual of each output in its standard deviations; zero where the reading is lost.
    pub innovations: Each<f64>,
}

impl Kept {
    /// Residual: measured minus the learned model's output.
    pub(crate) fn residual(&self, output: usize) -> Option<f64> {
        Some(self.sample.outputs[output]? - self.modelled[output])
    }
}

/// An effect with its best explanation of the latest rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Suspect {
    pub placed: Placed,
    pub evidence: f64,
    /// \[s\]
    pub since: f64,
    /// Size of the effect: name, value, unit.
    pub size: (&'static str, f64, Unit),
    /// Whether the size is inside its plausible range.
    pub plausible: bool,
    pub(crate) left: Left,
}

/// Whitened squares from an onset on, in the noise's variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Left {
    /// Sum of squares of the learned model.
    pub before: f64,
    /// Sum of squares with the effect.
    pub left: f64,
    /// Number of rows times outputs.
    pub samples: usize,
}

impl Left {
    /// Whether the residual of the model with the effect is larger than noise would be.
    pub(crate) fn is_more_than_noise(self) -> bool {
        let n = self.samples as f64;
        self.left > n + BEYOND * (2.0 * n).sqrt() && self.left - n > LEFT * (self.before - n)
    }
}

impl Suspect {
    /// Whether the effect belongs to the group of the best.
    pub(crate) fn near(&self, best: &Self) -> bool {
        self.plausible && best.evidence - self.evidence < GROUP_MARGIN
    }
}

/// Every effect that may have begun, best first: implausible sizes come last. The noise of each output is `growth` times the learned noise.
/// Residuals of missing readings are interpolated linearly, in the same way for each effect; they count as readings. An output without any
/// reading in all rows is left out.
pub(crate) fn isolate(
    structure: &Structure,
    learned: &Learned,
    hold: Hold,
    rows: &[Kept],
    growth: &Each<f64>,
) -> Vec<Suspect> {
    let Some(noise) = learned.noise() else {
        return Vec::new();
    };
    let mut squares = vec![0.0; rows.len()];
    let mut series = Vec::with_capacity(noise.outputs());
    for (output, (noise, &growth)) in noise.iter().zip(growth).enumerate() {
        let residuals: Vec<Option<f64>> = rows.iter().map(|row| row.residual(output)).collect();
        let Some(residuals) = interpolated(&residuals) else {
            series.push(Series::without_readings(rows.len()));
            continue;
        };
        let innovations = innovations(rows, output, &residuals, noise);
        for (square, innovation) in squares.iter_mut().zip(innovations) {
            *square += (innovation / growth).powi(2);
        }
        let readings = rows.iter().zip(&residuals).map(|(row, residual)| {
            row.sample.outputs[output].unwrap_or(row.modelled[output] + residual)
        });
        series.push(Series {
            readings: readings.collect(),
            residuals,
        });
    }
    let read = series.iter().filter(|series| series.is_read()).count();
    if read == 0 {
        return Vec::new();
    }
    let sigmas = learned.outputs.iter().zip(growth);
    let search = Search {
        structure,
        learned,
        noise,
        hold,
        rows,
        series,
        read,
        sigmas: sigmas
            .map(|(output, growth)| growth * output.sigma)
            .collect(),
        squares: squares
            .iter()
            .rev()
            .scan(0.0, |sum, square| {
                *sum += square;
                Some(*sum)
            })
            .collect(),
    };
    let mut suspects: Vec<Suspect> = structure
        .candidates()
        .into_par_iter()
        .filter(|placed| BEGIN.contains(&placed.effect.id))
        .filter_map(|placed| search.suspect(placed))
        .collect();
    suspects.sort_by(|a, b| {
        (b.plausible, b.evidence)
            .partial_cmp(&(a.plausible, a.evidence))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    // Of two vessels or outputs, the one that explains more.
    let mut best: Vec<Suspect> = Vec::with_capacity(suspects.len());
    for suspect in suspects {
        if best
            .iter()
            .all(|b| b.placed.effect.id != suspect.placed.effect.id)
        {
            best.push(suspect);
        }
    }
    best
}

/// Innovations of an output in standard deviations, also for missing readings: according to a fit to the interpolated record.
fn innovations(rows: &[Kept], output: usize, residuals: &[f64], noise: &ArModel) -> Vec<f64> {
    let p = noise.order();
    (0..rows.len())
        .map(|k| {
            let from = k.saturating_sub(p);
            let is_read = |row: &Kept| row.sample.outputs[output].is_some();
            if rows[from..=k].iter().all(is_read) {
                return rows[k].innovations[output];
            }
            let past = residuals[from..k].iter().rev();
            let foretold: f64 = past.zip(noise.coefficients()).map(|(r, a)| a * r).sum();
            (residuals[k] - foretold) / noise.sigma()
        })
        .collect()
}

/// An output in each row.
struct Series {
    /// Measured or interpolated readings; all NaN if there are none.
    readings: Vec<f64>,
    /// Residuals minus those of the learned model.
    residuals: Vec<f64>,
}

impl Series {
    fn without_readings(rows: usize) -> Self {
        Self {
            readings: vec![f64::NAN; rows],
            residuals: vec![f64::NAN; rows],
        }
    }

    fn is_read(&self) -> bool {
        self.readings
            .first()
            .is_some_and(|reading| !reading.is_nan())
    }
}
