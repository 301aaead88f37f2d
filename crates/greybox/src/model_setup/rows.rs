//! Simulates the records: rows of residuals and their derivatives.

use ct_model::{Dual, Model, OperatingPoint, Output, Simulation, SimulationNumber, Variable};
use ct_signals::{Hold, Record};
use estimation::{Prior, Residuals, Sample};
use std::sync::atomic::{AtomicBool, Ordering};

use super::ModelSetup;
use super::simulated_loop::{LoopController, Regulators, SimulatedLoop};
use crate::dynamics::{Dynamics, Entries, Instant};

impl<'a> ModelSetup<'a> {
    /// The outputs that the model gives, a series for each record and output; `None` where the simulation cannot go on.
    #[must_use]
    pub fn simulate(&self, x: &[f64]) -> Option<Vec<Vec<f64>>> {
        if self.is_run_in_loop() {
            return self.outputs_at(x);
        }
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
        self.outputs_at(x)
    }

    /// The outputs of a simulation of this setup, a series for each record and output.
    fn outputs_at(&self, x: &[f64]) -> Option<Vec<Vec<f64>>> {
        let mut all = vec![Vec::new(); self.records.len() * self.samples.len()];
        let begin =
            |r: usize, theta: &[f64], states: &[f64]| Some(self.simulation(r, theta, states));
        let entries = self.entries(x, &[]);
        entries.each_instant(begin, |Instant { record, read, .. }| {
            for (o, y) in read.iter().enumerate() {
                all[record * self.samples.len() + o].push(*y);
            }
            Some(())
        })?;
        Some(all)
    }

    /// The first variable with a hard nonlinearity that acts in the records, of states or of `driven` inputs
    /// ([`ct_model::ModelSpec::hard_nonlinearity`]); `None` without one, and where the simulation cannot go on.
    #[must_use]
    pub fn hard_nonlinearity(&self, x: &[f64], driven: &[usize]) -> Option<Variable> {
        let spec = self.model.spec();
        let (count, states) = (self.parameter_count(), spec.states.len());
        let series = self.simulate_states(x)?;
        let mut points = Vec::new();
        for (r, record) in self.records.iter().enumerate() {
            let states = &series[r * states..][..states];
            points.extend(self.model_time(r).into_iter().enumerate().map(|(k, time)| {
                let states: Vec<f64> = states.iter().map(|series| series[k]).collect();
                let inputs = record.inputs.iter().map(|input| input.values[k]);
                (time, states, inputs.collect::<Vec<f64>>())
            }));
        }
        let points = points.iter().map(|(time, states, inputs)| OperatingPoint {
            time: *time,
            states,
            inputs,
        });
        spec.hard_nonlinearity(&x[..count], driven, points)
    }

    /// The states that the model gives, a series for each record and state; `None` where the simulation cannot go on.
    #[must_use]
    pub fn simulate_states(&self, x: &[f64]) -> Option<Vec<Vec<f64>>> {
        let states = 0..self.model.spec().states.len();
        self.simulate_variables(x, &states.map(Variable::State).collect::<Vec<_>>())
    }

    /// Variables of the model, a series for each record and variable; `None` where the simulation cannot go on.
    #[must_use]
    pub fn simulate_variables(&self, x: &[f64], variables: &[Variable]) -> Option<Vec<Vec<f64>>> {
        let mut spec = self.model.spec().clone();
        let shown = match self.is_run_in_loop() {
            true => self.clone(),
            false => self.on_measured_inputs(),
        };
        // The controllers of a loop read the outputs.
        let outputs = match &shown.simulated_loop {
            Some(_) => spec.outputs.len(),
            None => 0,
        };
        spec.outputs.truncate(outputs);
        let variables = variables.iter().map(|&variable| Output { variable });
        spec.outputs.extend(variables);
        let all = spec.outputs.len();
        let model = Model::new(spec);
        let shown = ModelSetup {
            model: &model,
            samples: vec![0; all],
            ..shown
        };
        if all == outputs {
            return Some(Vec::new());
        }
        let simulated = shown.outputs_at(x)?.into_iter().enumerate();
        let simulated = simulated.filter(|(i, _)| i % all >= outputs);
        Some(simulated.map(|(_, series)| series).collect())
    }

