//! Simulation of a model and its controllers in a loop, from the references: method and derivation are those of
//! [`crate::feedback`], here for several controllers.

use std::sync::Arc;

use ct_model::{ModelSpec, Scalar, Variable};
use ct_signals::{Channel, Record};
use plants::controller::{Controller, Regulator};

use super::ModelSetup;
use crate::Error;
use crate::feedback::{
    LinearResponse, Replay, Response, fitting, replay_of, spectral_radius, step,
};

/// A controller that drives an input of a model; it reads the output [`Controller::output`].
#[derive(Debug, Clone, PartialEq)]
pub struct LoopController {
    /// The control law, in seconds and the units of the record.
    pub controller: Controller,
    /// The input that it drives, by its position.
    pub input: usize,
    /// Its reference, by its position among the references of a record; `None` if it is not recorded.
    pub reference: Option<usize>,
}

/// Controllers around a model, with the measured signals of its records.
#[derive(Debug, Clone)]
pub struct SimulatedLoop {
    pub(super) controllers: Vec<LoopController>,
    /// By record and controller.
    replays: Vec<Vec<Replay>>,
    pub(super) response: Arc<LinearResponse>,
    /// Sampling interval \[s\].
    interval: f64,
    /// The model does not follow its records on the measured inputs ([`ModelSetup::follows_inputs`]): all its simulations run in the loop.
    is_needed: bool,
}

impl SimulatedLoop {
    /// Closes the loop around a model. Its linear response, which removes the action of the loop from rows, is that at the parameters and
    /// initial states of a fitted vector.
    ///
    /// # Errors
    /// [`Error::LoopSignals`]; [`Error::DirectTerm`] if a controller reads an output that a command changes at once; if a record lacks a
    /// reference, nothing from outside moves the loop, or a command is not held.
    pub fn new(
        setup: &ModelSetup,
        x: &[f64],
        controllers: &[LoopController],
    ) -> Result<Self, Error> {
        Self::around(setup, x, controllers, setup.is_run_in_loop())
    }

    /// The loop of a model that does not follow its records on the measured inputs ([`ModelSetup::follows_inputs`]): all its simulations run in
    /// the loop. Its linear response is that at the initial states of the vector.
    ///
    /// # Errors
    /// As [`SimulatedLoop::new`].
    pub fn needed(
        setup: &ModelSetup,
        x: &[f64],
        controllers: &[LoopController],
    ) -> Result<Self, Error> {
        Self::around(setup, x, controllers, true)
    }

    fn around(
        setup: &ModelSetup,
        x: &[f64],
        controllers: &[LoopController],
        is_needed: bool,
    ) -> Result<Self, Error> {
        let spec = setup.model.spec();
        for of in controllers {
            let (input, output) = (of.input, of.controller.output());
            let Some(read) = spec
                .outputs
                .get(output)
                .filter(|_| input < spec.inputs.len())
            else {
                return Err(Error::LoopSignals { input, output });
            };
            let read = read.variable;
            // A command that depends on earlier readings only may change its own reading at once.
            let answers_at_once = of.controller.linear(setup.sample_interval()).d != 0.0;
            let driven = controllers.iter().map(|of| Variable::Input(of.input));
            let mut direct = driven.filter(|input| spec.is_direct(read, *input));
            if let Some(changed) = direct.next().filter(|_| answers_at_once) {
                return Err(Error::DirectTerm {
                    output: spec.about(read).name.clone(),
                    input: spec.about(changed).name.clone(),
                });
            }
        }
        require_excitation(setup.records, controllers)?;
        let (fitted, replays) = replayed(controllers, setup.records)?;
        let inputs: Vec<usize> = controllers.iter().map(|of| of.input).collect();
        let response = setup.response(x, &inputs, is_needed);
        let grows = setup.grows(&response);
        let found = Self {
            replays,
            response: Arc::new(response),
            interval: setup.sample_interval(),
            controllers: fitted,
            is_needed,
        };
        Ok(match grows {
            true => found.following(setup, x),
            false => found,
        })
    }

    pub(super) fn with_response(&self, response: LinearResponse) -> Self {
        Self {
            response: Arc::new(response),
            ..self.clone()
        }
    }

    /// The same loop with other records.
    ///
    /// # Errors
    /// If a record lacks a reference, or a command is not held.
    pub(super) fn with_records(&self, records: &[Record]) -> Result<Self, Error> {
        let (controllers, replays) = replayed(&self.controllers, records)?;
        Ok(Self {
            controllers,
            replays,
            ..self.clone()
        })
    }

