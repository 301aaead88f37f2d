//! The linear response of a model to its inputs.

use std::sync::Arc;

use ct_model::LinearForm;
use ct_signals::Record;
use nalgebra::DMatrix;

use super::ModelSetup;
use crate::feedback::{LinearResponse, Response};

/// Growth of a deviation over the longest record, as a power of e, above which a linear response grows too far.
const GROWTH: f64 = 3.0;
/// ... and above which a model does not follow a record on its measured inputs: no initial state is known well enough.
const FOLLOWS: f64 = 7.0;

impl ModelSetup<'_> {
    /// The linear response of the model to some inputs at the mean of its simulated states and measured inputs. Delays are left out, and so
    /// is a direct term: the response affects the variance of estimates only. A model without a finite simulation has none. `needs_loop`: the model does not follow the records on the measured inputs; it is linearised at its initial
    /// states.
    pub(super) fn response(&self, x: &[f64], driven: &[usize], needs_loop: bool) -> LinearResponse {
        let spec = self.model.spec();
        let none = || LinearResponse::none(spec.outputs.len());
        let n = spec.states.len();
        if n == 0 {
            return none();
        }
        let form = match needs_loop && !self.is_run_in_loop() {
            true => self.linear_at_start(x),
            false => self.linearised(x),
        };
        let Some(form) = form else {
            return none();
        };
        let interval = self.sample_interval() / self.time_unit;
        // Phi and g of held inputs are blocks of one matrix exponential.
        let m = driven.len();
        let mut blocks = DMatrix::zeros(n + m, n + m);
        for i in 0..n {
            for j in 0..n {
                blocks[(i, j)] = form.a[i][j] * interval;
            }
            for (j, &input) in driven.iter().enumerate() {
                blocks[(i, n + j)] = form.b[i][input] * interval;
            }
        }
        let blocks = blocks.exp();
        let phi = blocks.view((0, 0), (n, n)).into_owned();
        if !phi.iter().all(|value| value.is_finite()) {
            return none();
        }
        let row = |c: &Vec<f64>| {
            let all = c.iter().copied().enumerate();
            all.filter(|(_, coefficient)| *coefficient != 0.0).collect()
        };
        let column = |j: usize| blocks.view((0, j), (n, 1)).iter().copied().collect();
        LinearResponse {
            a: phi
                .row_iter()
                .map(|row| row.iter().copied().collect())
                .collect(),
            b: (n..n + m).map(column).collect(),
            outputs: form.c.iter().map(row).collect(),
            gain: Vec::new(),
        }
    }

    /// Whether a linear response grows too far over the longest record.
    pub(super) fn grows(&self, response: &LinearResponse) -> bool {
        let longest = self.records.iter().map(Record::len).max().unwrap_or(0);
        !response.a.is_empty() && response.growth() * longest as f64 > GROWTH
    }

    /// The linear form of the model without its dead times at the mean of its simulated states and measured inputs, in the middle of the first
    /// record; `None` without a finite simulation.
    fn linearised(&self, x: &[f64]) -> Option<LinearForm> {
        let spec = self.model.spec();
        let (n, count) = (spec.states.len(), self.parameter_count());
        let series = self.simulate_states(x)?;
        let rows: usize = self.records.iter().map(Record::len).sum();
        let mean = |all: &mut dyn Iterator<Item = f64>| all.sum::<f64>() / rows as f64;
        let states: Vec<f64> = (0..n)
            .map(|i| mean(&mut series.iter().skip(i).step_by(n).flatten().copied()))
            .collect();
        let inputs: Vec<f64> = (0..spec.inputs.len())
            .map(|i| {
                let records = self.records.iter();
                mean(&mut records.flat_map(|record| record.inputs[i].values.iter().copied()))
            })
            .collect();
        let time = self.model_time(0);
        let time = time.get(time.len() / 2).copied().unwrap_or(0.0);
        self.model
            .linear_undelayed(&x[..count], &states, &inputs, time)
    }

    /// The fastest time constant of the model at a fitted vector, by its linear form at the mean of its states and inputs \[s\]: infinite if
    /// it only integrates, 0 without states; `None` without a finite simulation. Dead times are left out.
    #[must_use]
    pub fn fastest_time_constant(&self, x: &[f64]) -> Option<f64> {
        let n = self.model.spec().states.len();
        if n == 0 {
            return Some(0.0);
        }
        let form = self.linearised(x)?;
        let a = DMatrix::from_fn(n, n, |i, j| form.a[i][j]);
        if !a.iter().all(|value| value.is_finite()) {
            return None;
        }
        let rates = a.complex_eigenvalues();
        let fastest = rates.iter().map(|rate| rate.norm()).fold(0.0, f64::max);
        Some(self.time_unit / fastest)
    }

    /// The linear form at the initial states of the first record and its mean inputs.
    fn linear_at_start(&self, x: &[f64]) -> Option<LinearForm> {
        let (n, count) = (self.model.spec().states.len(), self.parameter_count());
        let record = self.records.first()?;
        let inputs = record.inputs.iter();
        let inputs: Vec<f64> = inputs
            .map(|input| input.values.iter().sum::<f64>() / record.len() as f64)
            .collect();
        let states = x.get(count..count + n)?;
        self.model
            .linear_undelayed(&x[..count], states, &inputs, 0.0)
    }

    /// Whether a model follows its records on the measured inputs: it does not if it is unstable at the initial states of the first record, and
    /// a deviation grows by far more than it is known. Such a model follows a record only in the control loop that the record comes from.
    #[must_use]
    pub fn follows_inputs(&self, x: &[f64]) -> bool {
        let longest = self.records.iter().map(Record::duration);
        let longest = longest.fold(0.0, f64::max);
        self.growth_time(x)
            .is_none_or(|growth_time| longest <= FOLLOWS * growth_time)
    }

    /// The longest record that a model with this growth time follows \[s\].
    #[must_use]
    pub fn longest_followed(growth_time: f64) -> f64 {
        FOLLOWS * growth_time
    }

    /// Time in which a deviation of the states grows by a factor of e \[s\], by the linear form of the model at the initial states of the first
    /// record and its mean inputs; `None` for a model that is not unstable there.
    #[must_use]
    pub fn growth_time(&self, x: &[f64]) -> Option<f64> {
        let n = self.model.spec().states.len();
        let form = self.linear_at_start(x)?;
        let a = DMatrix::from_fn(n, n, |i, j| form.a[i][j]);
        if n == 0 || !a.iter().all(|value| value.is_finite()) {
            return None;
        }
        let rates = a.complex_eigenvalues();
        let fastest = rates.iter().map(|rate| rate.re).fold(0.0, f64::max);
        (fastest > 0.0).then(|| self.time_unit / fastest)
    }

    /// The change of each output that a step of each input has caused after `steps` sampling intervals, by input and output, of the linear
    /// response at a fitted vector; zero for a model that has none, or grows.
    #[must_use]
    pub fn step_gains(&self, x: &[f64], steps: usize) -> Vec<Vec<f64>> {
        let inputs: Vec<usize> = (0..self.model.spec().inputs.len()).collect();
        let plant = self.response(x, &inputs, false);
        if self.grows(&plant) {
            return vec![vec![0.0; self.outputs()]; inputs.len()];
        }
        let plant = Arc::new(plant);
        let gains = |i: usize| {
            let mut response = Response::new(plant.clone(), 1);
            let mut commands = vec![0.0; inputs.len()];
            commands[i] = 1.0;
            (0..steps).for_each(|_| response.advance(&commands));
            let of_output = |o: usize| {
                let mut row = [0.0];
                response.add_to(o, &mut row, false);
                row[0]
            };
            (0..self.outputs()).map(of_output).collect()
        };
        inputs.iter().map(|&i| gains(i)).collect()
    }

    pub(super) fn sample_interval(&self) -> f64 {
        let intervals = self.records.iter().map(Record::sample_interval);
        intervals.fold(0.0, f64::max)
    }
}
