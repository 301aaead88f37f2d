//! Simulation of a model and its controllers in a loop, from the references: method and derivation are those of
//! [`crate::feedback`], here for several controllers.

use std::sync::Arc;

use ct_model::{ModelSpec, Scalar, Variable};
use ct_signals::Record;
use nalgebra::DMatrix;
use plants::controller::{Controller, Regulator};

use super::ModelSetup;
use crate::Error;
use crate::feedback::{
    LinearResponse, Replay, Response, replay_of, require_moving_reference, step,
};

/// A model whose linear response grows by this number of factors e over the longest record is not linearised: its loop acts on the rows.
const GROWTH: f64 = 3.0;

/// A controller that drives an input of a model; it reads the output [`Controller::output`].
#[derive(Debug, Clone, PartialEq)]
pub struct LoopController {
    /// The control law, in seconds and the units of the record.
    pub controller: Controller,
    /// The input that it drives, by its position.
    pub input: usize,
    /// Its reference, by its position among the references of a record.
    pub reference: usize,
}

/// Controllers around a model, with the measured signals of its records.
#[derive(Debug, Clone)]
pub struct SimulatedLoop {
    controllers: Vec<LoopController>,
    /// By record and controller.
    replays: Vec<Vec<Replay>>,
    response: Arc<LinearResponse>,
}

impl SimulatedLoop {
    /// Closes the loop around a model. Its linear response, which removes the action of the loop from rows, is that at the parameters and
    /// initial states of a fitted vector.
    ///
    /// # Errors
    /// [`Error::DirectTerm`] if a controller reads an output that its command changes at once; if a record lacks a reference or has a constant
    /// one, or a command is not held; [`Error::Stopped`] if the model has no finite simulation or no linear response.
    pub fn new(
        setup: &ModelSetup,
        x: &[f64],
        controllers: &[LoopController],
    ) -> Result<Self, Error> {
        let spec = setup.model.spec();
        for of in controllers {
            let read = spec.outputs[of.controller.output()].variable;
            if spec.is_direct(read, Variable::Input(of.input)) {
                return Err(Error::DirectTerm {
                    output: spec.about(read).name.clone(),
                    input: spec.about(Variable::Input(of.input)).name.clone(),
                });
            }
            require_moving_reference(setup.records, of.reference)?;
        }
        let replay = |record: &Record| {
            let all = controllers.iter();
            all.map(|of| replay_of(&of.controller, record, of.input, of.reference))
                .collect()
        };
        Ok(Self {
            replays: setup
                .records
                .iter()
                .map(replay)
                .collect::<Result<_, Error>>()?,
            response: Arc::new(response(setup, x, controllers)?),
            controllers: controllers.to_vec(),
        })
    }

    /// The controllers.
    #[must_use]
    pub fn controllers(&self) -> &[LoopController] {
        &self.controllers
    }

    /// The controllers simulated on the measured signals, by record and controller.
    #[must_use]
    pub fn replays(&self) -> &[Vec<Replay>] {
        &self.replays
    }

    /// Whether an output contains a driven input without a state in between.
    pub(super) fn is_read(&self, spec: &ModelSpec) -> bool {
        let mut outputs = spec.outputs.iter().map(|output| output.variable);
        outputs.any(|read| {
            let mut driven = self.controllers.iter().map(|of| Variable::Input(of.input));
            driven.any(|input| spec.is_direct(read, input))
        })
    }

    pub(super) fn response(&self, columns: usize) -> Response {
        Response::new(self.response.clone(), columns)
    }
}

/// The controllers of one simulated record.
pub(super) struct Regulators<'a, T> {
    of: &'a SimulatedLoop,
    record: usize,
    running: Vec<Regulator<T>>,
    /// The present commands, by input.
    driven: Vec<Option<T>>,
}

impl<'a, T: Scalar> Regulators<'a, T> {
    pub fn new(of: &'a SimulatedLoop, record: usize, inputs: usize) -> Self {
        let states = |replay: &Replay| replay.states.iter().map(|x| T::constant(*x)).collect();
        let running = of.controllers.iter().zip(&of.replays[record]);
        let running = running.map(|(of, replay)| {
            let states: Vec<T> = states(replay);
            of.controller.start(&states)
        });
        Self {
            of,
            record,
            running: running.collect(),
            driven: vec![None; inputs],
        }
    }

    /// The commands at row `k` for the simulated outputs, by input; `None` for an input that no controller drives.
    pub fn commands(&mut self, record: &Record, k: usize, outputs: &[T]) -> &[Option<T>] {
        let replays = &self.of.replays[self.record];
        for ((of, replay), running) in
            (self.of.controllers.iter().zip(replays)).zip(&mut self.running)
        {
            let reference = record.references[of.reference].values[k];
            let read = outputs[of.controller.output()];
            let command =
                running.command_beside(reference, read, replay.beside[k], step(record, k));
            self.driven[of.input] = Some(command);
        }
        &self.driven
    }
}

