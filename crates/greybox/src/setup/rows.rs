//! Derivatives of a simulation, sample by sample.

use estimation::{Noise, Prior, Residuals, Rows, Sample, Triangle};
use plants::{Dual, Simulator, SimulatorNumber};

use super::{Setup, at_rest, commands, reference, second_command};
use crate::feedback::Response;

impl Residuals for Setup<'_> {
    fn free(&self) -> &[usize] {
        &self.free
    }

    fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    fn samples(&self) -> &[usize] {
        &self.samples
    }

    fn each_row(&self, x: &[f64], mut each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        self.show_rows(x, &mut each)
    }

    fn each_residual(
        &self,
        x: &[f64],
        mut each: impl FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        self.show_residuals(x, &mut each)
    }

    fn bic_penalty(&self, noise_order: usize) -> f64 {
        Setup::bic_penalty(self, noise_order)
    }

    fn floor(&self, output: usize) -> f64 {
        self.floors[output]
    }

    fn known_scales(&self) -> Option<&[f64]> {
        self.known_scales.as_deref()
    }

    fn priors(&self) -> &[Prior] {
        &self.priors
    }

    fn out_of_time(&self) -> bool {
        Setup::out_of_time(self)
    }
}

impl Setup<'_> {
    /// The R factor of the rows `[d model/d x_free, measured - model]` of all outputs ([`estimation::linearise`]); `None` if the simulation
    /// is not finite.
    #[must_use]
    pub fn linearise(&self, x: &[f64], noise: &Noise) -> Option<Triangle> {
        estimation::linearise(self, x, noise)
    }

    /// The rows `[d model/d x_free, measured - model]` of all samples ([`estimation::rows`]); `None` if the simulation is not finite.
    #[must_use]
    pub fn rows(&self, x: &[f64]) -> Option<Rows> {
        estimation::rows(self, x)
    }

    /// [`Residuals::each_row`]. Not generic, so that simulators with derivatives are compiled in this crate and not again in every crate
    /// that fits.
    #[inline(never)]
    fn show_rows(&self, x: &[f64], each: &mut dyn FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        // A record needs derivatives by the parameters and by its own initial states. A few sizes of duals keep small problems fast.
        let parameters = self
            .free
            .iter()
            .filter(|&&i| i < self.parameter_count())
            .count();
        match parameters + self.states() {
            0..=4 => self.each_row_in::<Dual<4>>(x, &self.free, each),
            5..=8 => self.each_row_in::<Dual<8>>(x, &self.free, each),
            9..=12 => self.each_row_in::<Dual<12>>(x, &self.free, each),
            13..=15 => self.each_row_in::<Dual<15>>(x, &self.free, each),
            16 => self.each_row_in::<Dual<8>>(x, &self.free, each),
            17..=24 => self.each_row_in::<Dual<12>>(x, &self.free, each),
            _ => self.each_row_in::<Dual<15>>(x, &self.free, each),
        }
    }

    /// [`Residuals::each_residual`].
    #[inline(never)]
    fn show_residuals(
        &self,
        x: &[f64],
        each: &mut dyn FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        self.each_row_in::<f64>(x, &[], each)
    }

    /// Passes every row, with derivatives by the entries `by`, to `each`; simulates with this number type.
    fn each_row_in<T: SimulatorNumber>(
        &self,
        x: &[f64],
        by: &[usize],
        each: &mut dyn FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        if self.stopped() {
            return None;
        }
        let columns = by.len() + 1;
        let outputs = self.outputs();
        // The rows of all outputs at one sample.
        let mut rows = vec![0.0; columns * outputs];
        let mut models = vec![f64::NAN; outputs];
        let count = self.parameter_count();
        // Response of the linearised plant to commands of the loop. Its input is, for the derivatives, minus the derivatives of the
        // simulated command and, for the residual, the simulated command minus the measured one.
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
            // Columns of this record: the free parameters and its own initial states. They are the derivatives of one simulator or, if
            // there are too many, of several simulators that run in parallel.
            let lanes: Vec<usize> = (0..by.len())
                .filter(|&column| by[column] < count || own.contains(&by[column]))
                .collect();
            let mut chunks: Vec<&[usize]> = lanes.chunks(T::LANES.max(1)).collect();
            if chunks.is_empty() {
                chunks.push(&[]);
            }
            let mut simulators = Vec::with_capacity(chunks.len());
            for chunk in &chunks {
                let dual = |i: usize| {
                    let lane = chunk
                        .iter()
                        .position(|&column| by[column] == i)
                        .unwrap_or(T::LANES);
                    T::variable(x[i], lane)
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
                rows.fill(0.0);
                for ((simulator, regulator), chunk) in simulators.iter_mut().zip(&chunks) {
                    let mut controlled = None;
                    for (o, model) in models.iter_mut().enumerate() {
                        let y = simulator.read(o);
                        *model = y.value();
                        let row = &mut rows[o * columns..][..columns];
                        for (lane, &column) in chunk.iter().enumerate() {
                            row[column] = y.slopes()[lane];
                        }
                        if self.reads(o) {
                            controlled = Some(y);
                        }
                    }
                    if k + 1 == n {
                        continue;
                    }
                    let h = record.time[k + 1] - record.time[k];
                    match (regulator, &self.feedback, controlled) {
                        (Some(regulator), Some(feedback), Some(y)) => {
                            let beside = feedback.replays[r].beside[k];
                            let u = regulator.command_beside(reference(record, k), y, beside, h);
                            if let Some((_, commands)) = &mut response {
                                for (lane, &column) in chunk.iter().enumerate() {
                                    commands[column] = -u.slopes()[lane];
                                }
                                commands[columns - 1] = u.value() - record.inputs[0].values[k];
                            }
                            simulator.advance_held(u, second_command(record, k), h);
                        }
                        _ => simulator.advance_both(commands(record, k), h),
                    }
                }
                for (output, (row, model)) in
                    rows.chunks_exact_mut(columns).zip(&models).enumerate()
                {
                    let measured = record.outputs[output].values[k];
                    row[columns - 1] = measured - model;
                    if let Some((response, _)) = &response {
                        response.add_to(output, row);
                    }
                    let sample = Sample {
                        output,
                        first: k == 0,
                        missing: measured.is_nan(),
                    };
                    let derivatives = row[..columns - 1].iter().all(|value| value.is_finite());
                    let residual = row[columns - 1].is_finite() || sample.missing;
                    if !(derivatives && residual && model.is_finite() && each(sample, row)) {
                        return None;
                    }
                }
                if let Some((response, commands)) = &mut response {
                    response.advance(commands);
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
    use ct_signals::{ArModel, Channel, Record};
    use estimation::{costs_more, linearise_below};
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
            ..Record::default()
        };
        let records = [record];
        let fixed = BTreeMap::new();
        let known = Known::default();
        let setup = Setup::from_records(Plant::CascadedTanks, known, &[], &records, fixed).unwrap();
        let x = [0.05, 0.1, 0.08, 7.0, 9.0];
        for noise in [
            Noise::white(1),
            Noise::of(vec![ArModel::from_coefficients(&[0.9, -0.3], 0.2).unwrap()]),
        ] {
            let cost = setup.linearise(&x, &noise).unwrap().cost();
            for (share, above) in [(1.0 - 1e-6, true), (1.0, false), (1.0 + 1e-6, false)] {
                let limit = share * cost;
                assert_eq!(costs_more(&setup, &x, &noise, limit), above);
                let below = linearise_below(&setup, &x, &noise, limit);
                assert_eq!(below.map(|below| below.cost()), (!above).then_some(cost));
            }
            assert!(costs_more(&setup, &[f64::NAN; 5], &noise, f64::INFINITY));
        }
    }
}
