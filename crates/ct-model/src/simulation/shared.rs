//! A simulation that shares ownership of its model.

use std::sync::{Arc, LazyLock};

use super::{Model, NoSolution, Simulation, SimulationNumber};
use crate::spec::ModelSpec;

/// An empty model, which the simulation borrows between two calls.
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

/// A [`Simulation`] that shares ownership of its model instead of borrowing it, so that it may outlive the function that creates it. The
/// results are identical.
///
/// **Cost** in addition to that of a [`Simulation`]: every call moves the simulation, about one kilobyte.
pub struct SharedSimulation<T> {
    model: Arc<Model>,
    /// `None` during a call only.
    simulation: Option<Simulation<'static, T>>,
}

impl<T> Simulation<'_, T> {
    /// The same simulation with another borrow of its model.
    fn on(self, model: &Model) -> Simulation<'_, T> {
        Simulation { model, ..self }
    }
}

impl<T: SimulationNumber> SharedSimulation<T> {
    /// As [`Simulation::new`].
    ///
    /// # Panics
    /// If the number of parameters or states is not that of the model.
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

    /// Calls `call` with the simulation; `None` if an earlier call has panicked.
    fn on_its_model<R>(&mut self, call: impl FnOnce(&mut Simulation<'_, T>) -> R) -> Option<R> {
        let mut simulation = self.simulation.take()?.on(&self.model);
        let result = call(&mut simulation);
        self.simulation = Some(simulation.on(&NO_MODEL));
        Some(result)
    }
}