impl<'a> ModelSetup<'a> {
    /// The same fit in closed loop: rows and residuals of fits ([`estimation::Residuals`]) are those of the loop, simulated from its
    /// references and filtered such that the residual is the disturbance at the outputs. [`ModelSetup::simulate`] still runs on the measured
    /// inputs, so that simulation errors are comparable. The loop is that of the records of this setup.
    #[must_use]
    pub fn in_loop(self, simulated: Arc<SimulatedLoop>) -> Self {
        Self {
            simulated_loop: Some(simulated),
            ..self
        }
    }

    /// Root mean square of the difference from the measurements in a simulation on the measured inputs, for each output \[its unit\], without
    /// missing samples; `None` where the simulation cannot go on.
    #[must_use]
    pub fn rmse(&self, x: &[f64]) -> Option<Vec<f64>> {
        let simulated = self.simulate(x)?;
        let of_output = |o: usize| {
            let measured = self.records.iter().map(move |record| &record.outputs[o]);
            let series = simulated.iter().skip(o).step_by(self.outputs());
            let squares = measured
                .zip(series)
                .flat_map(|(y, m)| y.values.iter().zip(m))
                .filter(|(y, _)| !y.is_nan())
                .map(|(y, m)| (y - m).powi(2));
            (squares.sum::<f64>() / self.samples[o].max(1) as f64).sqrt()
        };
        Some((0..self.outputs()).map(of_output).collect())
    }
}

/// The linear response of a model to its driven inputs at the mean of its simulated states and measured inputs. Delays are left out, and so
/// is a direct term: the response affects the variance of estimates only. A model that grows has none.
fn response(
    setup: &ModelSetup,
    x: &[f64],
    controllers: &[LoopController],
) -> Result<LinearResponse, Error> {
    let spec = setup.model.spec();
    let (n, count) = (spec.states.len(), setup.parameter_count());
    let series = setup.simulate_states(x).ok_or(Error::Stopped)?;
    let rows: usize = setup.records.iter().map(Record::len).sum();
    let mean = |all: &mut dyn Iterator<Item = f64>| all.sum::<f64>() / rows as f64;
    let states: Vec<f64> = (0..n)
        .map(|i| mean(&mut series.iter().skip(i).step_by(n).flatten().copied()))
        .collect();
    let inputs: Vec<f64> = (0..spec.inputs.len())
        .map(|i| {
            let records = setup.records.iter();
            mean(&mut records.flat_map(|record| record.inputs[i].values.iter().copied()))
        })
        .collect();
    let time = setup.model_time(0);
    let time = time.get(time.len() / 2).copied().unwrap_or(0.0);
    let model = setup.model;
    let form = model.linear_undelayed(&x[..count], &states, &inputs, time);
    let form = form.ok_or(Error::Stopped)?;
    let interval = setup.records.iter().map(Record::sample_interval);
    let interval = interval.fold(0.0, f64::max) / setup.time_unit;
    // Phi and g of held inputs are blocks of one matrix exponential.
    let m = controllers.len();
    let mut blocks = DMatrix::zeros(n + m, n + m);
    for i in 0..n {
        for j in 0..n {
            blocks[(i, j)] = form.a[i][j] * interval;
        }
        for (j, of) in controllers.iter().enumerate() {
            blocks[(i, n + j)] = form.b[i][of.input] * interval;
        }
    }
    let blocks = blocks.exp();
    let phi = blocks.view((0, 0), (n, n)).into_owned();
    let largest = phi
        .complex_eigenvalues()
        .iter()
        .map(|v| v.norm())
        .fold(0.0, f64::max);
    let longest = setup.records.iter().map(Record::len).max().unwrap_or(0);
    if !(largest.ln() * longest as f64 <= GROWTH) {
        return Ok(LinearResponse {
            a: Vec::new(),
            b: Vec::new(),
            outputs: vec![Vec::new(); spec.outputs.len()],
        });
    }
    let row = |c: &Vec<f64>| {
        let all = c.iter().copied().enumerate();
        all.filter(|(_, coefficient)| *coefficient != 0.0).collect()
    };
    let column = |j: usize| blocks.view((0, j), (n, 1)).iter().copied().collect();
    Ok(LinearResponse {
        a: phi
            .row_iter()
            .map(|row| row.iter().copied().collect())
            .collect(),
        b: (n..n + m).map(column).collect(),
        outputs: form.c.iter().map(row).collect(),
    })
}
