//! Derivatives of a simulation, sample by sample.

use ct_signals::Record;
use estimation::{Noise, Prior, Residuals, Rows, Sample, Triangle};
use plants::controller::Regulator;
use plants::{Dual, Simulator, SimulatorNumber};

use super::{Setup, at_rest, commands, reference, second_command};
use crate::dynamics::{Dynamics, Entries};
use crate::feedback::step;

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
        let entries = Entries {
            records: self.records,
            x,
            parameters: self.parameter_count(),
            states: self.states(),
            outputs: self.outputs(),
            by,
        };
        let response = self.feedback.as_ref();
        let response = response.map(|feedback| (feedback.response(by.len() + 1), vec![0]));
        entries.each_row(
            response,
            |r: usize, theta: &[T], states: &[T]| self.kernel(r, theta, states),
            each,
        )
    }

    /// The kernel of a record, before its first row.
    fn kernel<T: SimulatorNumber>(
        &self,
        r: usize,
        theta: &[T],
        states: &[T],
    ) -> Option<Kernel<'_, T>> {
        let record = &self.records[r];
        let (levels, of_controller) = states.split_at(self.plant_states_of(r).len());
        let begin = self.clock.begins[r];
        let rest = at_rest(record);
        let simulator = Simulator::starting_at(begin, &self.structure, theta, levels, rest);
        let mut simulator = simulator.ok()?;
        simulator.set_substeps(self.substeps);
        let controlled = self.feedback.as_ref().map(|feedback| Controlled {
            regulator: feedback.controller.start(of_controller),
            output: feedback.controller.output(),
            beside: &feedback.replays[r].beside,
            command: T::constant(0.0),
        });
        Some(Kernel {
            record,
            simulator,
            controlled,
        })
    }
}

/// The kernel of a plant with its controller, on one record.
struct Kernel<'a, T: SimulatorNumber> {
    record: &'a Record,
    simulator: Simulator<T>,
    controlled: Option<Controlled<'a, T>>,
}

/// The controller of a simulated loop.
struct Controlled<'a, T> {
    regulator: Regulator<T>,
    /// The output that it reads.
    output: usize,
    beside: &'a [f64],
    /// Its present command.
    command: T,
}

impl<T: SimulatorNumber> Dynamics<T> for Kernel<'_, T> {
    fn read(&mut self, row: usize, outputs: &mut [T], commands: &mut Vec<T>) {
        for (o, output) in outputs.iter_mut().enumerate() {
            *output = self.simulator.read(o);
        }
        if let Some(of) = &mut self.controlled {
            let (reference, h) = (reference(self.record, row), step(self.record, row));
            let read = outputs[of.output];
            of.command = of
                .regulator
                .command_beside(reference, read, of.beside[row], h);
            commands.push(of.command);
        }
    }

    fn advance(&mut self, row: usize) -> Option<()> {
        let record = self.record;
        let h = record.time[row + 1] - record.time[row];
        match &self.controlled {
            Some(of) => {
                let second = second_command(record, row);
                self.simulator.advance_held(of.command, second, h);
            }
            None => self.simulator.advance_both(commands(record, row), h),
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
