//! Isolation: which effect of the catalogue began, and when, explains the latest rows.
//!
//! An effect that begins at row `k` is fitted to the rows of all outputs from `k` on by `greybox`, in the metric of the learned noise: every
//! parameter of the plant as it was learned, the levels at `k` as the learned model has them, only the effect's own
//! parameters free. Onsets lie on a grid that is finer towards now, and then between its neighbours. With the innovations
//! `e` of the learned model,
//! ```text
//! evidence = sum_o (sum_{j >= k} e_jo^2 - cost_o/sigma_o^2) - (parameters + 1) ln n
//! ```
//! is the fall of the Bayesian information criterion, the onset counted as a parameter, `n` the rows that are kept times the outputs `o`.
//! Effects within [`GROUP_MARGIN`] of the best cannot be told apart yet.

use std::collections::BTreeMap;

use ct_signals::{ArModel, Hold, Record};
use greybox::{Noise, Setup, Stopping, fit_from};
use missing_effect::GROUP_MARGIN;
use plants::{Placed, Simulator, Structure, Unit};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    Each,
    intake::Sample,
    learn::{BEGIN as BEGIN_IN_BAND, Learned, record},
    lost::interpolated,
    sensitivity::command,
};

/// Effects that begin while a plant runs. What is a plant's shape, a wrong law or a lag does not.
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
/// An onset has at least so many rows behind it.
pub(crate) const FEWEST: usize = 8;
/// A drift of the pump is even where its settling takes as long as it may.
const EVEN: (&str, &str) = ("pump_gain_drift", "time_constant");
pub(crate) const ROUGH: Stopping = Stopping {
    evaluations: 8,
    cost: 1e-3,
};
pub(crate) const FINE: Stopping = Stopping {
    evaluations: 40,
    cost: 1e-8,
};
/// What is left is more than noise where its squares lie so many standard errors above those of the noise ...
const BEYOND: f64 = 4.0;
/// ... and are more than this share of what was above the noise before: no learned model is exact, and beside a large effect its errors show.
const LEFT: f64 = 0.1;

/// A row that is kept, with what the learned model said of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Kept {
    pub sample: Sample,
    /// States of the learned model: the levels, of a plant.
    pub states: Each<f64>,
    /// Where in it stood what the command moves: play has a memory without an end, and no run-up finds it.
    pub stands: f64,
    /// Readings of the learned model.
    pub modelled: Each<f64>,
    /// Whitened residual of each output in its standard deviations; zero where the reading is lost.
    pub innovations: Each<f64>,
}

impl Kept {
    /// Measured minus the learned model.
    pub(crate) fn residual(&self, output: usize) -> Option<f64> {
        Some(self.sample.outputs[output]? - self.modelled[output])
    }
}

/// An effect that explains the latest rows, as well as it can.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Suspect {
    pub placed: Placed,
    pub evidence: f64,
    /// \[s\]
    pub since: f64,
    /// Its size: name, value, unit.
    pub size: (&'static str, f64, Unit),
    /// The size lies inside its plausible range.
    pub plausible: bool,
    pub(crate) left: Left,
}

/// Whitened squares from an onset on, in the noise's variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Left {
    /// What the learned model leaves.
    pub before: f64,
    /// What is left with an effect.
    pub left: f64,
    /// Rows there times outputs.
    pub samples: usize,
}

impl Left {
    /// What an effect leaves is more than noise.
    pub(crate) fn is_more_than_noise(self) -> bool {
        let n = self.samples as f64;
        self.left > n + BEYOND * (2.0 * n).sqrt() && self.left - n > LEFT * (self.before - n)
    }
}

impl Suspect {
    /// Belongs to the group of the best.
    pub(crate) fn near(&self, best: &Self) -> bool {
        self.plausible && best.evidence - self.evidence < GROUP_MARGIN
    }
}

/// Every effect that may have begun, best first: an implausible size comes after every plausible one. The noise of each output is `growth`
/// times as large as it was learned. Residuals of lost readings are taken on straight lines between those beside them, for each effect alike;
/// they count as readings. An output that has no reading in all the rows is left out.
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
    // Of two vessels, or outputs, the one that explains more.
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

