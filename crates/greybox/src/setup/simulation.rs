//! Simulations of a setup, on the measured command or in closed loop, and their residuals.

use ct_signals::{Channel, Record};
use plants::{MAX_VESSELS, Scales, Simulator, deciles};

use super::{Setup, at_rest, commands, reference, second_command};
use crate::{Error, feedback::step};

/// Result of a closed-loop simulation driven by the reference.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopRun {
    /// The readings, a series for each record and output (in the order of [`estimation::Rows`]).
    pub output: Vec<Vec<f64>>,
    /// The controller's command, a series for each record.
    pub command: Vec<Vec<f64>>,
}

/// Result of a simulation on the measured command.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// The readings, a series for each record and output (in the order of [`estimation::Rows`]).
    pub output: Vec<Vec<f64>>,
    /// Smallest and largest level of each vessel over all records.
    pub level: [(f64, f64); MAX_VESSELS],
    /// Mean level of each vessel over all records.
    pub mean_level: [f64; MAX_VESSELS],
}

impl Setup<'_> {
    /// Simulates one record; `each` is called with the simulator at every sample.
    fn run(
        &self,
        record: &Record,
        simulator: &mut Simulator<f64>,
        mut each: impl FnMut(&mut Simulator<f64>),
    ) {
        simulator.set_substeps(self.substeps);
        let n = record.len();
        for k in 0..n {
            each(simulator);
            if k + 1 < n {
                simulator.advance_both(commands(record, k), record.time[k + 1] - record.time[k]);
            }
        }
    }

    /// Simulates all records on their measured commands.
    ///
    /// # Errors
    /// If the vector has the wrong length, or the computation was cancelled ([`Error::Stopped`]).
    pub fn simulate(&self, x: &[f64]) -> Result<Simulated, Error> {
        self.simulate_seeing(x, |_| ())
    }

    /// As [`Setup::simulate`]; `see` is called with the levels at every sample.
    fn simulate_seeing(
        &self,
        x: &[f64],
        mut see: impl FnMut([f64; MAX_VESSELS]),
    ) -> Result<Simulated, Error> {
        if self.stopped() {
            return Err(Error::Stopped);
        }
        let mut simulated = Simulated {
            output: Vec::with_capacity(self.records.len()),
            level: [(f64::INFINITY, f64::NEG_INFINITY); MAX_VESSELS],
            mean_level: [0.0; MAX_VESSELS],
        };
        for (r, record) in self.records.iter().enumerate() {
            let mut simulator = Simulator::starting_at(
                self.clock.begins[r],
                &self.structure,
                &x[..self.parameter_count()],
                &x[self.plant_states_of(r)],
                at_rest(record),
            )?;
            let mut readings = vec![Vec::with_capacity(record.len()); self.outputs()];
            self.run(record, &mut simulator, |simulator| {
                for (o, readings) in readings.iter_mut().enumerate() {
                    readings.push(simulator.read(o));
                }
                see(simulator.levels());
                for (i, level) in simulator.levels().into_iter().enumerate() {
                    simulated.level[i].0 = simulated.level[i].0.min(level);
                    simulated.level[i].1 = simulated.level[i].1.max(level);
                    simulated.mean_level[i] += level;
                }
            });
            simulated.output.extend(readings);
        }
        let rows = self.records.iter().map(Record::len).sum::<usize>() as f64;
        for mean in &mut simulated.mean_level {
            *mean /= rows;
        }
        Ok(simulated)
    }

    /// Simulates the closed loop driven by the reference; `None` if the setup has no controller.
    ///
    /// # Errors
    /// If the vector has the wrong length.
    pub fn simulate_loop(&self, x: &[f64]) -> Result<Option<LoopRun>, Error> {
        let Some(feedback) = &self.feedback else {
            return Ok(None);
        };
        let mut run = LoopRun {
            output: Vec::with_capacity(self.records.len()),
            command: Vec::with_capacity(self.records.len()),
        };
        for (r, record) in self.records.iter().enumerate() {
            let states = self.plant_states_of(r);
            let theta = &x[..self.parameter_count()];
            let (levels, at_rest) = (&x[states.clone()], at_rest(record));
            let begin = self.clock.begins[r];
            let mut simulator =
                Simulator::starting_at(begin, &self.structure, theta, levels, at_rest)?;
            simulator.set_substeps(self.substeps);
            let mut regulator = feedback
                .controller
                .start(&x[states.end..self.states_of(r).end]);
            let mut command = Vec::with_capacity(record.len());
            let mut readings = vec![Vec::with_capacity(record.len()); self.outputs()];
            for k in 0..record.len() {
                for (o, readings) in readings.iter_mut().enumerate() {
                    readings.push(simulator.read(o));
                }
                let y = readings[feedback.controller.output()][k];
                let h = step(record, k);
                let beside = feedback.replays[r].beside[k];
                let u = regulator.command_beside(reference(record, k), y, beside, h);
                simulator.advance_held(u, second_command(record, k), h);
                command.push(u);
            }
            run.output.extend(readings);
            run.command.push(command);
        }
        Ok(Some(run))
    }

    /// The signal that the noise model describes, a series for each record and output: measured minus model or, if the loop is simulated,
    /// the estimated disturbance at the plant's output. NaN if the sample is missing.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn disturbance(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        if self.feedback.is_none() {
            return self.residuals(x);
        }
        estimation::residuals(self, x).ok_or_else(|| {
            if self.stopped() {
                Error::Stopped
            } else {
                estimation::Error::NoFiniteStart { starts: 1 }.into()
            }
        })
    }

    /// Measured minus model on the measured command, a series for each record and output; NaN if the sample is missing.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn residuals(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        let simulated = self.simulate(x)?;
        Ok(self
            .measured()
            .zip(simulated.output)
            .map(|(measured, model)| {
                let pairs = measured.values.iter().zip(model);
                pairs.map(|(y, m)| y - m).collect()
            })
            .collect())
    }

    /// Root mean square of the series of each output \[output unit\], without missing samples.
    #[must_use]
    pub fn rms_per_output(&self, series: &[Vec<f64>]) -> Vec<f64> {
        let of_output = |o: usize| {
            let own = series.iter().skip(o).step_by(self.outputs()).flatten();
            let (sum, count) = own
                .filter(|v| !v.is_nan())
                .fold((0.0, 0usize), |(sum, count), v| (sum + v * v, count + 1));
            (sum / count.max(1) as f64).sqrt()
        };
        (0..self.outputs()).map(of_output).collect()
    }

    /// Root mean square of all series, each output divided by its scale; without missing samples.
    #[must_use]
    pub fn weighted_rms(&self, series: &[Vec<f64>], scales: &[f64]) -> f64 {
        weighted_rms(&self.rms_per_output(series), scales, &self.samples)
    }

    /// The measured outputs of all records, in the order of the series.
    pub fn measured(&self) -> impl Iterator<Item = &Channel> {
        self.records.iter().flat_map(|record| &record.outputs)
    }

    /// Chooses the smallest number of substeps for which halving the step changes no reading by more than `1e-6` of its output's range.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn choose_substeps(&mut self, x: &[f64]) -> Result<(), Error> {
        // By output, over all records.
        let mut ranges = vec![(f64::INFINITY, f64::NEG_INFINITY); self.outputs()];
        for (series, channel) in self.measured().enumerate() {
            let (low, high) = channel.range();
            let range = &mut ranges[series % self.outputs()];
            *range = (range.0.min(low), range.1.max(high));
        }
        // The simulator cuts steps that are long against a time constant by itself. While these cuts are finer than the substeps, more
        // substeps change nothing, which is no evidence of accuracy.
        let mut limits: Vec<(f64, f64)> = ranges
            .iter()
            .map(|(low, high)| (1e-6 * (high - low), 1e-13 * low.abs().max(high.abs())))
            .collect();
        // The range of a constant output, or of one without samples, is no scale.
        let scaled = |limits: &(f64, f64)| limits.0 > 0.0 && limits.0.is_finite();
        let largest = limits.iter().copied().filter(scaled);
        let largest = largest.fold((0.0_f64, 0.0_f64), |a, b| (a.0.max(b.0), a.1.max(b.1)));
        for limits in limits.iter_mut().filter(|limits| !scaled(limits)) {
            *limits = largest;
        }
        let mut enough = None;
        self.substeps = 1;
        let mut coarse = self.simulate(x)?;
        while self.substeps < 64 {
            let n = self.substeps;
            self.substeps = 2 * n;
            let fine = self.simulate(x)?;
            let mut moved = vec![0.0_f64; limits.len()];
            for (series, (a, b)) in coarse.output.iter().zip(&fine.output).enumerate() {
                let most = a.iter().zip(b).map(|(a, b)| (a - b).abs());
                let moved = &mut moved[series % limits.len()];
                *moved = most.fold(*moved, f64::max);
            }
            let above = |limit: fn(&(f64, f64)) -> f64| {
                let mut pairs = moved.iter().zip(&limits);
                pairs.any(|(moved, limits)| *moved > limit(limits))
            };
            if above(|(tolerance, _)| *tolerance) {
                enough = None;
            } else {
                enough = enough.or(Some(n));
                if above(|(_, rounding)| *rounding) {
                    break;
                }
            }
            coarse = fine;
        }
        self.substeps = enough.unwrap_or(self.substeps);
        Ok(())
    }

    /// The scales that a simulation gives: levels of every vessel and the throughput.
    ///
    /// A level that is not measured is known from the model only, and a wrong model may have it several times too high or too low: its
    /// range is therefore extended down to an empty vessel.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn scales_at(&self, x: &[f64]) -> Result<Scales, Error> {
        let mut levels: [Vec<f64>; MAX_VESSELS] = Default::default();
        let simulated = self.simulate_seeing(x, |visited| {
            for (all, level) in levels.iter_mut().zip(visited) {
                all.push(level);
            }
        })?;
        let plant = self.structure.plant;
        let mut scales = self.structure.scales.clone();
        for (vessel, visited) in levels.into_iter().enumerate().take(plant.vessels()) {
            let (low, high) = simulated.level[vessel];
            if low.is_finite() && high.is_finite() && high > low {
                let measured = scales.outputs.iter().any(|output| output.vessel == vessel);
                scales.level[vessel] = if measured {
                    (low, high)
                } else {
                    (low.min(0.0), high.max(0.0))
                };
                scales.operating_level[vessel] = simulated.mean_level[vessel];
                scales.level_deciles[vessel] = deciles(visited);
            }
        }
        let mean = |signal: fn(&Record) -> Option<&Channel>| {
            let (sum, n) = self
                .records
                .iter()
                .filter_map(signal)
                .flat_map(|signal| &signal.values)
                .fold((0.0, 0usize), |(sum, n), u| (sum + u.abs(), n + 1));
            sum / n as f64
        };
        scales.flow = (x[0] * mean(|record| Some(&record.inputs[0]))).abs();
        if scales.input_2.is_some() {
            // The gain of a second pump is the second parameter; the gain of a disturbance is the plant's last one.
            let gain = if plant.joined() {
                1
            } else {
                plant.parameters(&scales).len() - 1
            };
            scales.flow += (x[gain] * mean(|record| record.inputs.get(1))).abs();
        }
        Ok(scales)
    }
}

/// Root mean square over outputs with these numbers of samples, each output divided by its scale.
#[must_use]
pub fn weighted_rms(rms: &[f64], scales: &[f64], samples: &[usize]) -> f64 {
    let outputs = rms.iter().zip(scales).zip(samples);
    let sum: f64 = outputs
        .map(|((rms, scale), &samples)| samples as f64 * (rms / scale).powi(2))
        .sum();
    (sum / samples.iter().sum::<usize>().max(1) as f64).sqrt()
}
