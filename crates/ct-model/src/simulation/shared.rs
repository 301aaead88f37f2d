//! A simulation that owns a share of its model.

use std::sync::{Arc, LazyLock};

use super::{Model, NoSolution, Simulation, SimulationNumber};
use crate::spec::ModelSpec;

/// What a simulation stands on between two calls.
static NO_MODEL: LazyLock<Model> = LazyLock::new(|| {
    Model::new(ModelSpec {
        name: String::new(),
        description: String::new(),
        parameters: Vec::new(),
        inputs: Vec::new(),
        states: Vec::new(),
        flows: Vec::new(),
        order: Vec::new(),
        outputs: Vec::new(),
    })
});

/// A [`Simulation`] that owns a share of its model instead of borrowing it: for what lives longer than a function. Its numbers are the same.
///
/// **Cost** beside that of a [`Simulation`]: it is moved, about a kilobyte, in every call.
pub struct SharedSimulation<T> {
    model: Arc<Model>,
    /// There but within a call.
    simulation: Option<Simulation<'static, T>>,
}

impl<T> Simulation<'_, T> {
    /// The same on another borrow of its model.
    fn on(self, model: &Model) -> Simulation<'_, T> {
        Simulation { model, ..self }
    }
}

impl<T: SimulationNumber> SharedSimulation<T> {
    /// As [`Simulation::new`].
    ///
    /// # Panics
    /// Where the numbers of parameters or states are not the model's.
    #[must_use]
    pub fn new(model: Arc<Model>, parameters: &[T], initial: &[T], start: f64) -> Self {
        let simulation = Simulation::new(&model, parameters, initial, start).on(&NO_MODEL);
        Self {
            simulation: Some(simulation),
            model,
        }
    }

    /// As [`Simulation::read`].
    pub fn read(&mut self, inputs: &[f64], outputs: &mut [T]) {
        self.on_its_model(|simulation| simulation.read(inputs, outputs));
    }

    /// As [`Simulation::advance`].
    ///
    /// # Errors
    /// As there.
    pub fn advance(&mut self, from: &[f64], to: &[f64], until: f64) -> Result<(), NoSolution> {
        self.on_its_model(|simulation| simulation.advance(from, to, until))
            .unwrap_or(Ok(()))
    }

    /// The present states.
    #[must_use]
    pub fn state(&self) -> &[T] {
        self.simulation.as_ref().map_or(&[], Simulation::state)
    }

    /// Nothing where a call has panicked before.
    fn on_its_model<R>(&mut self, call: impl FnOnce(&mut Simulation<'_, T>) -> R) -> Option<R> {
        let mut simulation = self.simulation.take()?.on(&self.model);
        let result = call(&mut simulation);
        self.simulation = Some(simulation.on(&NO_MODEL));
        Some(result)
    }
}
