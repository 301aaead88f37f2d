//! Fits of one candidate after the other to the stored rows.

use ct_signals::{Hold, Record};
use greybox::{Noise, Setup, Stopping, fit_from};
use plants::{Placed, Simulator, Structure};
use std::collections::BTreeMap;

use super::{AFRESH, EVEN, FEWEST, FINE, Kept, Left, ONSETS, ROUGH, Series, Suspect};
use crate::learn::BEGIN as BEGIN_IN_BAND;
use crate::learn::{Learned, record};
use crate::sensitivity::command;

pub(super) struct Search<'a> {
    pub(super) structure: &'a Structure,
    pub(super) learned: &'a Learned,
    pub(super) noise: Noise,
    pub(super) hold: Hold,
    pub(super) rows: &'a [Kept],
    /// Series of each output.
    pub(super) series: Vec<Series>,
    /// Outputs that have readings.
    pub(super) read: usize,
    /// Standard deviation of each output's innovations \[output unit\].
    pub(super) sigmas: Vec<f64>,
    /// Sum of squared innovations of all outputs over the last 1, 2, ... rows.
    pub(super) squares: Vec<f64>,
}

impl Search<'_> {
    /// The better of an effect with all its parameters and with one of them fixed, if this gives a simpler effect.
    pub(super) fn suspect(&self, placed: Placed) -> Option<Suspect> {
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
            // Fits start from the catalogue's values at some onsets, and otherwise from the result of the preceding onset.
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
        // Repeatedly halves the distance to the next onset on either side.
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

    /// A fit begins with backlash, lags and dead time at rest at its first command. The difference between the learned model with this
    /// beginning and the continuous simulation is subtracted from the readings.
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

    /// The effect with an onset `length` rows ago, fitted; its parameters start at `near` or at the catalogue's starts.
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
        // The onset of this effect is the start of the record.
        if placed.effect.id == "valve_step" {
            fixed.insert(name("time"), 0.0);
        }
        // The actuator followed the command until the onset.
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

/// All combinations of the start values of an effect's first parameters.
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