    /// Whether the model does not follow its records on the measured inputs, so that all its simulations run in the loop.
    #[must_use]
    pub fn is_needed(&self) -> bool {
        self.is_needed
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

    /// The largest magnitude of the eigenvalues of the linear loop over one sampling interval, without limits and dead times, and of the model
    /// alone: above one it grows. `None` where the model has no linear response.
    #[must_use]
    pub fn radius(&self) -> Option<(f64, f64)> {
        if self.response.a.is_empty() {
            return None;
        }
        let controllers = self.controllers.iter().map(|of| &of.controller);
        let controlled = self.response.in_loop(controllers, self.interval);
        let alone = self.response.in_loop([], self.interval);
        Some((spectral_radius(&controlled), spectral_radius(&alone)))
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

/// The controllers, each in the order of its updates that agrees with the records, and their simulations, by record and controller.
fn replayed(
    controllers: &[LoopController],
    records: &[Record],
) -> Result<(Vec<LoopController>, Vec<Vec<Replay>>), Error> {
    let mut fitted = Vec::new();
    let mut replays = vec![Vec::new(); records.len()];
    for of in controllers {
        let (controller, own) = fitting(&of.controller, |controller| {
            let replay = |r: &Record| replay_of(controller, r, of.input, of.reference);
            records.iter().map(replay).collect()
        })?;
        fitted.push(LoopController {
            controller,
            ..of.clone()
        });
        for (of_record, own) in replays.iter_mut().zip(own) {
            of_record.push(own);
        }
    }
    Ok((fitted, replays))
}

/// Checks that something from outside moves the loop: a reference, or an input that no controller drives.
fn require_excitation(records: &[Record], controllers: &[LoopController]) -> Result<(), Error> {
    let moves = |channel: &Channel| {
        let (low, high) = channel.range();
        high > low
    };
    let is_external = |input: &usize| controllers.iter().all(|of| of.input != *input);
    let moved = records.iter().any(|record| {
        let mut inputs = (0..record.inputs.len()).filter(is_external);
        inputs.any(|i| moves(&record.inputs[i])) || record.references.iter().any(moves)
    });
    let constant = records.iter().find_map(|record| {
        let reference = controllers.iter().find_map(|of| of.reference)?;
        Some((record, record.references.get(reference)?))
    });
    match constant.filter(|_| !moved) {
        Some((record, reference)) => Err(Error::ConstantReference {
            record: record.name.clone(),
            value: reference.range().0,
        }),
        None => Ok(()),
    }
}

/// The controllers of one simulated record.
#[derive(Clone)]
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
            let reference = of.reference.and_then(|at| record.references.get(at));
            let reference = reference.map_or(f64::NAN, |channel| channel.values[k]);
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
    /// inputs, so that simulation errors are comparable, unless the model needs the loop ([`SimulatedLoop::is_needed`]). The loop is that of the
    /// records of this setup.
    #[must_use]
    pub fn in_loop(self, simulated: Arc<SimulatedLoop>) -> Self {
        Self {
            reads_driven: simulated.is_read(self.model.spec()),
            simulated_loop: Some(simulated),
            ..self
        }
    }

    /// Root mean square of the difference from the measurements in a simulation ([`ModelSetup::simulate`]), for each output \[its unit\], without
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

    /// The controllers and their loop, if it is simulated.
    #[must_use]
    pub fn simulated_loop(&self) -> Option<&Arc<SimulatedLoop>> {
        self.simulated_loop.as_ref()
    }

    /// The signals of a record that come from outside: in a simulated loop the references, which replace the inputs that controllers drive.
    #[must_use]
    pub fn external_signals<'r>(&self, record: &'r Record) -> Vec<&'r Channel> {
        let inputs = record.inputs.iter().enumerate();
        let external = inputs.map(|(i, input)| {
            let in_loop = self.simulated_loop.iter().flat_map(|of| &of.controllers);
            let mut driven = in_loop.filter(|of| of.input == i);
            let reference = driven.next().and_then(|of| of.reference);
            reference
                .and_then(|at| record.references.get(at))
                .unwrap_or(input)
        });
        external.collect()
    }

    /// Whether all simulations of this setup run in a loop, because the model needs it.
    #[must_use]
    pub fn is_run_in_loop(&self) -> bool {
        self.simulated_loop.as_ref().is_some_and(|of| of.is_needed)
    }

    /// A fit of this setup with the errors of a simulation ([`ModelSetup::simulate`]): the fit in a loop does not compute them.
    #[must_use]
    pub fn with_simulation_errors(&self, mut fit: estimation::Fit) -> estimation::Fit {
        if self.simulated_loop.is_some()
            && let Some(rmse) = self.rmse(&fit.x)
        {
            fit.rmse = rmse;
        }
        fit
    }
}