    /// The setup without its loop.
    fn on_measured_inputs(&self) -> Self {
        Self {
            simulated_loop: None,
            ..self.clone()
        }
    }

    /// The entries of a vector, and those whose derivatives are computed.
    fn entries<'b>(&'b self, x: &'b [f64], by: &'b [usize]) -> Entries<'b> {
        Entries {
            records: self.records,
            x,
            parameters: self.parameter_count(),
            states: self.model.spec().states.len(),
            outputs: self.samples.len(),
            by,
        }
    }

    /// The simulation of a record, before its first row.
    fn simulation<T: SimulationNumber>(
        &self,
        r: usize,
        parameters: &[T],
        initial: &[T],
    ) -> InLoop<'_, T> {
        let inputs = vec![0.0; self.model.spec().inputs.len()];
        let begin = self.clock.begins[r] / self.time_unit;
        let simulated_loop = self.simulated_loop.as_deref();
        InLoop {
            record: &self.records[r],
            begin,
            time_unit: self.time_unit,
            simulation: Simulation::new(self.model, parameters, initial, begin)
                .with_tolerance(self.tolerance),
            regulators: simulated_loop.map(|of| Regulators::new(of, r, inputs.len())),
            controllers: simulated_loop.map_or(&[], SimulatedLoop::controllers),
            reads_driven: self.reads_driven,
            to: inputs.clone(),
            inputs,
        }
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
        let response = self.simulated_loop.as_deref().map(|of| {
            let driven = of.controllers().iter().map(|controller| controller.input);
            (of.response(by.len() + 1), driven.collect())
        });
        let begin = |r: usize, theta: &[T], states: &[T]| Some(self.simulation(r, theta, states));
        self.entries(x, by).each_row(response, begin, each)
    }
}

/// The simulation of a model's text on one record, with the controllers of its loop if that is simulated.
struct InLoop<'a, T> {
    record: &'a Record,
    /// Time of the first row \[the model's unit of time\].
    begin: f64,
    /// Seconds in the model's unit of time.
    time_unit: f64,
    simulation: Simulation<'a, T>,
    regulators: Option<Regulators<'a, T>>,
    controllers: &'a [LoopController],
    /// The outputs contain the present commands.
    reads_driven: bool,
    /// The inputs at the beginning and at the end of the present interval.
    inputs: Vec<f64>,
    to: Vec<f64>,
}

impl<T: SimulationNumber> Dynamics<T> for InLoop<'_, T> {
    fn read(&mut self, row: usize, outputs: &mut [T], commands: &mut Vec<T>) {
        let record = self.record;
        for (i, input) in record.inputs.iter().enumerate() {
            self.inputs[i] = input.values[row];
            self.to[i] = match input.hold {
                Hold::First if row + 1 < record.len() => input.values[row + 1],
                _ => input.values[row],
            };
        }
        self.simulation.read(&self.inputs, outputs);
        let Some(regulators) = &mut self.regulators else {
            return;
        };
        let driven_inputs = self.controllers.iter().map(|controller| controller.input);
        if self.reads_driven {
            // These commands do not depend on these outputs.
            let mut ahead = regulators.clone();
            let driven = ahead.commands(record, row, outputs);
            self.simulation.drive(driven);
            for i in driven_inputs.clone() {
                self.inputs[i] = driven[i].map_or(self.inputs[i], |driven| driven.value());
            }
            self.simulation.read(&self.inputs, outputs);
        }
        let driven = regulators.commands(record, row, outputs);
        self.simulation.drive(driven);
        for i in driven_inputs {
            if let Some(driven) = driven[i] {
                (self.inputs[i], self.to[i]) = (driven.value(), driven.value());
                commands.push(driven);
            }
        }
    }

    fn advance(&mut self, row: usize) -> Option<()> {
        let since = self.record.time[row + 1] - self.record.time[0];
        let until = self.begin + since / self.time_unit;
        self.simulation.advance(&self.inputs, &self.to, until).ok()
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
