//! Simulates the records: rows of residuals and their derivatives.

use ct_model::{Dual, Model, Output, Simulation, SimulationNumber, Variable};
use ct_signals::Hold;
use estimation::{Prior, Residuals, Sample};
use std::sync::atomic::{AtomicBool, Ordering};

use super::ModelSetup;
use super::simulated_loop::Regulators;

/// A row of a record in all simulations: those of the first derivatives come first.
struct Instant<'a, T> {
    record: usize,
    row: usize,
    /// The outputs of each simulation.
    read: &'a [T],
    /// The commands of each simulation, in the order of the controllers; empty without a loop.
    commands: &'a [T],
}

impl<'a> ModelSetup<'a> {
    /// The outputs that the model gives, a series for each record and output; `None` where the simulation cannot go on.
    #[must_use]
    pub fn simulate(&self, x: &[f64]) -> Option<Vec<Vec<f64>>> {
        if self.simulated_loop.is_some() {
            return self.on_measured_inputs().simulate(x);
        }
        let residuals = estimation::residuals(self, x)?;
        let measured = self.records.iter().flat_map(|record| &record.outputs);
        let simulated = measured.zip(residuals);
        // Rows without any reading have no residual: they are simulated separately.
        if simulated
            .clone()
            .all(|(measured, _)| measured.missing() == 0)
        {
            let model =
                simulated.map(|(y, r)| y.values.iter().zip(r).map(|(y, r)| y - r).collect());
            return Some(model.collect());
        }
        let mut all = vec![Vec::new(); self.records.len() * self.samples.len()];
        self.each_instant::<f64>(x, &[], |Instant { record, read, .. }| {
            for (o, y) in read.iter().enumerate() {
                all[record * self.samples.len() + o].push(*y);
            }
            Some(())
        })?;
        Some(all)
    }

    /// The states that the model gives, a series for each record and state; `None` where the simulation cannot go on.
    #[must_use]
    pub fn simulate_states(&self, x: &[f64]) -> Option<Vec<Vec<f64>>> {
        let mut spec = self.model.spec().clone();
        let states = spec.states.len();
        let read = (0..states).map(|x| Output {
            variable: Variable::State(x),
        });
        spec.outputs = read.collect();
        let model = Model::new(spec);
        let shown = ModelSetup {
            model: &model,
            samples: vec![0; states],
            ..self.on_measured_inputs()
        };
        let mut all = vec![Vec::new(); self.records.len() * states];
        if states > 0 {
            shown.each_instant::<f64>(x, &[], |Instant { record, read, .. }| {
                for (i, value) in read.iter().enumerate() {
                    all[record * states + i].push(*value);
                }
                Some(())
            })?;
        }
        Some(all)
    }

    /// The setup without its loop.
    fn on_measured_inputs(&self) -> Self {
        Self {
            simulated_loop: None,
            ..self.clone()
        }
    }