/// Innovations of an output in their standard deviations, of lost readings too: as a fit to the filled record has them.
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
    /// Measured or filled in; all NaN where there is none.
    readings: Vec<f64>,
    /// The same less the learned model's.
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

struct Search<'a> {
    structure: &'a Structure,
    learned: &'a Learned,
    noise: Noise,
    hold: Hold,
    rows: &'a [Kept],
    /// Of each output.
    series: Vec<Series>,
    /// Outputs that have readings.
    read: usize,
    /// Standard deviation of each output's innovations \[output unit\].
    sigmas: Vec<f64>,
    /// Sum of squared innovations of all outputs over the last 1, 2, ... rows.
    squares: Vec<f64>,
}

impl Search<'_> {
    /// The better of an effect with all its parameters and with one of them held, where that makes a simpler effect of it.
    fn suspect(&self, placed: Placed) -> Option<Suspect> {
        let whole = self.suspect_with(placed, None);
        if placed.effect.id != EVEN.0 {
            return whole;
        }
        let simple = self.suspect_with(placed, Some(EVEN.1));
        [whole, simple]
            .into_iter()
            .flatten()
            .max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    }

    fn suspect_with(&self, placed: Placed, held: Option<&str>) -> Option<Suspect> {
        let n = self.rows.len();
        let unit = self.learned.rows_per_time_constant();
        let mut lengths: Vec<usize> = ONSETS
            .iter()
            .map(|share| ((share * unit).round() as usize).max(FEWEST))
            .filter(|length| *length <= n)
            .collect();
        lengths.dedup();
        let mut best: Option<(Suspect, usize, Vec<f64>)> = None;
        let mut near: Option<Vec<f64>> = None;
        for (i, &length) in lengths.iter().enumerate() {
            // From the catalogue's starts now and then, in between from where the last onset ended.
            let from = near.take().filter(|_| !i.is_multiple_of(AFRESH));
            let Some((suspect, x)) = self.fitted((placed, held), length, from.as_deref(), ROUGH)
            else {
                continue;
            };
            near = Some(x.clone());
            if best
                .as_ref()
                .is_none_or(|(known, ..)| suspect.evidence > known.evidence)
            {
                best = Some((suspect, length, x));
            }
        }
        let (_, at, _) = best.as_ref()?;
        // Half-way to the next onset on either side, again and again.
        let position = lengths.iter().position(|length| length == at)?;
        let below = position.checked_sub(1).map_or(FEWEST, |i| lengths[i]);
        let above = lengths.get(position + 1).copied().unwrap_or(n);
        let mut gap = (at - below.min(*at), above - at);
        while gap != (0, 0) {
            gap = (gap.0 / 2, gap.1 / 2);
            let (_, at, x) = best.clone()?;
            for length in [at.saturating_sub(gap.0), at + gap.1] {
                if length != at
                    && (FEWEST..=n).contains(&length)
                    && let Some(found) = self.fitted((placed, held), length, Some(&x), FINE)
                    && best
                        .as_ref()
                        .is_none_or(|(known, ..)| found.0.evidence > known.evidence)
                {
                    best = Some((found.0, length, found.1));
                }
            }
        }
        let (rough, length, x) = best?;
        let fine = self.fitted((placed, held), length, Some(&x), FINE);
        Some(fine.map_or(rough, |(fine, _)| fine))
    }

    /// A fit begins with play, lags and dead time at rest at its first command. What the learned model, begun in the same way, misses of the
    /// one that ran on is taken from the readings.
    fn put_right(&self, record: &mut Record, from: usize) -> Option<()> {
        if self.structure.effects().is_empty() && self.structure.terms().is_empty() {
            return Some(());
        }
        let vessels = self.structure.plant.vessels();
        let rows = &self.rows[from..];
        let first = rows.first()?;
        let mut begun = Simulator::<f64>::new(
            self.structure,
            &self.learned.theta,
            &first.states[..vessels],
            first.sample.inputs[0],
        )
        .ok()?;
        begun.set_substeps(self.learned.substeps);
        let mut before: Option<&Kept> = None;
        for (k, row) in rows.iter().enumerate() {
            if let Some(before) = before {
                let step = row.sample.time - before.sample.time;
                begun.advance(command(self.hold, &before.sample, &row.sample), step);
            }
            before = Some(row);
            let outputs = record.outputs.iter_mut().zip(&self.series);
            for (output, (channel, series)) in outputs.enumerate() {
                channel.values[k] = begun.read(output) + series.residuals[from + k];
            }
        }
        Some(())
    }

    /// The effect as it began `length` rows ago, fitted; its own parameters start at `near` or at the catalogue's starts.
    fn fitted(
        &self,
        (placed, held): (Placed, Option<&str>),
        length: usize,
        near: Option<&[f64]>,
        stopping: Stopping,
    ) -> Option<(Suspect, Vec<f64>)> {
        let from = self.rows.len().checked_sub(length)?;
        let rows = &self.rows[from..];
        let mut records = [record(
            rows.iter().map(|row| &row.sample),
            1,
            self.series
                .iter()
                .map(|series| series.readings[from..].to_vec())
                .collect(),
            self.hold,
        )];
        self.put_right(&mut records[0], from)?;
        let mut structure = self.structure.with(placed).ok()?;
        structure.scales.duration = records[0].duration();
        let mut fixed: BTreeMap<String, f64> = self
            .structure
            .parameter_names()
            .into_iter()
            .zip(self.learned.theta.iter().copied())
            .collect();
        let own = structure.effect_parameters(placed);
        let leading = own.first()?.clone();
        let name = |parameter: &str| format!("{}.{parameter}", placed.effect.id);
        // Its onset is that of the record.
        if placed.effect.id == "valve_step" {
            fixed.insert(name("time"), 0.0);
        }
        // It followed the command until then.
        fixed.insert(BEGIN_IN_BAND.into(), 0.0);
        if let Some(held) = own.iter().find(|parameter| Some(parameter.name) == held) {
            fixed.insert(name(held.name), held.upper);
        }
        let mut setup = Setup::new(structure, &records, fixed).ok()?;
        setup.substeps = self.learned.substeps;
        setup.known_scales = Some(self.sigmas.clone());
        setup.hold_initial_states();
        let mut x = vec![0.0; setup.names().len()];
        for (i, name) in setup.names().iter().enumerate() {
            if let Some(value) = setup.fixed.get(name) {
                x[i] = *value;
            }
        }
        let (first, vessels) = (setup.parameter_count(), setup.structure.plant.vessels());
        x[first..first + vessels].copy_from_slice(&rows[0].states[..vessels]);
        let free = setup.free().to_vec();
        let starts: Vec<Vec<f64>> = match near {
            Some(values) => vec![values.to_vec()],
            None => grid(&own, free.len()),
        };
        let starts: Vec<Vec<f64>> = starts
            .into_iter()
            .map(|values| {
                let mut start = x.clone();
                for (i, value) in free.iter().zip(values) {
                    start[*i] = value;
                }
                start
            })
            .collect();
        let fit = fit_from(&setup, &starts, &self.noise, stopping).ok()?;
        // The cost is in units of the first output's.
        let squares = fit.cost / self.sigmas.first()?.powi(2);
        let samples = (self.rows.len() * self.read) as f64;
        let cost = (free.len() + 1) as f64 * samples.ln();
        let values: Vec<f64> = free.iter().map(|&i| fit.x[i]).collect();
        let size = *values.first()?;
        let room = 1e-6 * (leading.upper - leading.lower);
        Some((
            Suspect {
                placed,
                evidence: self.squares[length - 1] - squares - cost,
                since: rows[0].sample.time,
                size: (leading.name, size, leading.unit),
                plausible: size > leading.lower + room && size < leading.upper - room,
                left: Left {
                    before: self.squares[length - 1],
                    left: squares,
                    samples: length * self.read,
                },
            },
            values,
        ))
    }
}

/// All combinations of the starts of an effect's first parameters.
fn grid(parameters: &[plants::ParameterInfo], count: usize) -> Vec<Vec<f64>> {
    parameters
        .iter()
        .take(count)
        .fold(vec![Vec::new()], |grid, parameter| {
            grid.iter()
                .flat_map(|values| {
                    parameter.starts.iter().map(move |start| {
                        let mut values = values.clone();
                        values.push(*start);
                        values
                    })
                })
                .collect()
        })
}
