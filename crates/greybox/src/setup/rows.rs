//! The derivatives of a simulation, row by row, and what a fit folds them to.

use ct_signals::{ArModel, Record};
use plants::{Dual, Simulator};

use super::{Setup, at_rest, commands, reference, second_command};
use crate::{Triangle, feedback::Response};

/// More than sums of squares over a record differ by where they are taken in another order.
const ROUNDING: f64 = 1e-9;

/// The derivatives and the residual of every sample, one record after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Entries of a row: the free entries of the vector, then the residual.
    pub columns: usize,
    /// Samples of each record.
    pub lengths: Vec<usize>,
    /// Row by row.
    pub values: Vec<f64>,
}

/// What is known of a row's sample before it is simulated.
#[derive(Clone, Copy)]
struct Sample {
    /// It is the first one of its record.
    first: bool,
    /// The output's sample is missing: the row has no residual.
    missing: bool,
}

impl Rows {
    /// The rows of one record after the other, each a slice of `length x columns` values.
    pub fn records(&self) -> impl Iterator<Item = &[f64]> {
        let mut rest = self.values.as_slice();
        self.lengths.iter().map(move |&length| {
            let (record, after) = rest.split_at(length * self.columns);
            rest = after;
            record
        })
    }

    /// The same without the rows whose sample is missing.
    #[must_use]
    pub fn observed(self) -> Self {
        let residual = self.columns - 1;
        if !self
            .values
            .chunks_exact(self.columns)
            .any(|row| row[residual].is_nan())
        {
            return self;
        }
        let mut observed = Self {
            columns: self.columns,
            lengths: Vec::with_capacity(self.lengths.len()),
            values: Vec::with_capacity(self.values.len()),
        };
        for record in self.records() {
            let before = observed.values.len();
            for row in record.chunks_exact(self.columns) {
                if !row[residual].is_nan() {
                    observed.values.extend_from_slice(row);
                }
            }
            observed
                .lengths
                .push((observed.values.len() - before) / self.columns);
        }
        observed
    }

    /// The folded rows, whitened by a noise model, with columns chosen and put in this order. Rows whose residual is NaN are
    /// missing: they are not folded in, and the rows behind them are whitened by what is there.
    pub(crate) fn fold(&self, order: &[usize], noise: &ArModel) -> Triangle {
        let mut triangle = Triangle::new(order.len());
        let mut whitener = noise.whitener(order.len());
        let mut chosen = vec![0.0; order.len()];
        for record in self.records() {
            whitener.reset();
            let mut missing = 0;
            for row in record.chunks_exact(self.columns) {
                if row[self.columns - 1].is_nan() {
                    missing += 1;
                    continue;
                }
                whitener.skip_many(std::mem::take(&mut missing));
                for (to, &column) in chosen.iter_mut().zip(order) {
                    *to = row[column];
                }
                whitener.push(&mut chosen);
                triangle.push(&chosen);
            }
        }
        triangle.finish();
        triangle
    }
}