    /// Simulates all records with derivatives with respect to some entries, and passes the outputs row by row to a function: the outputs and
    /// commands of as many simulations as the derivatives need.
    fn each_instant<T: SimulationNumber>(
        &self,
        x: &[f64],
        by: &[usize],
        mut each: impl FnMut(Instant<'_, T>) -> Option<()>,
    ) -> Option<()> {
        let (count, states) = (self.parameter_count(), self.model.spec().states.len());
        let outputs = self.samples.len();
        let mut inputs = vec![0.0; self.model.spec().inputs.len()];
        let mut to = inputs.clone();
        let simulated_loop = self.simulated_loop.as_deref();
        for (r, record) in self.records.iter().enumerate() {
            let own = count + r * states..count + (r + 1) * states;
            let lanes: Vec<usize> = by
                .iter()
                .copied()
                .filter(|i| *i < count || own.contains(i))
                .collect();
            let mut chunks: Vec<&[usize]> = lanes.chunks(T::LANES.max(1)).collect();
            if chunks.is_empty() {
                chunks.push(&[]);
            }
            let begin = self.clock.begins[r] / self.time_unit;
            let mut simulations: Vec<Simulation<'_, T>> = chunks
                .iter()
                .map(|chunk| {
                    let dual = |i: usize| {
                        let lane = chunk.iter().position(|own| *own == i).unwrap_or(T::LANES);
                        T::variable(x[i], lane)
                    };
                    let parameters: Vec<_> = (0..count).map(dual).collect();
                    let initial: Vec<_> = own.clone().map(dual).collect();
                    Simulation::new(self.model, &parameters, &initial, begin)
                        .with_tolerance(self.tolerance)
                })
                .collect();
            let mut read = vec![T::constant(0.0); outputs * chunks.len()];
            let mut regulators: Vec<Regulators<'_, T>> = simulated_loop
                .iter()
                .flat_map(|of| {
                    simulations
                        .iter()
                        .map(|_| Regulators::new(of, r, inputs.len()))
                })
                .collect();
            let mut commands = Vec::new();
            for k in 0..record.len() {
                for (i, input) in record.inputs.iter().enumerate() {
                    inputs[i] = input.values[k];
                    to[i] = match input.hold {
                        Hold::First if k + 1 < record.len() => input.values[k + 1],
                        _ => input.values[k],
                    };
                }
                for (simulation, read) in simulations.iter_mut().zip(read.chunks_exact_mut(outputs))
                {
                    simulation.read(&inputs, read);
                }
                commands.clear();
                let of_simulations = simulations.iter_mut().zip(read.chunks_exact_mut(outputs));
                for (regulators, (simulation, read)) in regulators.iter_mut().zip(of_simulations) {
                    let controllers = || simulated_loop.iter().flat_map(|of| of.controllers());
                    if self.reads_driven {
                        // The outputs contain the present commands, which do not depend on these outputs.
                        let mut ahead = regulators.clone();
                        let driven = ahead.commands(record, k, read);
                        simulation.drive(driven);
                        for i in controllers().map(|controller| controller.input) {
                            inputs[i] = driven[i].map_or(inputs[i], |driven| driven.value());
                        }
                        simulation.read(&inputs, read);
                    }
                    let driven = regulators.commands(record, k, read);
                    simulation.drive(driven);
                    for i in controllers().map(|controller| controller.input) {
                        if let Some(driven) = driven[i] {
                            (inputs[i], to[i]) = (driven.value(), driven.value());
                            commands.push(driven);
                        }
                    }
                }
                each(Instant {
                    record: r,
                    row: k,
                    read: &read,
                    commands: &commands,
                })?;
                if k + 1 < record.len() {
                    let until = begin + (record.time[k + 1] - record.time[0]) / self.time_unit;
                    for simulation in &mut simulations {
                        simulation.advance(&inputs, &to, until).ok()?;
                    }
                }
            }
        }
        Some(())
    }

    /// [`Residuals::each_row`]; not a generic function, so that simulations with derivatives are compiled only in this crate.
    #[inline(never)]
    fn show_rows(&self, x: &[f64], each: &mut dyn FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        // A record has the parameters and its own states.
        let (count, states) = (self.parameter_count(), self.model.spec().states.len());
        let parameters = self.free.iter().filter(|&&i| i < count).count();
        let of = |r: usize| count + r * states..count + (r + 1) * states;
        let own = |r: usize| self.free.iter().filter(|i| of(r).contains(i)).count();
        let lanes = parameters + (0..self.records.len()).map(own).max().unwrap_or(0);
        match lanes {
            0..=2 => self.each_row_in::<Dual<2>>(x, &self.free, each),
            3..=4 => self.each_row_in::<Dual<4>>(x, &self.free, each),
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

    fn each_row_in<T: SimulationNumber>(
        &self,
        x: &[f64],
        by: &[usize],
        each: &mut dyn FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        let (count, states) = (self.parameter_count(), self.model.spec().states.len());
        let columns = by.len() + 1;
        let outputs = self.samples.len();
        let mut row = vec![0.0; columns];
        let in_loop = self.simulated_loop.as_deref();
        let mut response = in_loop.map(|of| (of, of.response(columns)));
        let driven = in_loop.map_or(0, |of| of.controllers().len());
        let mut driven_columns = vec![0.0; driven * columns];
        self.each_instant::<T>(x, by, |instant| {
            let Instant {
                record: r,
                row: k,
                read,
                commands,
            } = instant;
            if let Some((_, response)) = &mut response
                && k == 0
            {
                response.reset();
            }
            let own = count + r * states..count + (r + 1) * states;
            for output in 0..outputs {
                row.fill(0.0);
                let mine = (0..by.len()).filter(|&c| by[c] < count || own.contains(&by[c]));
                for (lane, column) in mine.enumerate() {
                    row[column] =
                        read[lane / T::LANES * outputs + output].slopes()[lane % T::LANES];
                }
                let model = read[output].value();
                let measured = self.records[r].outputs[output].values[k];
                row[columns - 1] = measured - model;
                if let Some((_, response)) = &response {
                    response.add_to(output, &mut row);
                }
                let sample = Sample {
                    output,
                    first: k == 0,
                    missing: measured.is_nan(),
                };
                let derivatives = row[..columns - 1].iter().all(|v| v.is_finite());
                let residual = row[columns - 1].is_finite() || sample.missing;
                let finite = derivatives && residual && model.is_finite();
                if !(finite && each(sample, &mut row)) {
                    return None;
                }
            }
            if let Some((of, response)) = &mut response {
                driven_columns.fill(0.0);
                let all = of
                    .controllers()
                    .iter()
                    .zip(driven_columns.chunks_exact_mut(columns));
                for (d, (of, columns)) in all.enumerate() {
                    let mine = (0..by.len()).filter(|&c| by[c] < count || own.contains(&by[c]));
                    for (lane, column) in mine.enumerate() {
                        let command = commands[lane / T::LANES * driven + d];
                        columns[column] = -command.slopes()[lane % T::LANES];
                    }
                    let measured = self.records[r].inputs[of.input].values[k];
                    if let Some(last) = columns.last_mut() {
                        *last = commands[d].value() - measured;
                    }
                }
                response.advance(&driven_columns);
            }
            Some(())
        })
    }
}

impl Residuals for ModelSetup<'_> {
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
        let interrupted = |flag: &AtomicBool| flag.load(Ordering::Relaxed);
        self.interrupt.is_some_and(interrupted)
            || self.time_limit.as_ref().is_some_and(|limit| limit.passed())
    }
}