impl Setup<'_> {
    /// The folded rows `[d model/d x_free, measured - model]`, whitened by the noise model; `None` where the
    /// simulation is not finite.
    #[must_use]
    pub fn linearise(&self, x: &[f64], noise: &ArModel) -> Option<Triangle> {
        self.linearise_below(x, noise, f64::INFINITY)
    }

    /// The same; `None` too where the cost is above a limit, which is known long before the last sample as a rule.
    pub(crate) fn linearise_below(
        &self,
        x: &[f64],
        noise: &ArModel,
        limit: f64,
    ) -> Option<Triangle> {
        let columns = self.free.len() + 1;
        let mut triangle = Triangle::new(columns);
        let mut whitener = noise.whitener(columns);
        // The triangle's cost is a sum in another order.
        let limit = limit * (1.0 + ROUNDING);
        let mut cost = 0.0;
        self.each_row(x, |sample, row| {
            if sample.first {
                whitener.reset();
            }
            if sample.missing {
                whitener.skip();
                return true;
            }
            whitener.push(row);
            cost += row[columns - 1] * row[columns - 1];
            triangle.push(row);
            cost <= limit
        })?;
        triangle.finish();
        Some(triangle)
    }

    /// Whether the cost is above a limit, or not finite.
    pub(crate) fn costs_more(&self, x: &[f64], noise: &ArModel, limit: f64) -> bool {
        let mut whitener = noise.whitener(1);
        let limit = limit * (1.0 + ROUNDING);
        let mut cost = 0.0;
        let within = self.each_row_in_lanes::<0>(x, &[], |sample, row| {
            if sample.first {
                whitener.reset();
            }
            if sample.missing {
                whitener.skip();
                return true;
            }
            whitener.push(row);
            cost += row[0] * row[0];
            cost <= limit
        });
        within.is_none()
    }

    /// The rows `[d model/d x_free, measured - model]`, one for each sample of all records, as they are, the residual NaN where the
    /// output's sample is missing; `None` where the simulation is not finite.
    #[must_use]
    pub fn rows(&self, x: &[f64]) -> Option<Rows> {
        let columns = self.free.len() + 1;
        let mut values = Vec::with_capacity(self.samples() * columns);
        self.each_row(x, |_, row| {
            values.extend_from_slice(row);
            true
        })?;
        Some(Rows {
            columns,
            lengths: self.records.iter().map(Record::len).collect(),
            values,
        })
    }

    /// Shows every row with what is known of its sample, until `each` has seen enough; `None` then too.
    fn each_row(&self, x: &[f64], each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        // Parameters and one record's initial states; a few lane counts, so that short vectors stay cheap.
        let parameters = self
            .free
            .iter()
            .filter(|&&i| i < self.parameter_count())
            .count();
        match parameters + self.states() {
            0..=4 => self.each_row_in_lanes::<4>(x, &self.free, each),
            5..=6 => self.each_row_in_lanes::<6>(x, &self.free, each),
            7..=8 => self.each_row_in_lanes::<8>(x, &self.free, each),
            9..=12 => self.each_row_in_lanes::<12>(x, &self.free, each),
            // One lane more, and a compiler copies a dual by a call instead of in registers.
            13..=15 => self.each_row_in_lanes::<15>(x, &self.free, each),
            _ => self.each_row_in_lanes::<8>(x, &self.free, each),
        }
    }

    /// The same with derivatives by some of the entries, in simulators of so many lanes.
    fn each_row_in_lanes<const L: usize>(
        &self,
        x: &[f64],
        by: &[usize],
        mut each: impl FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        if self.stopped() {
            return None;
        }
        let columns = by.len() + 1;
        let mut row = vec![0.0; columns];
        let count = self.parameter_count();
        // What the commands of the loop do to the plant: its commands for the derivatives, for the residual what it was given
        // less that.
        let mut response: Option<(Response, Vec<f64>)> = self
            .feedback
            .as_ref()
            .map(|feedback| (feedback.response(columns), vec![0.0; columns]));
        for (r, record) in self.records.iter().enumerate() {
            let own = self.states_of(r);
            let plant = self.plant_states_of(r);
            if let Some((response, commands)) = &mut response {
                response.reset();
                commands.fill(0.0);
            }
            // Columns of this record: the free parameters and its own initial levels, in lanes of one simulator or,
            // where they are too many, of several that run side by side.
            let lanes: Vec<usize> = (0..by.len())
                .filter(|&column| by[column] < count || own.contains(&by[column]))
                .collect();
            let mut chunks: Vec<&[usize]> = lanes.chunks(L.max(1)).collect();
            if chunks.is_empty() {
                chunks.push(&[]);
            }
            let mut simulators = Vec::with_capacity(chunks.len());
            for chunk in &chunks {
                let dual = |i: usize| {
                    let lane = chunk
                        .iter()
                        .position(|&column| by[column] == i)
                        .unwrap_or(L);
                    Dual::<L>::variable(x[i], lane)
                };
                let theta: Vec<_> = (0..count).map(dual).collect();
                let levels: Vec<_> = plant.clone().map(dual).collect();
                let begin = self.clock.begins[r];
                let mut simulator = Simulator::starting_at(
                    begin,
                    &self.structure,
                    &theta,
                    &levels,
                    at_rest(record),
                )
                .ok()?;
                simulator.set_substeps(self.substeps);
                let regulator = self.feedback.as_ref().map(|feedback| {
                    let states: Vec<_> = (plant.end..own.end).map(dual).collect();
                    feedback.controller.start(&states)
                });
                simulators.push((simulator, regulator));
            }
            let n = record.len();
            for k in 0..n {
                row.fill(0.0);
                let mut model = f64::NAN;
                for ((simulator, regulator), chunk) in simulators.iter_mut().zip(&chunks) {
                    let y = simulator.read();
                    model = y.re;
                    for (lane, &column) in chunk.iter().enumerate() {
                        row[column] = y.eps[lane];
                    }
                    if k + 1 == n {
                        continue;
                    }
                    let h = record.time[k + 1] - record.time[k];
                    match (regulator, &self.feedback) {
                        (Some(regulator), Some(feedback)) => {
                            let beside = feedback.replays[r].beside[k];
                            let u = regulator.command_beside(reference(record, k), y, beside, h);
                            if let Some((_, commands)) = &mut response {
                                for (lane, &column) in chunk.iter().enumerate() {
                                    commands[column] = -u.eps[lane];
                                }
                                commands[columns - 1] = u.re - record.inputs[0].values[k];
                            }
                            simulator.advance_held(u, second_command(record, k), h);
                        }
                        _ => simulator.advance_both(commands(record, k), h),
                    }
                }
                row[columns - 1] = record.outputs[0].values[k] - model;
                if let Some((response, commands)) = &mut response {
                    response.add_to(&mut row);
                    response.advance(commands);
                }
                let sample = Sample {
                    first: k == 0,
                    missing: record.outputs[0].values[k].is_nan(),
                };
                let derivatives = row[..columns - 1].iter().all(|value| value.is_finite());
                let residual = row[columns - 1].is_finite() || sample.missing;
                if !(derivatives && residual && model.is_finite()) {
                    return None;
                }
                if !each(sample, &mut row) {
                    return None;
                }
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::collections::BTreeMap;

    use super::*;
    use ct_signals::Channel;
    use plants::{Known, Plant};

    #[test]
    fn a_cost_above_a_limit_is_seen_with_and_without_derivatives() {
        let wave = |k: usize| 5.0 + (0.1 * k as f64).sin();
        let record = Record {
            name: "wave".into(),
            time: (0..300).map(|k| 2.0 * k as f64).collect(),
            inputs: vec![Channel::new("u", "V", (0..300).map(wave).collect())],
            outputs: vec![Channel::new(
                "y",
                "cm",
                (0..300).map(|k| 2.0 * wave(k + 40)).collect(),
            )],
            references: Vec::new(),
            calendar: None,
        };
        let records = [record];
        let fixed = BTreeMap::new();
        let known = Known::default();
        let setup = Setup::from_records(Plant::CascadedTanks, known, &[], &records, fixed).unwrap();
        let x = [0.05, 0.1, 0.08, 7.0, 9.0];
        for noise in [
            ArModel::white(1.0),
            ArModel::from_coefficients(&[0.9, -0.3], 0.2).unwrap(),
        ] {
            let cost = setup.linearise(&x, &noise).unwrap().cost();
            for (share, above) in [(1.0 - 1e-6, true), (1.0, false), (1.0 + 1e-6, false)] {
                let limit = share * cost;
                assert_eq!(setup.costs_more(&x, &noise, limit), above);
                let below = setup.linearise_below(&x, &noise, limit);
                assert_eq!(below.map(|below| below.cost()), (!above).then_some(cost));
            }
            assert!(setup.costs_more(&[f64::NAN; 5], &noise, f64::INFINITY));
        }
    }
}
